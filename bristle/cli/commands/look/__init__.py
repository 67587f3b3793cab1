"""Commands that only look: at a device, at the program itself."""
