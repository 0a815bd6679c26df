"""The proof of how good an answer is."""

import math
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import RGB, Doubles, as_rgb
from lightpaint.display_text import short_repr
from lightpaint.keywords import keywords
from lightpaint.lighting.answer.active_bound import Bound
from lightpaint.lighting.answer.software_versions import Software


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
        """Return the certificate with this loss, (3,), and that of a black picture, (3,)."""
        norm = np.where(norm2 > 0, norm2, 1)
        return replace(
            self,
            objective=as_rgb(objective),
            relative_objective=as_rgb(objective / norm),
            objective_error=error,
        )
