"""The noise of lights compared with their light, which tells when one needs no more samples."""

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.basis import Basis

#: A render that may stop early takes at least this share of its samples and this many per pixel,
#: since the noise of fewer is poorly known, and then looks after each further eighth.
LEAST_SHARE, LEAST_SPP, STEP_SHARE = 1 / 4, 8, 1 / 8

#: Share of the pixels, those with the most noise, that do not count. A single stray sample may have
#: more than all the others, and four times as many samples would not remove it.
STRAY_SHARE = 1 / 1000


def relative_variances(basis: Basis) -> Doubles:
    """Return Σ noise² / Σ light² for each light, (n,), over all pixels but those with stray
    samples; infinite for a black light.

    Its expectation falls as 1 / samples.
    """
    return np.array(
        [_relative_variance(*pair) for pair in zip(basis.planes, basis.noise, strict=True)]
    )


def _relative_variance(light: Floats, noise: Floats) -> float:
    light_squares, noise_squares = (
        np.square(x, dtype=np.float64).sum(axis=-1).ravel() for x in (light, noise)
    )
    count = noise_squares.size - int(np.ceil(STRAY_SHARE * noise_squares.size))
    counted = np.argpartition(noise_squares, count - 1)[:count]
    light_total = light_squares[counted].sum()
    return float(noise_squares[counted].sum() / light_total) if light_total > 0 else np.inf


def is_clean(basis: Basis, variance: float) -> bool:
    """Return True if no light has a larger relative variance."""
    return bool((relative_variances(basis) <= variance).all())
