"""A lighting as data and as a file, with the proof of how good it is."""
