"""A basis from another renderer's light groups: its layers, their names and their sum."""
