"""Imposed motion: the rig moves the stem, and the force is predicted."""
