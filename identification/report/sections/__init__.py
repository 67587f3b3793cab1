"""The sections of the pages: each has its words, its plots, and a template of the same name."""
