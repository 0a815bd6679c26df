"""Images in texels: where these lie on each kind of light, and what they show."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    # fmt: off
    from lightpaint.scene.lights.texels.image_domains import (
        DOMAINS, FlatDomain, GridSize, ImageDomain, Sky, Slide, Wall, domain_of,
    )
    from lightpaint.scene.lights.texels.texel import (
        CHILDREN, MAX_LEVEL, RATIO, Node, TexelLayout, coarse_name, image_of, images_of, layouts_of,
        mirrored_pairs, node_name, texel_place,
    )
    # fmt: on

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
