"""Noise-aware: parameters and motion estimated together, where the force is noisy."""
