"""The lights of a basis, without pixels: kinds, emission, and requests of their lights file."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, overload

import numpy as np

from lightpaint.arrays import RGB, Bools, Doubles, read_only
from lightpaint.dataframes import by_channel
from lightpaint.display_text import Listed, some_names
from lightpaint.errors import BasisError
from lightpaint.scene.lights.lights_file import SceneRequests
from lightpaint.validation import BRIGHTEST, MAX_NAME, is_amount


@dataclass(frozen=True)
class BasisLight:
    """A light in a basis.

    parameter, unit: parameter and unit that weights refer to (`radiance`, `W/(m² sr)`).
    emission: its current RGB emission in the scene, in that unit.
    form: its position and size as text.
    is_scalar: whether it can only be scaled as a whole, with one weight for all channels.
    is_fixed: whether its weight stays 1, whatever is painted.
    members: names of the emitters that it consists of; by default its own name.
    unit_flux: watts radiated per channel at an emission of 1; None if unknown.
    identity: identity of its plane; planes with equal identities are equal up to noise (see
    `Light.identity`). "" if unknown.
    is_outside_gamut: whether its emission has negative channels, as LEDs outside Rec.709 have.
    lamp: of an emitter of a lamp in a basis of spectra, the lamp's name; its weight is the
    luminance of its emission.
    """

    name: str
    plugin: str
    parameter: str
    unit: str
    emission: RGB
    form: str = ""
    is_scalar: bool = False
    is_fixed: bool = False
    members: tuple[str, ...] = ()
    unit_flux: RGB | None = None
    identity: str = ""
    is_outside_gamut: bool = False
    lamp: str = ""

    def __post_init__(self) -> None:
        if len(self.name) > MAX_NAME:
            raise BasisError(f"a light has a name of more than {MAX_NAME} characters")
        if not self.members:
            object.__setattr__(self, "members", (self.name,))
        if self.is_fixed and self.emission != (1, 1, 1):
            raise BasisError(f"light {self.name!r} is fixed, so its emission must be 1")
        channels = map(abs, self.emission) if self.is_outside_gamut else self.emission
        if not all(map(is_amount, channels)):
            raise BasisError(
                f"light {self.name!r} has the emission {list(self.emission)}: need three numbers "
                f"from 0 to {BRIGHTEST:g}"
            )
        # Of all that stays together; a lamp outside Rec.709 has channels below zero.
        flux = self.unit_flux or ()
        if not all(map(is_amount, map(abs, flux) if self.is_fixed else flux)):
            raise BasisError(
                f"light {self.name!r} has a flux of {list(flux)} at unit emission: need "
                f"three numbers from 0 to {BRIGHTEST:g}"
            )

    def to_row(self, mean: float) -> dict[str, Any]:
        """Return this light as a row of a table. mean: luminance of its image, over all pixels."""
        return {
            "plugin": self.plugin,
            "parameter": self.parameter,
            "unit": self.unit,
            **by_channel("", self.emission),
            "mean": mean,
            "form": self.form,
            "is_fixed": self.is_fixed,
            "is_scalar": self.is_scalar,
            "members": ", ".join(self.members),
        }

    def __repr__(self) -> str:
        emission = " ".join(f"{v:.4g}" for v in self.emission)
        note = ", fixed" if self.is_fixed else ""
        description = " ".join(filter(None, (self.plugin, self.parameter, emission, self.unit)))
        return f"BasisLight({self.name!r}, {description}{note})"


@dataclass(frozen=True)
class Lights(Sequence[BasisLight]):
    """The ordered table of lights, whose order is the order of weights, planes and sums.

    records: one record for each light. requests: constraints from the scene's lights file, which
    are not stored with the basis, since that file may change.
    """

    records: tuple[BasisLight, ...]
    requests: SceneRequests = field(default_factory=SceneRequests)

    def __post_init__(self) -> None:
        object.__setattr__(self, "records", Listed(self.records))
        if len(set(self.names)) != len(self.records):
            raise BasisError(f"light names repeat: {some_names(self.names)}")

    @classmethod
    def of(cls, lights: Sequence[BasisLight]) -> "Lights":
        """Return `lights` as a table."""
        return lights if isinstance(lights, Lights) else cls(tuple(lights))

    def __repr__(self) -> str:
        return repr(self.records)

    def __len__(self) -> int:
        return len(self.records)

    def __iter__(self) -> Iterator[BasisLight]:
        return iter(self.records)

    @overload
    def __getitem__(self, k: int) -> BasisLight: ...
    @overload
    def __getitem__(self, k: slice) -> tuple[BasisLight, ...]: ...
    def __getitem__(self, k: int | slice) -> BasisLight | tuple[BasisLight, ...]:
        return self.records[k]

    def with_requests(self, requests: SceneRequests) -> "Lights":
        """Return these lights with other requests."""
        return self if self.requests == requests else replace(self, requests=requests)

    def identity(self, i: int) -> str:
        """Return the identity of plane i; "" if unknown."""
        return self.records[i].identity

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the lights."""
        return tuple(light.name for light in self.records)

    @cached_property
    def current_weights(self) -> Doubles:
        """Weights of the current scene, (n, 3)."""
        emission = [light.emission for light in self.records]
        return read_only(np.array(emission, dtype=np.float64).reshape(-1, 3))

    @cached_property
    def is_fixed(self) -> Bools:
        """(n,), True for lights that stay as they are, with weight 1."""
        return read_only(np.array([light.is_fixed for light in self.records], dtype=bool))

    @cached_property
    def is_scalar(self) -> Bools:
        """(n,), True for lights that have one weight for all channels."""
        return read_only(np.array([light.is_scalar for light in self.records], dtype=bool))


def free_name(name: str, used: Collection[str]) -> str:
    """Return `name` with underscores appended until no other light has it."""
    while name in used:
        name += "_"
    return name
