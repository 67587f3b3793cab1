"""Banks: several residual generators side by side, so that what they say together tells more."""
