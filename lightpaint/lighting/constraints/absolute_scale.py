"""The scale of a scene with luminaires, which are in candela whatever else is in it."""

from collections.abc import Sequence
from dataclasses import replace

from lightpaint.basis import BasisLight
from lightpaint.errors import ConstraintError
from lightpaint.lighting.constraints.constraints import Constraints, LightConstraint
from lightpaint.lighting.constraints.light_constraints import constraints_by_light
from lightpaint.luminaires import LUMINAIRE_PLUGINS
from lightpaint.sentences import Hint


def with_scale(constraints: Constraints, lights: Sequence[BasisLight]) -> Constraints:
    """Return constraints whose scale is 1 cd/m² for a radiance of 1, if there are luminaires among
    the lights, and if nothing says another.
    """
    if constraints.cd_per_unit is not None or not any(map(_is_luminaire, lights)):
        return constraints
    return replace(constraints, cd_per_unit=1.0)


def with_sure_scale(constraints: Constraints, lights: Sequence[BasisLight]) -> Constraints:
    """Return constraints as `with_scale` does.

    Raises ConstraintError if nothing says the scale, and a light beside luminaires is not in
    candela or lumens: its brightness would be a guess.
    """
    for light in unscaled_lights(constraints, lights):
        raise unscaled_error(light)
    return with_scale(constraints, lights)


def unscaled_lights(
    constraints: Constraints, lights: Sequence[BasisLight]
) -> tuple[BasisLight, ...]:
    """Return the lights beside luminaires that are not in candela or lumens; none if constraints
    say the scale.
    """
    if with_scale(constraints, lights) is constraints:
        return ()
    pairs = zip(lights, constraints_by_light(constraints, lights), strict=True)
    return tuple(x for x, given in pairs if not (_is_luminaire(x) or _is_absolute(given)))


def unscaled_error(light: BasisLight, place: str = "") -> ConstraintError:
    """Return the error of a light whose brightness is a guess. place: what it lights."""
    return ConstraintError(
        f"light {light.name!r}{place and f', which reaches {place},'} is in {light.unit}, beside "
        "luminaires in candela: list its emitters in cd or lm, or say how many candelas an "
        "intensity of 1 is, by ",
        Hint("cd_per_unit", 1),
        " or by cd_per_unit = 1 in the lights file",
    )


def _is_luminaire(light: BasisLight) -> bool:
    return LUMINAIRE_PLUGINS.issuperset(light.plugin.split(" + "))


def _is_absolute(constraint: LightConstraint | None) -> bool:
    if constraint is None:
        return False
    is_mixed = bool(constraint.emitters) and all(x.per != "Y" for x in constraint.emitters)
    return constraint.off or is_mixed


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
