"""Lights that are not there yet: their possible places, and their gains."""
