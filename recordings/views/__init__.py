"""A recording for the eye: its description in words, its pictures, and the page that has both."""
