"""Neural observers: one for all outputs, one dedicated to each, and a search for their structure."""
