"""Where values come from: samples with a quality for every value, polled live or played back from a recording."""
