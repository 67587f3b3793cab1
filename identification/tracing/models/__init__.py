"""Models under trial while tracing: what they are fitted to, how, and where the first one comes from."""
