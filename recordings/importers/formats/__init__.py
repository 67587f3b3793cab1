"""One file for each kind of foreign file; a `FileFormat` that a module here assigns is found by itself."""
