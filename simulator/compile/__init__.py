"""How the physics is compiled and run: one step, its loop over samples, in C or in numba."""
