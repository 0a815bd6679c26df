"""The answer: named lights with their emissions."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lightpaint.arrays import RGB, Doubles, as_rgb
from lightpaint.basis.basis import Basis, BasisLight, mix
from lightpaint.colour.photometry import Photometry, photometry
from lightpaint.errors import LightingError
from lightpaint.images.estimate import Estimate
from lightpaint.lighting.bound import Bound
from lightpaint.screen import Shown, shortly, some_of


@dataclass(frozen=True)
class LightSetting:
    """One light of a lighting.

    emission: linear RGB in `unit`, the parameter's own unit in Mitsuba.
    weight: RGB relative to one unit of the basis; the same numbers for one-colour lights.
    is_fixed: whether it is what stays as it is in the scene, with weight 1.
    members: names of the emitters it consists of; itself if none are given.
    unit_flux: watts it radiates per channel at an emission of 1; None where that is not known.
    constraint: what was asked of it in the solve, in few words; "" for nothing. is_active:
    whether that held it back from what the painting asks for.
    standard_error: of the emission, from the noise it was solved with, where that is known.
    """

    name: str
    plugin: str
    parameter: str
    unit: str
    emission: RGB
    weight: RGB
    is_fixed: bool = False
    members: tuple[str, ...] = ()
    unit_flux: RGB | None = None
    constraint: str = ""
    is_active: bool = False
    standard_error: RGB | None = None

    def __post_init__(self) -> None:
        if not self.members:
            object.__setattr__(self, "members", (self.name,))
        given = {"emission": self.emission, "weight": self.weight}
        if self.standard_error is not None and not self.is_fixed:
            given["standard error"] = self.standard_error
        for what, rgb in given.items():
            if not all(math.isfinite(v) and v >= 0 for v in rgb):
                raise LightingError(
                    f"light {self.name!r} has the {what} {list(rgb)}: need three numbers >= 0"
                )
            if self.is_fixed and rgb != (1, 1, 1):
                raise LightingError(
                    f"light {self.name!r} is kept as it is, so its {what} must be 1 1 1, "
                    f"not {list(rgb)}"
                )
        if self.unit_flux and not all(math.isfinite(v) and v >= 0 for v in self.unit_flux):
            raise LightingError(
                f"light {self.name!r} has the unit_flux {list(self.unit_flux)}: "
                "need three numbers >= 0"
            )


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


@dataclass(frozen=True)
class Lighting(Shown):
    """Emissions for named lights.

    Attributes:
        lights: Each with its emission, in the order of the basis.
        target: Name of what was painted.
        scene_identity: Of the scene it is for.
        certificate: Of the solve they come from, if they do.
        cd_per_unit: cd/m² that a radiance of 1 stands for, where that was said.

    Examples:
        >>> lighting = lp.read_lighting("lighting.json")
        >>> lighting.emission["panel"]
        (2.0, 1.5, 1.0)
        >>> lighting.with_emission("panel", (1, 1, 1)).emission["panel"]
        (1, 1, 1)
    """

    lights: tuple[LightSetting, ...]
    target: str = ""
    scene_identity: str = ""
    certificate: Certificate | None = None
    cd_per_unit: float | None = None

    def __repr__(self) -> str:
        rgb = [" ".join(f"{v:.4g}" for v in light.emission) for light in self.lights]
        told = [f"{light.name} {its}" for light, its in zip(self.lights, rgb, strict=True)]
        target = f" for {self.target}" if self.target else ""
        return f"Lighting({len(told)} lights{target}: {some_of(told, room=600)})"

    def __post_init__(self) -> None:
        names = [light.name for light in self.lights]
        if len(set(names)) != len(names):
            raise LightingError(f"light names repeat: {', '.join(names)}")
        members = [name for light in self.lights for name in light.members]
        if len(set(members)) != len(members):
            raise LightingError(f"an emitter is in two lights: {', '.join(sorted(members))}")
        scale = self.cd_per_unit
        if scale is not None and not 0 < scale < math.inf:
            raise LightingError(f"a radiance of 1 stands for {scale:g} cd/m²: need a number > 0")

    @property
    def members(self) -> Mapping[str, tuple[str, ...]]:
        """Names of the emitters of each light, by its name."""
        return {light.name: light.members for light in self.lights}

    @property
    def fixed(self) -> frozenset[str]:
        """Names of the lights that stay as they are."""
        return frozenset(light.name for light in self.lights if light.is_fixed)

    @property
    def emission(self) -> Mapping[str, RGB]:
        """RGB emission by name of light."""
        return {light.name: light.emission for light in self.lights}

    def photometry(self, light: LightSetting) -> Photometry:
        """Colour, temperature and flux of one of its lights."""
        return photometry(
            light.emission,
            unit=light.unit,
            unit_flux=light.unit_flux,
            cd_per_unit=self.cd_per_unit,
        )

    def with_emission(self, name: str, emission: RGB) -> "Lighting":
        """This lighting with another RGB emission for one light, and no claim to be optimal.

        Raises LightingError if there is no such light.
        """
        if name not in self.emission:
            raise LightingError(f"no light {name!r} in the lighting: it has {[*self.emission]}")
        lights = tuple(
            replace(
                light,
                emission=emission,
                weight=emission,
                constraint="",
                is_active=False,
                standard_error=None,
            )
            if light.name == name
            else light
            for light in self.lights
        )
        return replace(self, lights=lights, certificate=None)

    def named(self, target: str) -> "Lighting":
        """The same, as the answer to that target."""
        return replace(self, target=target)

    def with_certificate(self, certificate: Certificate | None) -> "Lighting":
        """The same, with what shows how good it is."""
        return replace(self, certificate=certificate)

    @classmethod
    def of_weights(
        cls,
        basis: Basis,
        weights: Doubles,
        *,
        asked: Sequence[tuple[str, bool]] | None = None,
        **about: Any,
    ) -> "Lighting":
        """From weights (n, 3) in the order of `basis`.

        asked: of each light its `constraint` and whether that `is_active`.
        """
        settings = tuple(
            _setting(light, as_rgb(weight), constraint, is_active)
            for light, weight, (constraint, is_active) in zip(
                basis.lights, weights, asked or [("", False)] * len(basis.lights), strict=True
            )
        )
        return cls(settings, scene_identity=basis.origin.scene_identity, **about)

    @classmethod
    def present(cls, basis: Basis) -> "Lighting":
        """The scene's lighting as it is."""
        return cls.of_weights(basis, basis.present_weights)

    def weights_for(self, basis: Basis) -> Doubles:
        """(n, 3) weights in the order of `basis`.

        Raises LightingError if the two do not name the same lights.
        """
        given = {light.name: light.weight for light in self.lights}
        if set(given) != set(basis.names):
            missing = sorted(set(basis.names) - set(given))
            unknown = sorted(set(given) - set(basis.names))
            raise LightingError(
                "lighting and basis name different lights: "
                f"missing {', '.join(missing) or 'none'}; unknown {', '.join(unknown) or 'none'}"
            )
        for light in basis.lights:
            if set(light.members) != set(self.members[light.name]):
                raise LightingError(
                    f"light {light.name!r} is not the same in both: of "
                    f"{', '.join(self.members[light.name])} in the lighting, of "
                    f"{', '.join(light.members)} in the basis"
                )
        return np.array([given[name] for name in basis.names], dtype=np.float64)


def combine(basis: Basis, lighting: Lighting) -> Estimate:
    """The predicted image Σ w_i Φ_i, with the noise that the basis gives it.

    Args:
        basis: Of n lights.
        lighting: Of the same lights.

    Raises:
        LightingError: If the two do not name the same lights.

    Examples:
        >>> solution = lp.solve(basis, target)
        >>> np.abs(lp.combine(basis, solution.lighting).image - target.image).max() < 1e-4
        True
    """
    weights = lighting.weights_for(basis)
    return Estimate(basis.mix(weights), mix(basis.half_differences, weights))


def _setting(light: BasisLight, weight: RGB, constraint: str, is_active: bool) -> LightSetting:
    # One unit of weight is unit-white emission, so that here the two are the same numbers.
    return LightSetting(
        light.name,
        light.plugin,
        light.parameter,
        light.unit,
        emission=weight,
        weight=weight,
        is_fixed=light.is_fixed,
        members=light.members,
        unit_flux=light.unit_flux,
        constraint=constraint,
        is_active=is_active,
    )
