"""A source into crash-safe recordings."""
