"""Limits of emissions, as people give them, in the unknowns of a light."""

from typing import Any

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis.lights import BasisLight
from lightpaint.colour.color import luminance
from lightpaint.errors import ConstraintError
from lightpaint.lighting.constraints.constraints import LightConstraint
from lightpaint.lighting.constraints.values import Level

#: Share by which a lower limit may exceed an upper one before they contradict: round-off.
ROUND_OFF = 1e-12


def dimmer_limits(
    constraint: LightConstraint, direction: Doubles, light: BasisLight
) -> tuple[float, float]:
    """Return bounds on x for an emission of x times `direction`."""
    lower, upper = 0.0, np.inf
    for level, is_least in ((constraint.least, True), (constraint.most, False)):
        if level is None:
            continue
        if isinstance(level.amount, tuple):
            with np.errstate(divide="ignore", invalid="ignore"):
                bounds = np.array(level.amount) / direction
            # A light without a channel satisfies any upper limit there, and no lower one.
            bounds = np.where(direction > 0, bounds, np.inf)
            if is_least:
                bounds = np.where((direction == 0) & (np.array(level.amount) == 0), 0, bounds)
            bound = float(bounds.max() if is_least else bounds.min())
        else:
            bound = _luminance(level, light, constraint) / float(luminance(direction))
        lower, upper = (max(lower, bound), upper) if is_least else (lower, min(upper, bound))
    return lower, upper


def mix_limits(
    constraint: LightConstraint, light: BasisLight, count: int
) -> tuple[Doubles, Doubles, float, float]:
    """Return bounds on the unknowns, and on the luminance of their sum."""
    lower, upper = np.zeros(count), np.full(count, np.inf)
    least, most = 0.0, np.inf
    for level, is_least in ((constraint.least, True), (constraint.most, False)):
        if level is None:
            continue
        if not isinstance(level.amount, tuple):
            value = _luminance(level, light, constraint)
            least, most = (value, most) if is_least else (least, value)
        elif constraint.primaries is not None:
            raise ConstraintError(
                f"{constraint.where}.limits has {level} for a light that mixes primaries: give a "
                "luminance like 2.5 or a share like 40%"
            )
        elif is_least:
            lower = np.array(level.amount)
        else:
            upper = np.array(level.amount)
    check_room(constraint, light, lower, upper)
    return lower, upper, least, most


def _luminance(level: Level, light: BasisLight, constraint: LightConstraint) -> float:
    assert not isinstance(level.amount, tuple)
    if not level.is_share:
        return level.amount
    now = float(luminance(np.array(light.emission)))
    if now == 0:
        raise ConstraintError(
            f"{constraint.where}.limits has {level} of the current luminance, but "
            f"{light.name!r} is currently off: give a number"
        )
    return level.amount * now


def check_grey(constraint: LightConstraint, light: BasisLight) -> None:
    """Refuse limits per channel for a light that has one weight for all of them."""
    for level in (constraint.least, constraint.most):
        if light.is_scalar and level is not None and isinstance(level.amount, tuple):
            raise ConstraintError(
                f"{constraint.where}.limits has {level}, and {light.name!r} can only be dimmed as "
                f"a "
                "whole: give one number"
            )


def check_room(constraint: LightConstraint, light: BasisLight, lower: Any, upper: Any) -> None:
    """Refuse limits that leave nothing between them."""
    if (np.asarray(lower) > np.asarray(upper) * (1 + ROUND_OFF)).any() or np.isinf(lower).any():
        raise ConstraintError(
            f"{constraint.where} asks {light.name!r} for {constraint.label}, which leaves it no "
            f"emission "
            "at all: widen the limits"
        )
