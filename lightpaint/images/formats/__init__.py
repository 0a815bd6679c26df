"""Picture files: OpenEXR and PNG in and out; JPEG, TIFF, PSD and layered files in."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    # fmt: off
    from lightpaint.images.formats.bitmap import Bitmap
    from lightpaint.images.formats.exr import (
        OWN_PREFIX, Channels, ExrPart, compression_errors, read_channels, read_headers, read_parts,
        rgb_channels, write_parts, write_rgb,
    )
    from lightpaint.images.formats.exr_layers import (
        ALPHA_NAMES, KRITA_LAYERS, channel_named, colour_channels, primaries_of, vector_channels,
    )
    from lightpaint.images.formats.exr_rows import (
        PartHead, PartLayout, RowFile, RowsUnsupportedError, room_for, write_streamed,
    )
    from lightpaint.images.formats.file_kinds import head_of, kind_of
    from lightpaint.images.formats.library_output import (
        silenced, unsilenced, without_pillow_warnings,
    )
    from lightpaint.images.formats.openraster import (
        RasterGroup, RasterLayer, layered_kind, opened_openraster, write_openraster,
    )
    from lightpaint.images.formats.png import (
        TRANSFORM_KEY, png_bytes, png_has_text, write_png, write_png_16,
    )
    # fmt: on

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
