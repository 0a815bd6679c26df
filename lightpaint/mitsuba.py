"""Luminaires for plain Mitsuba: `import lightpaint.mitsuba` adds the emitters `ies` and `iesarea`.

They take the light distribution of a luminaire from an IES (LM-63) or EULUMDAT file. They are there
in variants of Dr.Jit in RGB, such as `llvm_ad_rgb`, whether set before or after the import.
docs/luminaires.md lists their parameters.
"""

from lightpaint.luminaires.registration import register_luminaires_always

register_luminaires_always()
