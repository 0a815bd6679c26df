"""Checks of a scene's files before Mitsuba reads them, since Mitsuba trusts its input."""
