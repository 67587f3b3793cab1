"""The actuator itself: positioner, servomotor, valve, and the two forms of its friction."""
