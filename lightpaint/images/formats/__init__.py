"""Picture files: OpenEXR and PNG in and out; JPEG, TIFF, PSD and layered files in."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    from lightpaint.images.formats.bitmap import MAX_PIXELS as MAX_PIXELS
    from lightpaint.images.formats.bitmap import Bitmap as Bitmap
    from lightpaint.images.formats.bitmap import light_of_integers as light_of_integers
    from lightpaint.images.formats.exr import OWN_PREFIX as OWN_PREFIX
    from lightpaint.images.formats.exr import Channels as Channels
    from lightpaint.images.formats.exr import ExrPart as ExrPart
    from lightpaint.images.formats.exr import read_channels as read_channels
    from lightpaint.images.formats.exr import read_headers as read_headers
    from lightpaint.images.formats.exr import read_parts as read_parts
    from lightpaint.images.formats.exr import rgb_channels as rgb_channels
    from lightpaint.images.formats.exr import write_parts as write_parts
    from lightpaint.images.formats.exr import write_rgb as write_rgb
    from lightpaint.images.formats.exr_layers import ALPHA_NAMES as ALPHA_NAMES
    from lightpaint.images.formats.exr_layers import KRITA_LAYERS as KRITA_LAYERS
    from lightpaint.images.formats.exr_layers import channel_named as channel_named
    from lightpaint.images.formats.exr_layers import colour_channels as colour_channels
    from lightpaint.images.formats.exr_layers import primaries_of as primaries_of
    from lightpaint.images.formats.exr_layers import vector_channels as vector_channels
    from lightpaint.images.formats.exr_rows import PartHead as PartHead
    from lightpaint.images.formats.exr_rows import PartLayout as PartLayout
    from lightpaint.images.formats.exr_rows import RowFile as RowFile
    from lightpaint.images.formats.exr_rows import RowsUnsupportedError as RowsUnsupportedError
    from lightpaint.images.formats.exr_rows import room_for as room_for
    from lightpaint.images.formats.exr_rows import write_streamed as write_streamed
    from lightpaint.images.formats.file_kinds import head_of as head_of
    from lightpaint.images.formats.file_kinds import kind_of as kind_of
    from lightpaint.images.formats.library_output import silenced as silenced
    from lightpaint.images.formats.library_output import unsilenced as unsilenced
    from lightpaint.images.formats.library_output import (
        without_pillow_warnings as without_pillow_warnings,
    )
    from lightpaint.images.formats.openraster import RasterGroup as RasterGroup
    from lightpaint.images.formats.openraster import RasterLayer as RasterLayer
    from lightpaint.images.formats.openraster import layered_kind as layered_kind
    from lightpaint.images.formats.openraster import opened_openraster as opened_openraster
    from lightpaint.images.formats.openraster import write_openraster as write_openraster
    from lightpaint.images.formats.png import TRANSFORM_KEY as TRANSFORM_KEY
    from lightpaint.images.formats.png import png_bytes as png_bytes
    from lightpaint.images.formats.png import png_has_text as png_has_text
    from lightpaint.images.formats.png import write_png as write_png
    from lightpaint.images.formats.png import write_png_16 as write_png_16

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
