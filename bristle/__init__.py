"""Bristle: learns what a control valve really does from measured data, and then watches it."""
