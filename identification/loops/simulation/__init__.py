"""Loops whose cause of oscillation is known, and what historians keep of them."""
