"""M w = b: the least-squares problem in the lights alone (Schoeneman et al. 1993, Eq 3, 5).

The objective is ‖Ψ − Σ w_i Φ_i‖² under ⟨f, g⟩ = Σ_pixels D f g, one problem per colour
channel. All sums run in float64 over float32 pixels.
"""

from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.errors import SizeError
from lightpaint.lighting.algebra.quadratic import UNREACHED
from lightpaint.threads import one_thread

#: Pixels multiplied at a time: the float64 copies of so many stay in the processor's cache.
BLOCK = 2**13

#: Lights up to which the product of a block is too small for BLAS to share it out to threads.
FEW_LIGHTS = 256


@dataclass(frozen=True)
class NormalEquations:
    """Inner products of basis and target, per colour channel.

    M: (3, n, n), ⟨Φ_i, Φ_j⟩. b: (3, n), ⟨Φ_i, Ψ⟩. target_norm2: (3,), ‖Ψ‖². across: (n, 3, 3),
    what joins the channels of a light where something asks for its colour, 0 on the diagonal (the
    rest is in M); None where nothing does.
    """

    M: Doubles
    b: Doubles
    target_norm2: Doubles
    across: Doubles | None = None

    def __add__(self, other: "NormalEquations") -> "NormalEquations":
        """The problem of both pictures at once: of two tiles, cameras, frames or machines.

        Raises SizeError if they are not of the same number of lights.
        """
        if self.M.shape != other.M.shape:
            raise SizeError(
                f"a problem of {self.M.shape[1]} lights and one of {other.M.shape[1]} do not add: "
                "both need the same lights in the same order"
            )
        across = [x.across for x in (self, other) if x.across is not None]
        return NormalEquations(
            self.M + other.M,
            self.b + other.b,
            self.target_norm2 + other.target_norm2,
            np.sum(across, axis=0) if across else None,
        )

    def times(self, factor: float) -> "NormalEquations":
        """The same, counting that many times as much."""
        across = None if self.across is None else factor * self.across
        return NormalEquations(factor * self.M, factor * self.b, factor * self.target_norm2, across)

    @property
    def reached(self) -> npt.NDArray[np.bool_]:
        """(n, 3), whether a light reaches something that counts in a channel."""
        power = np.einsum("cii->ic", self.M)
        return np.asarray(power > UNREACHED * power.max(initial=0))

    def objective(self, w: Doubles) -> Doubles:
        """‖Ψ − Σ w_i Φ_i‖² per channel, (3,). w: (n, 3).

        What joins channels is halved between the two, so that one alone may be below 0.
        """
        quadratic = np.einsum("ic,cij,jc->c", w, self.M, w)
        value = self.target_norm2 - 2 * np.einsum("ci,ic->c", self.b, w) + quadratic
        if self.across is not None:
            return np.asarray(value + np.einsum("ic,icd,id->c", w, self.across, w))
        # A perfect fit leaves round-off of either sign.
        return np.asarray(np.maximum(value, 0))

    def gradient(self, w: Doubles) -> Doubles:
        """Half that of the objective, M w − b, (n, 3). w: (n, 3)."""
        made = np.einsum("cij,jc->ic", self.M, w) - self.b.T
        if self.across is not None:
            made += np.einsum("icd,id->ic", self.across, w)
        return np.asarray(made)

    @property
    def whole(self) -> Doubles:
        """(3 n, 3 n), M for weights that lie flat, channel by channel."""
        n = self.M.shape[1]
        made = block_diagonal(self.M).reshape(3, n, 3, n)
        if self.across is not None:
            its = np.arange(n)
            made[:, its, :, its] += self.across
        return made.reshape(3 * n, 3 * n)

    @classmethod
    def of(cls, basis: Basis, image: Floats, importance: Floats) -> "NormalEquations":
        """From basis (n, h, w, 3), target image (h, w, 3) and importance (h, w) or (h, w, 3)."""
        return cls(*inner_products(basis.images, image, importance))


def block_diagonal(M: Doubles) -> Doubles:
    """(3 n, 3 n), M (3, n, n) for weights that lie flat, channel by channel."""
    n = M.shape[1]
    whole = np.zeros((3, n, 3, n))
    for c in range(3):
        whole[c, :, c] = M[c]
    return whole.reshape(3 * n, 3 * n)


def inner_products(
    images: Floats, target: Floats, importance: Floats
) -> tuple[Doubles, Doubles, Doubles]:
    """M (3, n, n), b (3, n) and ‖Ψ‖² (3,) under the pixel weights `importance`.

    images: (n, h, w, 3); target: (h, w, 3); importance: (h, w) or (h, w, 1), or (h, w, 3) where it
    differs between the channels, >= 0.
    """
    n = images.shape[0]
    rows = images.reshape(n, -1, 3)
    # Pixels without weight contribute nothing and need not be read.
    apart = importance.shape[2:] == (3,)
    weights = importance.reshape(rows.shape[1], 3 if apart else 1)
    counted = np.flatnonzero(weights.any(axis=1) if apart else weights)
    colours = target.reshape(-1, 3)
    gram = np.zeros((3, n + 1, n + 1))
    room = np.empty((n + 1, min(BLOCK, counted.size)))
    with one_thread() if n <= FEW_LIGHTS else nullcontext():
        for start in range(0, counted.size, BLOCK):
            pixels = counted[start : start + BLOCK]
            first, last = int(pixels[0]), int(pixels[-1])
            # Pixels in one run are looked at where they are; others have to be gathered.
            in_one_run = last - first + 1 == pixels.size
            where = slice(first, last + 1) if in_one_run else pixels
            lit, painted = rows[:, where], colours[where]
            root = np.sqrt(weights[where].astype(np.float64))
            # (n + 1, block): the target goes along as one more row.
            block = room[:, : pixels.size]
            for c in range(3):
                its = root[:, c * apart]
                np.multiply(lit[..., c], its, out=block[:n])
                np.multiply(painted[:, c], its, out=block[n])
                gram[c] += block @ block.T
    return gram[:, :n, :n], gram[:, :n, n], gram[:, n, n]
