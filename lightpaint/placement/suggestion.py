"""A light that would help, as data: where it stands, what it emits, what it takes of the miss."""

from dataclasses import dataclass, field

from lightpaint.arrays import RGB, Floats, Position
from lightpaint.colour.photometry import Photometry, photometry, point_flux

#: Of the intensity of a point light.
UNIT = "W/sr"


@dataclass(frozen=True)
class Suggestion:
    """A point light to add to the scene.

    position: in units of the scene. emission: intensity per channel, W/sr.
    gain_share: of what is missed (energy), what this light takes away beside those before it.
    missed_share: what is left of it, with this light and those before it.
    xml: the emitter, to be put into the scene's XML as it is.
    seen_at: where in the picture it is, from (0, 0) top left to (1, 1); None if not in it.
    without, with_it: (h, w, 3) linear, the solved picture before and with this light, small.
    """

    name: str
    position: Position
    emission: RGB
    gain_share: float
    missed_share: float
    xml: str
    seen_at: tuple[float, float] | None
    without: Floats = field(repr=False, compare=False)
    with_it: Floats = field(repr=False, compare=False)

    def photometry(self, cd_per_unit: float | None = None) -> Photometry:
        """Its colour, and how much light it is."""
        flux = point_flux()
        unit_flux = (flux, flux, flux)
        return photometry(self.emission, unit=UNIT, unit_flux=unit_flux, cd_per_unit=cd_per_unit)
