"""Which lights are there? A Mitsuba scene XML becomes a `Scene` with named lights."""
