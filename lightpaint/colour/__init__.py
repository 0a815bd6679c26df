"""Colours as numbers: spaces, temperatures, view transforms, displays. No files are read here."""
