"""How parameters are estimated: output error, noise-aware, and with an imposed motion."""
