"""Rendering a basis with Mitsuba: all lights in one pass, or one after the other."""
