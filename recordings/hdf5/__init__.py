"""The file format: HDF5 files read whole or in part, written at once or live, and put right after a crash."""
