"""Rigging: lights that may move and lights to add, as a lights file and options name them."""
