"""The lights of a basis, without pixels: kinds, emission, requests of their lights file; and the
images among them, whose texels are lights.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol, overload

import numpy as np

from lightpaint.arrays import RGB, Bools, Doubles, Indices, read_only
from lightpaint.dataframes import by_channel
from lightpaint.display_text import Listed, some_names
from lightpaint.errors import BasisError
from lightpaint.scene.lights.lights_file import SceneRequests
from lightpaint.scene.lights.texels import (
    DOMAINS,
    GridSize,
    ImageDomain,
    TexelLayout,
    domain_of,
    image_of,
    layouts_of,
    node_name,
)
from lightpaint.validation import BRIGHTEST, MAX_NAME, is_amount

#: The middle of a phrase for several texels of an image.
TEXELS = " texels of "


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


class NamedLight(Protocol):
    """A light of a basis or of a lighting; see `BasisLight`."""

    @property
    def name(self) -> str: ...

    @property
    def plugin(self) -> str: ...

    @property
    def is_fixed(self) -> bool: ...

    @property
    def members(self) -> tuple[str, ...]: ...


@dataclass(frozen=True)
class LightImage:
    """An image of lights.

    name: of the light that was split. layout: of its texels. index: (nodes,), the index of each
    texel's light, which it has alone or, in a symmetric image, with its mirror image; −1 for a
    texel that is not adjusted, or adjusted together with others. domain: what it covers.
    """

    name: str
    layout: TexelLayout
    index: Indices
    domain: ImageDomain

    @property
    def size(self) -> GridSize:
        """Columns and rows of its coarsest grid."""
        return self.layout.size

    @property
    def size_text(self) -> str:
        """Its size for people."""
        return self.layout.size_text

    @cached_property
    def places(self) -> Indices:
        """(rows, columns) of its coarsest grid, the index of the light of the texel there."""
        columns, rows = self.size
        numbers = [
            self.layout.number_of[self.layout.texel_at((0, x, y))]
            for y in range(rows)
            for x in range(columns)
        ]
        return np.asarray(self.index[numbers].reshape(rows, columns))

    @cached_property
    def nearest(self) -> Indices:
        """(rows, columns) of its finest grid, the index of the light of the nearest texel."""
        return np.asarray(self.index[self.layout.nearest])

    @property
    def nearest_shares(self) -> Doubles:
        """(rows, columns) of its finest grid, the share of the nearest texel, in equal parts for
        all places that are nearest to it.
        """
        counts = np.bincount(self.layout.nearest.ravel(), minlength=len(self.shares))
        return np.asarray((self.shares / counts)[self.layout.nearest])

    @property
    def is_split(self) -> Bools:
        """(rows, columns) of its coarsest grid, the texels that are split again."""
        columns, rows = self.size
        is_split = np.zeros((rows, columns), bool)
        for level, column, row in self.layout.splits:
            if level == 0:
                is_split[row, column] = True
        return is_split

    @property
    def is_whole(self) -> bool:
        """True if every texel is a light of its own, or one with its mirror image."""
        return bool((self.index >= 0).all())

    @property
    def lights(self) -> Indices:
        """Indices of its lights, each once, row by row."""
        return np.array([*dict.fromkeys(self.index[self.index >= 0].tolist())], dtype=np.intp)

    @cached_property
    def shares(self) -> Doubles:
        """Share of its domain under the hat of each texel, (nodes,)."""
        return self.layout.sums(self.domain.shares(self.layout.finest))

    @property
    def light_shares(self) -> Doubles:
        """Share of its domain that each of its `lights` covers."""
        found = self.index >= 0
        shares = np.bincount(self.index[found], self.shares[found])
        return np.asarray(shares[self.lights])

    @property
    def map_order(self) -> list[int]:
        """The number among its `lights` of each place of an image that is whole, row by row."""
        number = {int(k): i for i, k in enumerate(self.lights)}
        return [number[k] for k in self.places.ravel().tolist()]

    def radiances(self, weights: Doubles) -> Doubles:
        """Return the image that lights make, (rows, columns, 3) of its finest grid.

        weights: (n, 3), of all lights. A texel without a light is black.
        """
        return self.layout.image(np.where((self.index >= 0)[:, None], weights[self.index], 0))

    def mean(self, radiances: Doubles) -> Doubles:
        """Return the mean over its domain, (3,). radiances: (n, 3), the radiances of all lights."""
        found = self.index >= 0
        shares = self.shares[found]
        return np.asarray(shares @ radiances[self.index[found]] / shares.sum())


def light_images(lights: Sequence[NamedLight]) -> list[LightImage]:
    """Return the images that have texels among `lights`."""
    # A light of several texels that has the name of one is symmetric; others are groups.
    index = {
        texel: k
        for k, light in enumerate(lights)
        if not light.is_fixed
        for texel in (light.members if light.name in light.members else (light.name,))
    }
    images = []
    for name, layout in layouts_of(name for light in lights for name in light.members).items():
        places = np.array([index.get(node_name(name, node), -1) for node in layout.nodes])
        # A name like the name of a texel may be the name of a light in another renderer's file.
        plugins = {lights[k].plugin for k in places[places >= 0]}
        if len(plugins) == 1 and plugins <= DOMAINS.keys():
            images.append(LightImage(name, layout, places, domain_of(plugins.pop())))
    return images


def texel_lights(lights: Sequence[NamedLight]) -> Bools:
    """Return which lights are single texels of an image, (n,)."""
    is_texel = np.zeros(len(lights), bool)
    for image in light_images(lights):
        is_texel[image.lights] = True
    return is_texel


def is_of_texels(name: str) -> bool:
    """Return whether a name is the name of a texel, or one that `joined_texels` gives to
    several."""
    return TEXELS in name or bool(image_of(name))


def joined_texels(names: Iterable[str]) -> list[str]:
    """Return names for a sentence, in which `12 texels of sky` stand for the texels of one
    image."""
    texels: dict[str, list[str]] = {}
    for name in names:
        texels.setdefault(image_of(name) or f"\0{name}", []).append(name)
    return [
        members[0] if len(members) == 1 else f"{len(members)}{TEXELS}{image}"
        for image, members in texels.items()
    ]
