"""A source recorded into crash-safe files: batches, rotation, and a session until a signal or a deadline."""
