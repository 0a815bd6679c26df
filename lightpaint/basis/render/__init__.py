"""Rendering a basis, with Mitsuba: one pass for all lights, or one after the other."""
