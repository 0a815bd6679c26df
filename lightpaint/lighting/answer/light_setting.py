"""A light of an answer: its emission, its constraint, and its error."""

import math
from dataclasses import dataclass, replace

from lightpaint.arrays import RGB
from lightpaint.errors import LightingError
from lightpaint.validation import BRIGHTEST, MAX_NAME, is_amount

#: A number of each channel, None if undetermined; an interval of each.
Errors = tuple[float | None, float | None, float | None]
Ends = tuple[float, float]
Intervals = tuple[Ends | None, Ends | None, Ends | None]

#: Plugin and unit of a projector of one colour.
PROJECTOR = ("projector", "W/m²")

ALL_REACHED = (True, True, True)


@dataclass(frozen=True)
class LightSetting:
    """The setting of a light in a lighting.

    emission: linear RGB in `unit`, the parameter's own unit in Mitsuba.
    weight: RGB relative to one unit of the basis; the same numbers for one-colour lights.
    is_fixed: whether it stays as it is in the scene, with weight 1.
    members: names of the emitters it consists of; itself if none are given.
    unit_flux: watts it radiates per channel at an emission of 1; None if unknown.
    constraint: short text of its constraint in the solve; "" for none. is_active: whether the
    constraint held it back.
    reached: for each channel whether it reaches any counted pixel; if not, its emission is
    undetermined, and does not change.
    standard_error: of the emission, from the noise of the basis, if known; None in channels that
    reach nothing.
    interval: 95 % interval of each channel, lower and upper end; as standard_error.
    untold: whether the basis has too few samples to determine it.
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
    reached: tuple[bool, bool, bool] = ALL_REACHED
    standard_error: Errors | None = None
    interval: Intervals | None = None
    untold: bool = False

    def __post_init__(self) -> None:
        if len(self.name) > MAX_NAME:
            raise LightingError(f"a light has a name of more than {MAX_NAME} characters")
        if not self.members:
            object.__setattr__(self, "members", (self.name,))
        self._check_errors()
        values = {"emission": self.emission, "weight": self.weight}
        for name, rgb in values.items():
            if not all(map(is_amount, rgb)):
                raise LightingError(
                    f"light {self.name!r} has the {name} {list(rgb)}: need three numbers from 0 "
                    f"to {BRIGHTEST:g}"
                )
            if self.is_fixed and rgb != (1, 1, 1):
                raise LightingError(
                    f"light {self.name!r} is fixed, so its {name} must be 1 1 1, not {list(rgb)}"
                )
        if self.unit_flux and not all(map(is_amount, self.unit_flux)):
            raise LightingError(
                f"light {self.name!r} has the unit_flux {list(self.unit_flux)}: need three numbers "
                f"from 0 to {BRIGHTEST:g}"
            )

    @property
    def physical_emission(self) -> RGB:
        """Emission in the sense of `unit`: Mitsuba's projector gives a plane at distance 1 π times
        its parameter.
        """
        if (self.plugin, self.unit) != PROJECTOR:
            return self.emission
        r, g, b = (math.pi * channel for channel in self.emission)
        return r, g, b

    def with_emission(self, emission: RGB, *, weight: RGB | None = None) -> "LightSetting":
        """Return the light at another emission, which no solve has found.

        It has no constraint and no error bars. What the basis cannot tell of it stays: channels
        that reach nothing, too few samples. weight: by default the same numbers.
        """
        return replace(
            self,
            emission=emission,
            weight=emission if weight is None else weight,
            constraint="",
            is_active=False,
            standard_error=None,
            interval=None,
        )

    @property
    def is_partly_reached(self) -> bool:
        """True if some of its channels were solved for and others reach nothing."""
        return any(self.reached) and not all(self.reached)

    def _check_errors(self) -> None:
        errors = () if self.is_fixed else self.standard_error or ()
        if not all(e is None or is_amount(e) for e in errors):
            raise LightingError(
                f"light {self.name!r} has the standard error {list(errors)}: need three numbers "
                f"from 0 to {BRIGHTEST:g}, or null where it is unknown"
            )
        for ends in filter(None, self.interval or ()):
            if not 0 <= ends[0] <= ends[1] <= BRIGHTEST:
                raise LightingError(
                    f"light {self.name!r} has the interval {list(ends)}: need two numbers, "
                    f"0 <= lower <= upper <= {BRIGHTEST:g}"
                )
