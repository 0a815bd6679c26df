"""Scenes: a Mitsuba XML becomes a `Scene` with named lights."""
