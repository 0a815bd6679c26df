"""The scale of a scene with luminaires, or lamps in candela or lumens, whatever else is in it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from lightpaint.basis import BasisLight
from lightpaint.errors import ConstraintError
from lightpaint.lighting.constraints.constraint_table import Constraints, LightConstraint
from lightpaint.lighting.constraints.light_constraints import constraints_by_light
from lightpaint.luminaires import LUMINAIRE_PLUGINS
from lightpaint.sentences import Hint


@dataclass(frozen=True)
class Scale:
    """The scale of lights.

    cd_per_unit: cd/m² that a radiance of 1 stands for; None if nothing says it. unscaled: lights
    for which that is a guess.
    """

    cd_per_unit: float | None
    unscaled: tuple[BasisLight, ...] = ()

    @classmethod
    def of(cls, constraints: Constraints, lights: Sequence[BasisLight]) -> "Scale":
        """Return the scale that constraints say; else 1 cd/m², if some of the lights are
        luminaires, or lamps in candela or lumens, which leaves the others unscaled.
        """
        if constraints.cd_per_unit is not None:
            return cls(constraints.cd_per_unit)
        by_light = constraints_by_light(constraints, lights)
        is_scaled = [_is_scaled(*pair) for pair in zip(lights, by_light, strict=True)]
        if not any(is_scaled):
            return cls(None)
        is_off = [given is not None and given.off for given in by_light]
        rows = zip(lights, is_scaled, is_off, strict=True)
        return cls(1.0, tuple(light for light, *known in rows if not any(known)))


def with_scale(constraints: Constraints, lights: Sequence[BasisLight]) -> Constraints:
    """Return constraints with the scale that they and the lights say, if they do."""
    return replace(constraints, cd_per_unit=Scale.of(constraints, lights).cd_per_unit)


def with_sure_scale(constraints: Constraints, lights: Sequence[BasisLight]) -> Constraints:
    """Return constraints as `with_scale` does.

    Raises ConstraintError if nothing says the scale, and a light beside those in candela or lumens
    is not: its brightness would be a guess.
    """
    scale = Scale.of(constraints, lights)
    for light in scale.unscaled:
        raise unscaled_error(light)
    return replace(constraints, cd_per_unit=scale.cd_per_unit)


def unscaled_error(light: BasisLight, place: str = "") -> ConstraintError:
    """Return the error of a light whose brightness is a guess. place: what it lights."""
    return ConstraintError(
        f"light {light.name!r}{place and f', which reaches {place},'} is in {light.unit}, beside "
        "lamps in candela or lumens: list its emitters in cd or lm, or say how many candelas an "
        "intensity of 1 is, by ",
        Hint("cd_per_unit", 1),
        " or by cd_per_unit = 1 in the lights file",
    )


def _is_scaled(light: BasisLight, given: LightConstraint | None) -> bool:
    """Return whether a light is a luminaire, or a lamp whose emitters are in candela or lumens."""
    if LUMINAIRE_PLUGINS.issuperset(light.plugin.split(" + ")):
        return True
    return given is not None and bool(given.emitters) and all(x.per != "Y" for x in given.emitters)


def agreed_scale(of_luminaires: float | None, given: float | None) -> float | None:
    """Return the candelas of an intensity of 1.

    of_luminaires: at which luminaires of a scene are; None without any. given: by the user.
    Raises ConstraintError if the two differ.
    """
    if of_luminaires is None or given is None or of_luminaires == given:
        return of_luminaires if given is None else given
    raise ConstraintError(
        f"the scene's luminaires are in candela at {of_luminaires:g} for an intensity of 1, and ",
        Hint("cd_per_unit", given),
        f" says {given:g}: set cd_per_unit = {given:g} in the lights file",
    )
