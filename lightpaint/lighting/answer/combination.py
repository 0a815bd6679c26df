"""The linear sum of basis images, Σ w_i Φ_i."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, as_rgb
from lightpaint.basis import Basis
from lightpaint.display_text import some_of
from lightpaint.errors import LightingError, UnknownLightError
from lightpaint.images import Estimate
from lightpaint.keywords import keywords
from lightpaint.lighting.answer.lighting import Lighting, LightSetting


@keywords()
def combine(
    basis: Basis, lighting: Lighting | Mapping[str, float | Sequence[float]] | npt.ArrayLike
) -> Estimate:
    """Return the predicted image Σ w_i Φ_i, with the noise of the basis.

    Args:
        basis: Of n lights.
        lighting: Of the same lights; or weights >= 0 of one or more of them by name, a number or
            RGB each, the others being off; or (n,) or (n, 3) weights in the order of the basis.
            Fixed lights have the weight 1.

    Raises:
        LightingError: If the two do not name the same lights, or for invalid weights.

    Examples:
        >>> solution = lp.solve(basis, target)
        >>> bool(np.abs(lp.combine(basis, solution.lighting).image - target.image).max() < 2e-3)
        True
        >>> twice = lp.combine(basis, {"bulb": 2}).image
        >>> bool(np.abs(twice - 2 * basis.image("bulb")).max() < 1e-6)
        True
    """
    lighting_or_weights = lighting
    weights = (
        lighting_or_weights.weights_for(basis)
        if isinstance(lighting_or_weights, Lighting)
        else _weights(basis, lighting_or_weights)
    )
    return Estimate(basis.mix(weights), basis.noise.mix(weights))


def dimmed(lighting: Lighting, factor: float) -> Lighting:
    """Return a lighting whose lights, but for fixed ones, shine at `factor` times their emission.

    It is not an answer to the painting any more, so that it has no certificate and no error bars.
    """
    if factor == 1:
        return lighting

    def setting(light: LightSetting) -> LightSetting:
        if light.is_fixed:
            return light
        if light.mix is not None:
            return light.with_mix(factor * np.array(light.mix))
        emission, weight = (as_rgb(factor * np.asarray(x)) for x in (light.emission, light.weight))
        return light.with_emission(emission, weight=weight)

    return replace(lighting, lights=tuple(map(setting, lighting.lights)), certificate=None)


def _weights(basis: Basis, values: Mapping[str, Any] | npt.ArrayLike) -> Doubles:
    """Return weights (n, 3) from weights by name, or of all lights in their order."""
    n, names = len(basis.lights), basis.names
    weights = np.where(basis.is_fixed[:, None], np.ones(3), np.zeros(3))
    if isinstance(values, Mapping):
        if not values:
            raise LightingError(
                f"the lighting names no light: give the weight of one at least, like "
                f"{{{names[0]!r}: 1}}, or an array of {n} weights, like zeros for darkness"
            )
        if unknown := [str(name) for name in values if name not in names]:
            raise UnknownLightError(
                f"no light {some_of(unknown, room=400)} in the basis: it has "
                f"{some_of(names, room=400)}"
            )
        for name, weight in values.items():
            weights[names.index(name)] = _numbers(weight, f"light {name!r}", ((), (3,)))
    else:
        whole = _numbers(values, f"a lighting of {n} lights", ((n,), (n, 3)))
        weights = np.broadcast_to(whole.reshape(n, -1), (n, 3)).copy()
    for k in np.flatnonzero(basis.is_fixed & (weights != 1).any(axis=1)):
        raise LightingError(f"light {names[k]!r} is fixed: its weight is 1")
    return weights


def _numbers(values: Any, name: str, shapes: tuple[tuple[int, ...], ...]) -> Doubles:
    """Return weights as an array of one of these shapes. Raises LightingError for anything else."""
    expected = " or ".join(str(shape) if shape else "one number" for shape in shapes)
    try:
        weights = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise LightingError(
            f"{name}: weights of the type {type(values).__name__}: expected {expected}"
        ) from None
    if weights.shape not in shapes:
        raise LightingError(f"{name}: weights of the shape {weights.shape}: expected {expected}")
    if (wrong := weights[~(np.isfinite(weights) & (weights >= 0))]).size:
        raise LightingError(f"{name}: a weight of {wrong[0]:g}: expected finite numbers >= 0")
    return weights
