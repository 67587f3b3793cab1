"""A source watched by detectors: events, and what was learned."""
