"""What registers mean: points, coding, register maps, and rings of samples."""
