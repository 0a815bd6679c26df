"""Prediction against an independent render, judged by the noise of both.

The predicted image Σ w_i Φ_i and the render of the relit scene estimate the same picture
from different samples. They differ by noise; if they differ by more, something is wrong,
and the difference in units of the noise (z) tells.
"""

from dataclasses import dataclass

import numpy as np

from lightpaint.errors import SizeError
from lightpaint.images.color import delta_e
from lightpaint.images.display import choose_exposure
from lightpaint.images.estimate import Estimate
from lightpaint.images.exr import Floats
from lightpaint.progress import Progress, silent
from lightpaint.scene.render import Stream, render
from lightpaint.scene.scene import Scene

#: Side of the blocks of pixels over which differences are tested. One pair of halves gives
#: one degree of freedom per pixel; 64 of them make the ratio close to normal.
BLOCK = 8
#: Standard errors at which a mean difference counts as real, and the slack of the test on
#: the spread: both far enough out that sound renders pass thousands of times in a row.
LIMIT = 5.0

#: Relative round-off of float32 sums, below which a difference is no news.
PRECISION = 1e-5


@dataclass(frozen=True)
class Verification:
    """How far prediction and verification are apart.

    verified: the independent render. z: (h, w, 3), difference per pixel in standard
    errors, the noise pooled over neighbours.
    z_rms: root mean square of the differences of 8x8 blocks in their standard errors: 1 if
    there is only noise. z_mean: (3,) difference of the whole image in standard errors.
    rmse: of the pixels, in radiance; noise_rmse: what noise alone would give.
    delta_e_mean, delta_e_95: CIEDE2000 at the exposure of the report: mean, 95th percentile.
    """

    verified: Estimate
    z: Floats
    z_rms: float
    z_rms_limit: float
    z_mean: tuple[float, float, float]
    rmse: float
    noise_rmse: float
    delta_e_mean: float
    delta_e_95: float

    @property
    def agrees(self) -> bool:
        """Whether the difference can be noise alone."""
        return self.z_rms <= self.z_rms_limit and max(map(abs, self.z_mean)) <= LIMIT


def verify(
    predicted: Estimate,
    relit: Scene,
    *,
    spp: int | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> Verification:
    """Render the relit scene with samples no basis ever uses, and compare.

    spp: samples per pixel (the scene's own number by default).
    """
    if relit.size != predicted.size:
        raise SizeError(
            f"the prediction is {predicted.size[1]}x{predicted.size[0]} but {relit.path} renders "
            f"{relit.size[1]}x{relit.size[0]}: they belong to different scenes or sensors"
        )
    verified = render(
        relit,
        spp=spp,
        seed=seed,
        stream=Stream.VERIFICATION,
        label="verification",
        progress=progress,
    )
    return compare(predicted, verified)


def compare(predicted: Estimate, verified: Estimate) -> Verification:
    """Judge the difference of two independent estimates of one picture."""
    difference = predicted.image.astype(np.float64) - verified.image
    squares = np.square(predicted.half_difference, dtype=np.float64)
    squares += np.square(verified.half_difference, dtype=np.float64)
    # Round-off is noise too; it keeps 0/0 out where nothing was ever lit.
    magnitude = np.abs(predicted.image) + np.abs(verified.image)
    squares += np.square(PRECISION * magnitude) + np.finfo(np.float32).tiny

    pooled = predicted.variance() + verified.variance() + np.square(PRECISION * magnitude)
    z = difference / np.sqrt(pooled + np.finfo(np.float32).tiny)

    # A block's mean difference, over the standard error that its own pixels show.
    # Where a rare bright sample is all the noise there is, both halves may show it alike and
    # seem to know more than they do: a block counts for no more than LIMIT.
    block_z = _block_sums(difference) / np.sqrt(_block_sums(squares))
    block_z = np.clip(block_z, -LIMIT, LIMIT)
    z_rms = float(np.sqrt(np.square(block_z).mean()))
    # For n normal z, the mean of z² is 1 ± √(2/n); the channels of a pixel are not
    # independent, so n counts blocks. 64 degrees of freedom add 2/62.
    blocks = block_z.size / 3
    limit = float(np.sqrt(1 + 2 / (BLOCK**2 - 2) + LIMIT * np.sqrt(2 / blocks)))
    z_mean = difference.sum(axis=(0, 1)) / np.sqrt(squares.sum(axis=(0, 1)))

    scale = 2.0 ** choose_exposure(verified.image)
    differences = delta_e(predicted.image * scale, verified.image * scale)
    return Verification(
        verified=verified,
        z=z.astype(np.float32),
        z_rms=z_rms,
        z_rms_limit=limit,
        z_mean=(float(z_mean[0]), float(z_mean[1]), float(z_mean[2])),
        rmse=float(np.sqrt(np.square(difference).mean())),
        noise_rmse=float(np.sqrt(squares.mean())),
        delta_e_mean=float(differences.mean()),
        delta_e_95=float(np.percentile(differences, 95)),
    )


def _block_sums(image: Floats) -> Floats:
    """Sums over whole blocks of BLOCK x BLOCK pixels; the ragged border joins the last ones."""
    rows = np.arange(0, max(image.shape[0] - BLOCK + 1, 1), BLOCK)
    columns = np.arange(0, max(image.shape[1] - BLOCK + 1, 1), BLOCK)
    return np.add.reduceat(np.add.reduceat(image, rows, axis=0), columns, axis=1)
