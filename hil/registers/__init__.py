"""What registers mean: points and how they are coded, register maps from files, and rings of samples."""
