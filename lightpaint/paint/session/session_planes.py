"""Measuring planes of a session: what its lights give there, and what is wished for."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from lightpaint import lighting
from lightpaint.arrays import Bools, Doubles
from lightpaint.basis import Lights
from lightpaint.paint import protocol
from lightpaint.photometry import Illuminance, LightCase, MeasuringPlane, PowerBudget, plane_title


@dataclass(frozen=True)
class PlaneSight:
    """The sight of measuring points in the picture of a view.

    camera: of the view; None for one that is not a pinhole. is_seen: (p,), whether nothing covers a
    point there.
    """

    camera: protocol.Camera | None
    is_seen: Bools


@dataclass(frozen=True)
class SessionPlanes:
    """Measured planes. place_key: of the places of all lights when they were measured.

    floor_m2: the area that power is divided by; 0 without one. cases: in which wishes hold. sights:
    of each view.
    """

    illuminance: Illuminance
    budget: PowerBudget
    floor_m2: float
    place_key: str
    cases: tuple[LightCase, ...] = ()
    sights: tuple[PlaneSight, ...] = ()

    def for_lights(self, lights: Lights) -> "SessionPlanes":
        """Return the planes as `lights` light them; those that were not measured give nothing."""
        measured = self.illuminance
        if measured.lights.names == lights.names:
            return self
        places = [k for k, name in enumerate(lights.names) if name in measured.lights.names]
        sources = [measured.lights.names.index(lights.names[k]) for k in places]

        def with_columns(values: Doubles) -> Doubles:
            columns = np.zeros((len(values), len(lights), 3))
            columns[:, places] = values[:, sources]
            return columns

        illuminance = replace(
            measured,
            lights=lights,
            matrix=with_columns(measured.matrix),
            noise=with_columns(measured.noise),
        )
        return replace(self, illuminance=illuminance)

    def wished_of(self, reduction: lighting.Reduction) -> lighting.WishedLight:
        """Return the wishes as requirements of the lights of a reduction. Raises ConstraintError
        for a limit of power and a lamp of unknown power.
        """
        return lighting.wished_light(
            self.illuminance,
            self.budget,
            reduction,
            floor_m2=self.floor_m2,
            cases=self.cases,
        )

    @cached_property
    def info(self) -> protocol.PlanesInfo:
        """The planes and their wishes for clients."""
        return protocol.PlanesInfo(
            tuple(
                self._plane_info(plane, case)
                for case in [case.name for case in self.cases] or [""]
                for plane in self.illuminance.planes
            ),
            floor_m2=self.floor_m2 or None,
            budget_watts=lighting.watts_allowed(self.budget, self.floor_m2),
            cameras=tuple(sight.camera for sight in self.sights),
        )

    def _plane_info(self, plane: MeasuringPlane, case: str) -> protocol.MeasuredPlane:
        """Return a plane in a case for clients."""
        points = self.illuminance.points_of(plane.name)
        sides = None if plane.sides is None else plane.sides.reshape(-1, 6)
        return protocol.MeasuredPlane(
            name=plane_title(plane.name, case),
            plane=plane.name,
            case=case,
            size=plane.picture_size,
            cells=tuple((int(row), int(column)) for row, column in plane.cells),
            points=_rounded(plane.points),
            sides=None if sides is None else _rounded(sides),
            seen=tuple(
                tuple(np.flatnonzero(sight.is_seen[points]).tolist()) for sight in self.sights
            ),
        )


def _rounded(vectors: Doubles) -> tuple[tuple[float, ...], ...]:
    """Return vectors with four decimals: tenths of millimetres."""
    return tuple(tuple(map(float, vector)) for vector in np.round(vectors, 4))


@dataclass(frozen=True)
class WishesInEffect:
    """The wishes for planes under the requests of a session.

    planes: as the session's lights light them. reduction: their unknowns, without requirements.
    requirements: what the answer has to reach; None if
    wishes are ignored.
    """

    planes: SessionPlanes
    reduction: lighting.Reduction
    wished: lighting.WishedLight
    requirements: lighting.Requirements | None

    @classmethod
    def of(
        cls, planes: SessionPlanes, reduction: lighting.Reduction, *, are_ignored: bool
    ) -> "WishesInEffect":
        """Return the wishes in effect. Raises LightpaintError if limits of lamps contradict the
        limit of power.
        """
        wished = planes.wished_of(reduction)
        requirements = None
        if not (are_ignored or wished.is_empty):
            requirements, _ = lighting.requirements_within_reach(wished, reduction)
        return cls(planes, reduction, wished, requirements)

    def reading(self, weights: Doubles, place_key: str) -> protocol.PlanesReading:
        """Return the lux on all planes and the power under weights (n, 3), and missed wishes.

        place_key: identifies the present places of the lights.
        """
        answer = lighting.planes_answer(
            self.wished, self.reduction, weights, floor_m2=self.planes.floor_m2
        )
        measured = self.planes.illuminance
        lux = {case: measured.of(lit) for case, lit in answer.weights_by_case.items()}
        return protocol.PlanesReading(
            tuple(
                protocol.PlaneLight(
                    mean=reading.mean,
                    mean_error=reading.mean_error,
                    uniformity=reading.uniformity,
                    least=reading.least,
                    most=reading.most,
                    lux=tuple(np.round(lux[case][measured.points_of(name)], 1).tolist()),
                    wishes=_wishes_of(name, case, answer.outcomes),
                )
                for (case, name), reading in answer.readings.items()
            ),
            watts=answer.watts,
            power=next(iter(_wishes_of("", "", answer.outcomes)), None),
            is_required=self.requirements is not None,
            is_old=place_key != self.planes.place_key,
        )


def _wishes_of(
    plane: str, case: str, outcomes: Sequence[lighting.WishOutcome]
) -> tuple[protocol.PlaneWish, ...]:
    """Return the wishes for a plane in a case, and whether they are met; "" for the power."""
    return tuple(
        protocol.PlaneWish(x.wish.kind, x.wish.asked, x.reached, x.is_met, x.wish.to)
        for x in outcomes
        if (x.wish.plane, x.wish.case) == (plane, case)
    )
