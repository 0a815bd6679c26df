"""Rigging: lights that may move and lights to add, by a lights file and options."""
