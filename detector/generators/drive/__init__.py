"""Positioner and servomotor: their learned model, its compiled loop, and its signals between their samples."""
