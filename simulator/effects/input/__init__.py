"""Effects between the drive and the force on the stem."""
