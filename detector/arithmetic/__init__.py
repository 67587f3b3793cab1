"""Compiled arithmetic that gives equal bits for equal inputs, and is compiled once."""
