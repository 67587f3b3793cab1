"""Effects that add a force on the stem."""
