"""How well parameters are known: covariance, profile likelihood, bootstrap."""
