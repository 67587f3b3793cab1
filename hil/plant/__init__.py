"""The plants that a server serves."""
