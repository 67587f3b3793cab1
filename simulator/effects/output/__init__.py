"""Effects between the stem and the measured position."""
