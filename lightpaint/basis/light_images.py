"""Images among lights: lights that are the texels of one light that was split."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.scene.lights.texels.domains import DOMAINS, domain_of
from lightpaint.scene.lights.texels.image_domain import GridSize, ImageDomain
from lightpaint.scene.lights.texels.texel import image_of, images_of, texel_names

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

    name: of the light that was split. places: (rows, columns), the index of each texel's light,
    which it has alone or, in a symmetric image, with its mirror image; −1 for a texel that is not
    adjusted, or adjusted together with others. domain: what it covers.
    """

    name: str
    places: Indices
    domain: ImageDomain

    @property
    def size(self) -> GridSize:
        """Columns and rows."""
        rows, columns = self.places.shape
        return columns, rows

    @property
    def is_whole(self) -> bool:
        """True if every texel is a light of its own, or one with its mirror image."""
        return bool((self.places >= 0).all())

    @property
    def lights(self) -> Indices:
        """Indices of its lights, each once, row by row."""
        return np.array([*dict.fromkeys(self.places[self.places >= 0].tolist())], dtype=np.intp)

    @property
    def light_shares(self) -> Doubles:
        """Share of its domain that each of its `lights` covers."""
        found = self.places >= 0
        lights, index = np.unique(self.places[found], return_inverse=True)
        shares = np.bincount(index, self.domain.shares(self.size)[found], len(lights))
        return np.asarray(shares[np.searchsorted(lights, self.lights)])

    @property
    def map_order(self) -> list[int]:
        """The number among its `lights` of each texel of an image that is whole, row by row."""
        number = {int(k): i for i, k in enumerate(self.lights)}
        return [number[k] for k in self.places.ravel().tolist()]

    def mean(self, radiances: Doubles) -> Doubles:
        """Return the mean over its domain, (3,). radiances: (n, 3), those of all lights."""
        found = self.places >= 0
        shares = self.domain.shares(self.size)[found]
        return np.asarray(shares @ radiances[self.places[found]] / shares.sum())


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
    for name, size in images_of(name for light in lights for name in light.members).items():
        places = np.array([index.get(texel, -1) for texel in texel_names(name, size)])
        # A name like that of a texel may be that of a light in another renderer's file.
        plugins = {lights[k].plugin for k in places[places >= 0]}
        if len(plugins) == 1 and plugins <= DOMAINS.keys():
            domain = domain_of(plugins.pop())
            images.append(LightImage(name, places.reshape(size[::-1]), domain))
    return images


def texel_lights(lights: Sequence[NamedLight]) -> Bools:
    """Return which lights are single texels of an image, (n,)."""
    is_texel = np.zeros(len(lights), bool)
    for image in light_images(lights):
        is_texel[image.lights] = True
    return is_texel


def joined_texels(names: Iterable[str]) -> list[str]:
    """Return names for a sentence, in which `12 texels of sky` stand for those of one image."""
    texels: dict[str, list[str]] = {}
    for name in names:
        texels.setdefault(image_of(name) or f"\0{name}", []).append(name)
    return [
        members[0] if len(members) == 1 else f"{len(members)}{TEXELS}{image}"
        for image, members in texels.items()
    ]
