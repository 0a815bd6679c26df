"""The certificate of an answer, with the bounds that hold it and the software behind it."""

import importlib.metadata
import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np

from lightpaint.arrays import RGB, Doubles, as_rgb
from lightpaint.display_text import short_repr
from lightpaint.errors import LightingError
from lightpaint.keywords import keywords
from lightpaint.threads import linear_algebra
from lightpaint.validation import check_shape
from lightpaint.version import __version__

#: Kinds of bounds: light is not negative; a light is not adjusted; constraints.
Kind = Literal["zero", "kept", "lock", "off", "left out", "tie", "limits", "colour"]

#: The unit of a multiplier.
Per = Literal["emission", "luminance", "dimmer"]

#: The side of its whites to which a light would go; "" for neither.
Tint = Literal["", "greener", "pinker"]


@dataclass(frozen=True)
class Software:
    """Installed versions, and the kernel for the processor.

    blas: library of linear algebra under NumPy, and its version. kernel: of that library for the
    processor, such as `Haswell`; "" if unknown. mitsuba: "" if it is not installed.
    """

    lightpaint: str
    numpy: str
    blas: str
    kernel: str
    mitsuba: str = ""

    @classmethod
    @cache
    def installed(cls) -> "Software":
        """Return the versions of this process."""
        blas, kernel = linear_algebra()
        return cls(__version__, version("numpy"), blas, kernel, version("mitsuba"))


def version(package: str) -> str:
    """Return the version of an installed package; "" if it is not."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return ""  # a saved basis needs no renderer


@dataclass(frozen=True)
class Bound:
    """A bound that holds back one light, or several on one dimmer.

    held_by: the constraint in few words (`LightSetting.constraint`); else the kind.
    gain: decrease of the objective, all channels together, if only this bound were released. A
    fixed, locked, limited, coloured or tied light may then have any emission >= 0, an unselected
    light any that its constraints allow, and a light at zero negative emission. A pull towards the
    current lighting stays; it is not part of the objective, so the gain may be negative.
    multiplier: derivative of the objective by the bound: >= 0 at a lower limit, such as zero, and
    <= 0 at an upper one, such as `off`. Three channels per `emission`; one number per `luminance`
    of the emission; per unit of a `dimmer`, 1 being the current level, one number for each tied
    light moved separately, or one for all.
    tint: the side of its range of white to which the light would go.
    """

    lights: tuple[str, ...]
    kind: Kind
    held_by: str
    gain: float
    multiplier: tuple[float, ...]
    per: Per
    tint: Tint = ""

    @property
    def is_switched_off(self) -> bool:
        """True if the user, or a choice of few lights, switched the light off."""
        return self.kind in ("off", "left out")


@keywords()
@dataclass(frozen=True)
class Certificate:
    """The certificate of a solve's optimality, per colour channel (R, G, B).

    Attributes:
        kkt_residual: How far the weights are from optimal: the largest part of the gradient that no
            bound holds, relative to b, with lights scaled so that M has a unit diagonal. 0 at the
            optimum. docs/method.md has the formula.
        objective: ‖Ψ − Σ w_i Φ_i‖² under the importance.
        relative_objective: The objective divided by ‖Ψ‖².
        sweeps: Gauss–Seidel sweeps per channel; 0 if Newton steps sufficed.
        converged: Whether the KKT residual is within the tolerance.
        unreached: Lights that reach no weighted pixel. They keep the start of the solve, or the
            nearest emission under their constraints: the current one, if no start was given.
        curve: If only some lights may be on, numbers of lights and the relative residual, √(Σ_c
            E_c / Σ_c ‖Ψ_c‖²), of the best ones.
        bounds: Bounds that hold single lights, from a diagnosis, the largest gain first.
        objective_error: Standard error of `objective`, from the noise of the basis, if known.
        display: The view transform of the objective; "" for linear light.
        rounds: The number of linear problems solved in turn, the last of which is certified.
        hold: Weight of unpainted pixels, which holds them to the current look, relative to painted
            ones.
        colors: The freedom of lamps to change their colour: `free`, `gentle`, `white` or
            `own`.
        noise_removed: Share of the noise that was removed from the equations.
        delta_e: Mean CIEDE2000 between the prediction and the painting, over the paint.
        delta_e_noise: The part of it that noise explains.
        delta_e_asked: `delta_e` of the current scene: the change that the painting asks for.
        software: The software that computed it, if known.
        basis_spp: Samples per pixel of the basis, of the first of several views; None if unknown.

    Examples:
        >>> solution = lp.solve(basis, target)
        >>> solution.certificate.converged
        True
        >>> print(solution.certificate)
        closest there is (KKT residual ...); misses ... of the painting (RMS, worst channel)
    """

    kkt_residual: RGB
    objective: RGB
    relative_objective: RGB
    sweeps: tuple[int, int, int]
    converged: bool
    unreached: tuple[str, ...] = ()
    curve: tuple[tuple[int, float], ...] = ()
    bounds: tuple[Bound, ...] = ()
    objective_error: RGB | None = None
    display: str = ""
    rounds: int = 1
    hold: float = 0.0
    colors: str = "free"
    noise_removed: float = 0.0
    delta_e: float | None = None
    delta_e_noise: float | None = None
    delta_e_asked: float | None = None
    software: Software | None = None
    basis_spp: int | None = None

    __repr__ = short_repr

    def __str__(self) -> str:
        state = "closest there is"
        if self.curve or self.rounds > 1:
            state = "closest with the lights chosen" if self.curve else "no small change is closer"
        state = state if self.converged else "stopped before it converged"
        missed = math.sqrt(max(self.relative_objective))
        where = f", as {self.display} shows it" if self.display else ""
        return (
            f"{state} (KKT residual {max(self.kkt_residual):.1g}); misses {missed:.2g} of the "
            f"painting{where} (RMS, worst channel)"
        )

    def with_objective(
        self, objective: Doubles, norm2: Doubles, *, error: RGB | None = None
    ) -> "Certificate":
        """Return the certificate with this loss, (3,), and the loss of a black picture, (3,).

        Raises LightingError for arrays of other shapes.
        """
        for name, values in (("objective", objective), ("norm2", norm2)):
            check_shape(name, values, (3,), "one for each channel", error=LightingError)
        norm = np.where(norm2 > 0, norm2, 1)
        return replace(
            self,
            objective=as_rgb(objective),
            relative_objective=as_rgb(objective / norm),
            objective_error=error,
        )
