"""Lights that are not there yet: where one could stand, and how much it would help."""
