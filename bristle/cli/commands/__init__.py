"""The commands, one module each with one function `command`."""
