"""Images among lights: lights that are the texels of one light around the scene."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.basis.lights import BasisLight
from lightpaint.scene.lights.texels import (
    SPLIT_PLUGINS,
    GridSize,
    image_of,
    images_of,
    solid_angles,
    texel_names,
)

#: The middle of a phrase for several texels of an image.
TEXELS = " texels of "


@dataclass(frozen=True)
class LightImage:
    """An image of lights.

    name: of the light that was split. places: (rows, columns), the index of the light that is each
    texel alone; −1 for a texel that is not adjusted, or adjusted together with others.
    """

    name: str
    places: Indices

    @property
    def size(self) -> GridSize:
        """Columns and rows."""
        rows, columns = self.places.shape
        return columns, rows

    @property
    def is_whole(self) -> bool:
        """True if every texel is a light of its own."""
        return bool((self.places >= 0).all())

    @property
    def lights(self) -> Indices:
        """Indices of its lights, row by row."""
        return self.places[self.places >= 0]

    def mean(self, radiances: Doubles) -> Doubles:
        """Return the mean over all directions, (3,). radiances: (n, 3), those of all lights."""
        angles = solid_angles(self.size)[self.places >= 0]
        return np.asarray(angles @ radiances[self.lights] / angles.sum())


def light_images(lights: Sequence[BasisLight]) -> list[LightImage]:
    """Return the images around the scene that have texels among `lights`."""
    index = {light.name: k for k, light in enumerate(lights) if not light.is_fixed}
    images = []
    for name, size in images_of(name for light in lights for name in light.members).items():
        places = np.array([index.get(texel, -1) for texel in texel_names(name, size)])
        # A name like that of a texel may be that of a light in another renderer's file.
        plugins = {lights[k].plugin for k in places[places >= 0]}
        if plugins and plugins <= {*SPLIT_PLUGINS}:
            images.append(LightImage(name, places.reshape(size[::-1])))
    return images


def texel_lights(lights: Sequence[BasisLight]) -> Bools:
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
