"""Types of fixtures, as GDTF (DIN SPEC 15800) describes them: geometry, channels, emitters."""
