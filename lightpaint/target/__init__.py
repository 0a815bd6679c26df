"""Targets: a painting becomes a `Target`, an image with importance."""
