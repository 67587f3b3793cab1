"""Words and figures of the pages: numbers for people, key figures of a valve, verdicts in sentences."""
