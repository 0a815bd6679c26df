"""M w = b: the least-squares problem in the lights alone (Schoeneman et al. 1993, Eq 3, 5).

The objective is ‖Ψ − Σ w_i Φ_i‖² under ⟨f, g⟩ = Σ_pixels D f g, one problem per colour
channel. All sums run in float64 over float32 pixels.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.planes import MemoryPlanes
from lightpaint.errors import SizeError
from lightpaint.lighting.algebra.quadratic import UNREACHED_POWER


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
        return np.asarray(power > UNREACHED_POWER * power.max(initial=0))

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
        return cls(*basis.planes.sums(importance, image))


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
    return MemoryPlanes(images).sums(importance, target)
