"""Pixels averaged in blocks, where single ones are mostly noise.

What a display shows of a noisy pixel is not, on average, what it shows of the light there: its
curve is bent, and steepest in the dark. A fit of noisy pixels makes up for that with light that
nobody painted, and a lamp of which the samples show little but stray pixels may become anything.
The remedy is the average of a block: as many more samples of nearly the same light. How large
blocks have to be follows from the noise of the present look, as the display shows it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.planes import as_planes
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.images.pixel_blocks import block_sums, enlarged
from lightpaint.lighting.loss.lit_pixels import LitPixels
from lightpaint.lighting.loss.loss import Cut, Loss
from lightpaint.lighting.loss.weight_penalty import to_present
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.views import Views

#: Noise of the present look beside the display's range, root mean square, up to which single pixels
#: are fitted: that of some 32 samples per pixel on the shipped scenes (docs/benchmarks.md).
NOISY_DISPLAY = 0.035

#: Sides of blocks that are tried, and blocks along the shorter side of a picture, at least.
SIDES, FEWEST_BLOCKS = (1, 2, 3, 4, 6, 8), 16
#: Pixels that are enough to know the noise of a picture, and rows of a strip of them.
ENOUGH, STRIP_ROWS = 2**16, 24

#: Strength of the pull to the present by what is noise of a light.
PRIOR = 0.1


@dataclass(frozen=True)
class BinnedPixels:
    """Blocks of all views behind each other, as a picture of one row.

    Attributes:
        basis: (n, 1, p, 3) images of the lights, means over each block of what counts in it.
        loss: What a picture of these blocks costs; one counts as much as all its pixels.
        side: Pixels along the side of a block.
    """

    basis: Basis
    loss: Loss
    side: int

    @cached_property
    def equations(self) -> NormalEquations:
        """The linear problem of what was meant at the present, each block as important as its
        pixels.
        """
        meant = self.loss.meant(self.basis.mix(self.basis.present_weights))
        return NormalEquations.of(self.basis, meant, self.loss.importance[..., None])

    @cached_property
    def prior(self) -> NormalEquations:
        """s Σᵢ Nᵢ (wᵢ − presentᵢ)², Nᵢ the noise's power in the blocks of light i, s `PRIOR`.

        What the samples show of a light is what they show beside its noise: of which that is all,
        the present is the best guess. N is part of M anyway, where it pulls towards no light.
        """
        present = self.basis.present_weights
        at = LitPixels.whole(self.basis, self.loss).predicted(present)
        _, weight = self.loss.pixels.squares(at, from_clipping=False)
        halves = self.basis.noise.pixels(slice(None)).astype(np.float64)
        power = np.einsum("cp,npc->nc", weight, np.square(halves))
        return to_present(PRIOR * power, present)


def block_side(bases: Sequence[Basis], transform: ViewTransform | None) -> int:
    """Return the side, in pixels, of blocks whose noise is small on a display: 1 for no blocks.

    Noise is that of the present look: what is painted has no say in it, so that no stroke changes
    what is solved elsewhere. Where nothing is known of noise it is 1, as in linear light, whose
    noise is taken out of the equations.
    """
    if transform is None or not all(basis.knows_noise for basis in bases):
        return 1
    shortest = min(min(basis.size) for basis in bases)
    sides = [side for side in SIDES if shortest >= FEWEST_BLOCKS * side]
    if len(sides) < 2:
        return 1
    strips = [_strips(basis) for basis in bases]
    for side in sides:
        noise = [_display_noise(look, half, seen, transform, side) for look, half, seen in strips]
        if np.sqrt(np.mean(np.concatenate(noise))) <= NOISY_DISPLAY:
            return side
    return sides[-1]


def _strips(basis: Basis) -> tuple[Floats, Floats, Bools]:
    """Return the present look of enough of a picture, half its difference, and where emitters are.

    Of strips of whole blocks, whatever their side, all over the picture.
    """
    every = max(1, basis.emitters_seen.size // ENOUGH)
    rows = np.flatnonzero(np.arange(basis.size[0]) // STRIP_ROWS % every == 0)
    weights = basis.present_weights
    its = np.flatnonzero(np.repeat(np.isin(np.arange(basis.size[0]), rows), basis.size[1]))
    picture = (len(rows), basis.size[1], 3)
    look, half = (x.picked(its).mix(weights).reshape(picture) for x in (basis.planes, basis.noise))
    return look, half, basis.emitters_seen[rows]


def _display_noise(
    look: Floats, half: Floats, seen: Bools, transform: ViewTransform, side: int
) -> Doubles:
    """Return squared half differences of what a display shows of blocks, (k,), without emitters."""
    unseen = (~seen).astype(np.float64)
    counts = block_sums(unseen, side)
    safe = np.where(counts > 0, counts, 1)[..., None]
    light, its = (block_sums(x * unseen[..., None], side) / safe for x in (look, half))
    ends = (transform.encode(np.maximum(light + sign * its, 0)) for sign in (1, -1))
    return np.asarray(np.square(np.subtract(*ends, dtype=np.float64) / 2)[counts > 0].ravel())


def binned_pixels(views: Views, loss: Loss, side: int) -> BinnedPixels | None:
    """Return the blocks of a loss over all `views`, each pixel weighed by how much it counts.

    None for a loss that is always one of single pixels.
    """
    planes: list[list[Doubles]] = [[], []]
    parts: list[tuple[Cut, Doubles]] = []
    for k, basis in enumerate(views.bases):
        cut = partial(views.part, k=k)
        its = loss.cut(cut)
        counts = its.importance.astype(np.float64)
        # Emitters that may be brighter say something where a block has nothing else.
        glows = basis.emitters_seen & its.exceeds(np.inf).all(axis=-1)
        others = enlarged(block_sums(np.where(glows, 0, counts), side), side)
        counts[glows & (others[: counts.shape[0], : counts.shape[1]] > 0)] = 0
        total = block_sums(counts, side)
        safe = np.where(total > 0, total, 1)
        for made, pictures in zip(planes, (basis.planes, basis.noise), strict=True):
            means = [block_sums(x * counts[..., None], side) / safe[..., None] for x in pictures]
            made.append(np.stack(means).reshape(len(means), -1, 3))
        parts.append((cut, counts))
    if (blocks := loss.of_blocks(parts, side)) is None:
        return None
    images, halves = (np.concatenate(x, axis=1)[:, None].astype(np.float32) for x in planes)
    basis = replace(
        views.bases[0],
        planes=as_planes(images),
        noise=as_planes(halves),
        emitters_seen=np.zeros(images.shape[1:3], dtype=bool),
        learned=None,
        features=None,
        objects=None,
    )
    return BinnedPixels(basis, blocks, side)
