"""Names of the emitters that lightpaint adds to Mitsuba, and the unit of their emission."""

#: A point, and a flat shape.
POINT_PLUGIN, AREA_PLUGIN = "ies", "iesarea"
LUMINAIRE_PLUGINS = frozenset({POINT_PLUGIN, AREA_PLUGIN})

#: Unit of luminaires, whose emission is a multiple of that at full.
FULL = "× at full"
