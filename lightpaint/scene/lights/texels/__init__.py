"""Images in texels: where these lie on each kind of light, and what they show."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    from lightpaint.scene.lights.texels.image_domains import DOMAINS as DOMAINS
    from lightpaint.scene.lights.texels.image_domains import FlatDomain as FlatDomain
    from lightpaint.scene.lights.texels.image_domains import GridSize as GridSize
    from lightpaint.scene.lights.texels.image_domains import ImageDomain as ImageDomain
    from lightpaint.scene.lights.texels.image_domains import Sky as Sky
    from lightpaint.scene.lights.texels.image_domains import Slide as Slide
    from lightpaint.scene.lights.texels.image_domains import Wall as Wall
    from lightpaint.scene.lights.texels.image_domains import domain_of as domain_of
    from lightpaint.scene.lights.texels.texel import CHILDREN as CHILDREN
    from lightpaint.scene.lights.texels.texel import MAX_LEVEL as MAX_LEVEL
    from lightpaint.scene.lights.texels.texel import RATIO as RATIO
    from lightpaint.scene.lights.texels.texel import Node as Node
    from lightpaint.scene.lights.texels.texel import TexelLayout as TexelLayout
    from lightpaint.scene.lights.texels.texel import coarse_name as coarse_name
    from lightpaint.scene.lights.texels.texel import image_of as image_of
    from lightpaint.scene.lights.texels.texel import images_of as images_of
    from lightpaint.scene.lights.texels.texel import layouts_of as layouts_of
    from lightpaint.scene.lights.texels.texel import mirrored_pairs as mirrored_pairs
    from lightpaint.scene.lights.texels.texel import node_name as node_name
    from lightpaint.scene.lights.texels.texel import texel_place as texel_place

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
