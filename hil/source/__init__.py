"""Where values come from: samples with a quality for every value, live or from a recording."""
