"""Effects that change the friction of the stem."""
