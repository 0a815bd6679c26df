"""Reading and writing pictures, and images in memory: noise, denoising, blocks."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    # fmt: off
    from lightpaint.images.denoiser import (
        DARKEST, DENOISED_KEY, MISSING_REMARK, OLDEST_OIDN, Features, Quality, denoised,
        denoiser_text, oidn_is_installed,
    )
    from lightpaint.images.estimate import (
        HALF_DIFFERENCE, Estimate, box_mean, read_estimate, shifted, write_estimate,
    )
    from lightpaint.images.neighbourhoods import (
        TAP, dilated, film_filtered, gaussian_mean, grown, number_parts,
    )
    from lightpaint.images.object_map import BACKGROUND, Objects
    from lightpaint.images.packed_picture import PackedPicture, pack_picture
    from lightpaint.images.picture import (
        AT_LEAST, Picture, picture_size, read_mask, read_picture,
    )
    from lightpaint.images.pixel_blocks import (
        BAND_PIXELS, LARGE_PICTURE, Size, bands_of, block_mean, block_pixels, block_sums, blocks_in,
        by_bands, check_factor, check_size, covered, edge_padded, enlarged, fitting_factor,
        in_turns, is_large, left_over, resampled, sum_by_bands, whole_factor,
    )
    from lightpaint.images.surface_filter import SurfaceFilter
    # fmt: on

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
