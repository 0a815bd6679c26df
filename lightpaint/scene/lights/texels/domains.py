"""The lights that can be split, and what their images cover."""

from lightpaint.scene.lights.texels.flat_images import Slide, Wall
from lightpaint.scene.lights.texels.image_domain import ImageDomain
from lightpaint.scene.lights.texels.sky import Sky

#: What the image of an emitter covers, by its plugin. A light of one colour becomes an image.
DOMAINS: dict[str, ImageDomain] = {
    "envmap": Sky(),
    "constant": Sky(),
    "area": Wall(),
    "projector": Slide(),
}

#: Rectangles have their second texture coordinate upwards.
RECTANGLE_WALL = Wall(is_upside_down=True)


def domain_of(plugin: str, shape: str = "") -> ImageDomain:
    """Return what the image of an emitter of this plugin covers. shape: plugin of its shape."""
    return RECTANGLE_WALL if shape == "rectangle" else DOMAINS[plugin]
