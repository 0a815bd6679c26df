"""What shows how good an answer is."""

import math
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import RGB, Doubles, as_rgb
from lightpaint.keywords import keywords
from lightpaint.lighting.answer.active_bound import Bound
from lightpaint.lighting.answer.software_versions import Software
from lightpaint.screen import shortly


@keywords()
@dataclass(frozen=True)
class Certificate:
    """How good a solve is, per colour channel (R, G, B).

    Attributes:
        kkt_residual: Optimality measure of the solver (see solver.kkt_residual).
        objective: ‖Ψ − Σ w_i Φ_i‖² under the importance.
        relative_objective: Over ‖Ψ‖².
        sweeps: Gauss–Seidel sweeps per channel; 0 where Newton steps did it.
        converged: Whether the KKT residual came below the tolerance.
        unreached: Lights that no weighted pixel sees, which keep what the solve started from, or
            what is nearest to it under their constraints: their present emission, if no start was
            given.
        curve: Where only some lights may be on, numbers of lights and the relative residual, √(Σ_c
            E_c / Σ_c ‖Ψ_c‖²), of the best that were found.
        bounds: What holds single lights, where a diagnosis has looked, the largest gain first.
        objective_error: Standard error of `objective`, from the noise it was solved with, where
            that is known.
        display: The view transform through which the objective is seen; "" where it is of linear
            light.
        rounds: Linear problems solved one after the other, the last of which is the certified one.
        hold: Weight of all that was not painted, against the current look, beside that of what was.
        colors: How free lamps were to change their colour: `free`, `gentle` or `white`.
        noise_removed: Share of the noise that was taken out of the equations.
        delta_e: Mean CIEDE2000 between the prediction and the painting, over what was painted.
        delta_e_noise: The part of it that noise explains.
        delta_e_asked: That of the scene as it is: how much was asked for.
        software: What it was computed with, where that is known.
        basis_spp: Samples per pixel of the basis it was solved with, of the first of several views;
            None where nobody knows of any.

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

    __repr__ = shortly

    def __str__(self) -> str:
        told = "closest there is"
        if self.curve or self.rounds > 1:
            told = "closest with the lights chosen" if self.curve else "no small change is closer"
        told = told if self.converged else "stopped before it converged"
        missed = math.sqrt(max(self.relative_objective))
        where = f", as {self.display} shows it" if self.display else ""
        return (
            f"{told} (KKT residual {max(self.kkt_residual):.1g}); misses {missed:.2g} of the "
            f"painting{where} (RMS, worst channel)"
        )

    def of(self, objective: Doubles, norm2: Doubles, *, error: RGB | None = None) -> "Certificate":
        """With what is missed, (3,), beside what a black picture would miss, (3,)."""
        norm = np.where(norm2 > 0, norm2, 1)
        return replace(
            self,
            objective=as_rgb(objective),
            relative_objective=as_rgb(objective / norm),
            objective_error=error,
        )
