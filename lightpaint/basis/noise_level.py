"""The noise of lights compared with their light."""

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.planes import Planes

#: Share of the pixels, those with the most noise, that do not count. A single stray sample may have
#: more than all the others, and four times as many samples would not remove it.
STRAY_SHARE = 1 / 1000


def relative_variances(planes: Planes, noise: Planes) -> Doubles:
    """Return Σ noise² / Σ light² for each light, (n,), over all pixels but those with stray
    samples; infinite for a black light.
    """
    return np.array([_relative_variance(*pair) for pair in zip(planes, noise, strict=True)])


def _relative_variance(light: Floats, noise: Floats) -> float:
    light_squares, noise_squares = (
        np.square(x, dtype=np.float64).sum(axis=-1).ravel() for x in (light, noise)
    )
    count = noise_squares.size - int(np.ceil(STRAY_SHARE * noise_squares.size))
    counted = np.argpartition(noise_squares, count - 1)[:count]
    light_total = light_squares[counted].sum()
    return float(noise_squares[counted].sum() / light_total) if light_total > 0 else np.inf
