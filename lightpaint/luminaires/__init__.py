"""Luminaires: measured light distributions, their files, and emitters of Mitsuba that have them."""

#: Names of the emitters that lightpaint adds to Mitsuba: a point, and a flat shape.
POINT_PLUGIN, AREA_PLUGIN = "ies", "iesarea"
LUMINAIRE_PLUGINS = frozenset({POINT_PLUGIN, AREA_PLUGIN})

#: Unit of the emission of luminaires, which is a multiple of that at full.
FULL = "× at full"
