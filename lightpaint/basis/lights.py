"""The lights of a basis without pixels: their kinds, emission and constraints."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import overload

import numpy as np

from lightpaint.arrays import RGB, Bools, Doubles, read_only
from lightpaint.errors import BasisError
from lightpaint.scene.lights.lights_file import SceneRequests
from lightpaint.screen import Listed, some_names
from lightpaint.validation import BRIGHTEST, MAX_NAME, is_amount


@dataclass(frozen=True)
class BasisLight:
    """A light of a basis.

    parameter, unit: meaning of one unit of weight (`radiance`, `W/(m² sr)`). emission: its present
    RGB emission in the scene, in that unit. form: its place and size, as text. is_scalar: whether
    it can only be scaled as a whole, with one weight for all channels. is_fixed: whether it is not
    adjusted: its weight is 1.
    members: names of the emitters it consists of; itself if none are given.
    unit_flux: watts it radiates per channel at an emission of 1; None where that is not known.
    identity: of its plane; lights of the same identity have the same plane, up to noise (see
    `Light.identity`); "" if unknown.
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

    def __post_init__(self) -> None:
        if len(self.name) > MAX_NAME:
            raise BasisError(f"a light has a name of more than {MAX_NAME} characters")
        if not self.members:
            object.__setattr__(self, "members", (self.name,))
        if self.is_fixed and self.emission != (1, 1, 1):
            raise BasisError(f"light {self.name!r} is kept, and its emission is not 1")
        if not all(map(is_amount, self.emission)):
            raise BasisError(
                f"light {self.name!r} has the emission {list(self.emission)}: need three numbers "
                f"from 0 to {BRIGHTEST:g}"
            )
        if self.unit_flux and not all(map(is_amount, self.unit_flux)):
            raise BasisError(
                f"light {self.name!r} has a flux of {list(self.unit_flux)} at unit emission: need "
                f"three numbers from 0 to {BRIGHTEST:g}"
            )

    def __repr__(self) -> str:
        emission = " ".join(f"{v:.4g}" for v in self.emission)
        note = ", kept" if self.is_fixed else ""
        description = " ".join(filter(None, (self.plugin, self.parameter, emission, self.unit)))
        return f"BasisLight({self.name!r}, {description}{note})"


@dataclass(frozen=True)
class Lights(Sequence[BasisLight]):
    """The ordered table of lights: their order is the order of weights, planes and sums.

    records: the record of each light. requests: the constraints that the lights file of their scene
    asks for; of memory only, since that file may change.
    """

    records: tuple[BasisLight, ...]
    requests: SceneRequests = field(default_factory=SceneRequests)

    def __post_init__(self) -> None:
        object.__setattr__(self, "records", Listed(self.records))
        if len(set(self.names)) != len(self.records):
            raise BasisError(f"light names repeat: {some_names(self.names)}")

    @classmethod
    def of(cls, lights: Sequence[BasisLight]) -> "Lights":
        """Return `lights` as such a table."""
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
        """Return these lights with these requests."""
        return self if self.requests == requests else replace(self, requests=requests)

    def identity(self, i: int) -> str:
        """Return the identity of plane i; "" where that is not known."""
        return self.records[i].identity

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(light.name for light in self.records)

    @cached_property
    def present_weights(self) -> Doubles:
        """Weights of the present scene, (n, 3)."""
        emission = [light.emission for light in self.records]
        return read_only(np.array(emission, dtype=np.float64).reshape(-1, 3))

    @cached_property
    def is_fixed(self) -> Bools:
        """Which lights are fixed, with weight 1, (n,)."""
        return read_only(np.array([light.is_fixed for light in self.records], dtype=bool))

    @cached_property
    def is_scalar(self) -> Bools:
        """(n,), which lights have one weight for all channels."""
        return read_only(np.array([light.is_scalar for light in self.records], dtype=bool))


def free_name(name: str, used: Collection[str]) -> str:
    """Return `name`, with underscores added while another light has it."""
    while name in used:
        name += "_"
    return name
