"""Colours as numbers: spaces, temperatures, views and what a display shows. Knows no files."""
