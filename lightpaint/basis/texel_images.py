"""Images among lights: lights that are the texels of one light that was split."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
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

#: The middle of a phrase for several texels of an image.
TEXELS = " texels of "


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
