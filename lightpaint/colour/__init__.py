"""Colours as numbers: spaces, temperatures, view transforms, displays. Knows no files."""
