"""Friction models of the source against a recorded force: each is fitted to the motion as it was, and judged by it."""
