"""M w = b: the least-squares problem in the lights alone (Schoeneman et al. 1993, Eq 3, 5).

The objective is ‖Ψ − Σ w_i Φ_i‖² under ⟨f, g⟩ = Σ_pixels D f g, one problem per colour
channel. All sums run in float64 over float32 pixels.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis import Basis
from lightpaint.errors import LightingError, SizeError
from lightpaint.lighting.algebra.quadratic import UNREACHED_POWER
from lightpaint.validation import check_shape


@dataclass(frozen=True)
class NormalEquations:
    """Inner products of basis and target, per colour channel.

    M: (3, n, n), ⟨Φ_i, Φ_j⟩. b: (3, n), ⟨Φ_i, Ψ⟩. target_norm2: (3,), ‖Ψ‖². coupling: (n, 3, 3),
    the coupling of a light's channels by a pull to its colour, 0 on the diagonal (which is in M);
    None without one.
    """

    M: Doubles
    b: Doubles
    target_norm2: Doubles
    coupling: Doubles | None = None

    def __add__(self, other: "NormalEquations") -> "NormalEquations":
        """Add the problems of two pictures: of two tiles, cameras, frames or machines.

        Raises SizeError if they are not of the same number of lights.
        """
        if self.M.shape != other.M.shape:
            raise SizeError(
                f"a problem of {self.M.shape[1]} lights and one of {other.M.shape[1]} do not add: "
                "both need the same lights in the same order"
            )
        across = [x.coupling for x in (self, other) if x.coupling is not None]
        return NormalEquations(
            self.M + other.M,
            self.b + other.b,
            self.target_norm2 + other.target_norm2,
            np.sum(across, axis=0) if across else None,
        )

    def scaled(self, factor: float) -> "NormalEquations":
        """Return the problem multiplied by a factor."""
        across = None if self.coupling is None else factor * self.coupling
        return NormalEquations(factor * self.M, factor * self.b, factor * self.target_norm2, across)

    @property
    def reached(self) -> npt.NDArray[np.bool_]:
        """(n, 3), whether a light reaches something that counts in a channel."""
        power = np.einsum("cii->ic", self.M)
        return np.asarray(power > UNREACHED_POWER * power.max(initial=0))

    def objective(self, w: Doubles) -> Doubles:
        """Return ‖Ψ − Σ w_i Φ_i‖² per channel, (3,). w: (n, 3).

        Coupled channels share the coupling term equally, so that one alone may be below 0. Raises
        LightingError for weights of another shape.
        """
        check_shape("weights", w, self.b.shape[::-1], "a row per light", error=LightingError)
        quadratic = np.einsum("ic,ic->c", w, self._products(w))
        value = self.target_norm2 - 2 * np.einsum("ci,ic->c", self.b, w) + quadratic
        if self.coupling is not None:
            return np.asarray(value + np.einsum("ic,icd,id->c", w, self.coupling, w))
        # A perfect fit leaves round-off of either sign.
        return np.asarray(np.maximum(value, 0))

    def gradient(self, w: Doubles) -> Doubles:
        """Return half the gradient of the objective, M w − b, (n, 3). w: (n, 3)."""
        gradient = self._products(w) - self.b.T
        if self.coupling is not None:
            gradient += np.einsum("icd,id->ic", self.coupling, w)
        return np.asarray(gradient)

    def _products(self, w: Doubles) -> Doubles:
        """Return M w, (n, 3), by BLAS, which reads a large matrix five times as fast as einsum."""
        return np.asarray(np.matmul(self.M, np.ascontiguousarray(w.T)[..., None])[..., 0].T)

    @property
    def full_matrix(self) -> Doubles:
        """(3 n, 3 n), M for flat weights, channel by channel."""
        n = self.M.shape[1]
        matrix = block_diagonal(self.M).reshape(3, n, 3, n)
        if self.coupling is not None:
            lights = np.arange(n)
            matrix[:, lights, :, lights] += self.coupling
        return matrix.reshape(3 * n, 3 * n)

    @classmethod
    def of(cls, basis: Basis, image: Floats, importance: Floats) -> "NormalEquations":
        """Sum over a basis (n, h, w, 3), target image (h, w, 3) and importance (h, w) or (h, w,
        3)."""
        return cls(*basis.planes.sums(importance, image))


def block_diagonal(M: Doubles) -> Doubles:
    """Return M (3, n, n) as one matrix (3 n, 3 n) for flat weights, channel by channel."""
    n = M.shape[1]
    whole = np.zeros((3, n, 3, n))
    for c in range(3):
        whole[c, :, c] = M[c]
    return whole.reshape(3 * n, 3 * n)
