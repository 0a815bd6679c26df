"""A light that would help, as data: where it stands, what it emits, what it takes of the miss."""

from dataclasses import dataclass, field

from lightpaint.arrays import RGB, Floats, Position
from lightpaint.colour.photometry import Photometry, photometry, point_flux
from lightpaint.keywords import keywords

#: Of the intensity of a point light.
UNIT = "W/sr"


@keywords()
@dataclass(frozen=True)
class Suggestion:
    """A point light to add to the scene.

    Attributes:
        name: That no light of the scene has.
        position: In units of the scene.
        emission: Intensity per channel, W/sr.
        gain_share: Of what is missed (energy), what this light takes away beside those before it.
        missed_share: What is left of it, with this light and those before it.
        xml: The emitter, to be put into the scene's XML as it is.
        seen_at: Where in the picture it is, from (0, 0) top left to (1, 1); None if not in it.
        without: (h, w, 3) linear, the solved picture before this light, small.
        with_it: (h, w, 3), the same with it.

    Examples:
        >>> scene = lp.load_scene("room.xml")
        >>> for light in lp.suggest_lights(scene, basis, lp.solve(basis, target)):
        ...     print(light.xml)
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
