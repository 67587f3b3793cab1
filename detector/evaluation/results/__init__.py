"""An evaluation on paper: tables, one HTML page, and the files."""
