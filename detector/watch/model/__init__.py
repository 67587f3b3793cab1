"""The residual generator that an identified model makes: its filter, its innovation, and how it is tuned to a plant."""
