"""The cone of Mitsuba's spot that comes closest to the beam and field angles of a fixture."""

import math

from lightpaint.colour import spot_flux

#: Widest cone that Mitsuba's spot has, in degrees from its axis.
WIDEST = 89.0

#: Least share of a cone over which a spot fades: its beam must be narrower than its cutoff.
LEAST_FADE = 1e-3


def spot_cone(beam_angle: float, field_angle: float) -> tuple[float, float]:
    """Return cutoff and beam width of a spot, in degrees from its axis.

    beam_angle, field_angle: full angles b and f at which the intensity is 50 % and 10 %. Between
    its beam width w and its cutoff c, Mitsuba's spot falls linearly with the angle θ,
    (c − θ)/(c − w), which is 1/2 at b/2 and 1/10 at f/2 for

      c = f/2 + (f − b)/8      w = b/2 − 5 (f − b)/8

    A field of more than 1.8 times the beam would need w < 0: such a spot falls from its axis on,
    and has 10 % at f/2 alone. Without a fade, f = b, both are b/2.
    """
    beam, field = beam_angle / 2, max(field_angle, beam_angle) / 2
    cutoff, width = field + 0.25 * (field - beam), beam - 1.25 * (field - beam)
    if width < 0:
        cutoff, width = field / 0.9, 0.0
    cutoff = min(cutoff, WIDEST)
    return cutoff, min(width, cutoff * (1 - LEAST_FADE))


def solid_angle(beam_angle: float, field_angle: float) -> float:
    """Return lumens per candela of a spot, the integral of its profile over all directions."""
    cutoff, width = spot_cone(beam_angle, field_angle)
    return spot_flux(math.radians(cutoff), math.radians(width))
