"""A suggested light, as data: its place, its emission, and its gain."""

import json
from dataclasses import dataclass, field

from lightpaint.arrays import RGB, Floats, Position
from lightpaint.colour import Photometry, photometry, point_flux
from lightpaint.keywords import keywords

#: The unit of a point light's intensity.
UNIT = "W/sr"


@keywords()
@dataclass(frozen=True)
class Suggestion:
    """A point light to add to the scene.

    Attributes:
        name: An unused name.
        position: In units of the scene.
        emission: Intensity per channel, W/sr.
        gain_share: The share of the error (energy) that this light removes, given those before it.
        missed_share: The share that remains, with this light and those before it.
        xml: The emitter for the scene's XML.
        seen_at: Its place in the picture, from (0, 0) top left to (1, 1); None if outside.
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
        """Return its colour, and its amount of light."""
        flux = point_flux()
        unit_flux = (flux, flux, flux)
        return photometry(self.emission, unit=UNIT, unit_flux=unit_flux, cd_per_unit=cd_per_unit)


@keywords()
@dataclass(frozen=True)
class MoveSuggestion:
    """A light of the scene to turn, instead of a new one.

    Attributes:
        name: The light.
        turn: Degrees that it turns if it alone may turn by up to `aim`.
        gain_share: The share of the error (energy) that this turn removes, by the same search.
        aim: Degrees to let it turn by.
        without: (h, w, 3) linear, the solved picture, small.
        with_it: (h, w, 3), the same after the turn, with all lights solved again.

    Examples:
        >>> look = lp.paint_with_light("room.xml", "painting.exr", "evening", spp=4, suggest=1)
        >>> look.move_suggestion is None
        True
    """

    name: str
    turn: float
    gain_share: float
    aim: int
    without: Floats = field(repr=False, compare=False)
    with_it: Floats = field(repr=False, compare=False)

    @property
    def toml(self) -> str:
        """Lines for the lights file that let it turn."""
        return f"[light.{json.dumps(self.name, ensure_ascii=False)}]\naim = {self.aim}"
