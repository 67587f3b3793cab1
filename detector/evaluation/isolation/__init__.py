"""Which fault it is, and which faults can be told apart at all."""
