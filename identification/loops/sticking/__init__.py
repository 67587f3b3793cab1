"""Models of a sticking valve in two parameters, S and J."""
