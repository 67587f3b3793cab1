"""A recording made ready: contiguous segments in SI units, smoothed motion, noise levels, the force between samples."""
