"""Measurements of speed, memory and accuracy, as ratios against named alternatives run side by side."""
