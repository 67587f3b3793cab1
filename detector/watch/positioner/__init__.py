"""The position that the set point leads to: a loop of positioner and actuator learned from data, and what it misses."""
