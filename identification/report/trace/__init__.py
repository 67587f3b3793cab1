"""The sections of the page of a trace: the answer, where it shows, what was tried."""
