"""Lights that are missing: where one more would help most."""
