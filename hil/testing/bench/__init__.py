"""Simulated valves in the hands of a test: time on demand, faults of valve and line, and what happened, recorded."""
