"""Reading and writing pictures, and images in memory: noise, denoising, blocks."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    from lightpaint.images.denoiser import DARKEST as DARKEST
    from lightpaint.images.denoiser import DENOISED_KEY as DENOISED_KEY
    from lightpaint.images.denoiser import MISSING_REMARK as MISSING_REMARK
    from lightpaint.images.denoiser import OLDEST_OIDN as OLDEST_OIDN
    from lightpaint.images.denoiser import Features as Features
    from lightpaint.images.denoiser import Quality as Quality
    from lightpaint.images.denoiser import denoised as denoised
    from lightpaint.images.denoiser import denoiser_text as denoiser_text
    from lightpaint.images.denoiser import oidn_is_installed as oidn_is_installed
    from lightpaint.images.estimate import HALF_DIFFERENCE as HALF_DIFFERENCE
    from lightpaint.images.estimate import Estimate as Estimate
    from lightpaint.images.estimate import box_mean as box_mean
    from lightpaint.images.estimate import read_estimate as read_estimate
    from lightpaint.images.estimate import shifted as shifted
    from lightpaint.images.estimate import write_estimate as write_estimate
    from lightpaint.images.object_map import BACKGROUND as BACKGROUND
    from lightpaint.images.object_map import Objects as Objects
    from lightpaint.images.packed_picture import PackedPicture as PackedPicture
    from lightpaint.images.packed_picture import pack_picture as pack_picture
    from lightpaint.images.picture import AT_LEAST as AT_LEAST
    from lightpaint.images.picture import Picture as Picture
    from lightpaint.images.picture import naming_file as naming_file
    from lightpaint.images.picture import read_mask as read_mask
    from lightpaint.images.picture import read_picture as read_picture
    from lightpaint.images.pixel_blocks import BAND_PIXELS as BAND_PIXELS
    from lightpaint.images.pixel_blocks import LARGE_PICTURE as LARGE_PICTURE
    from lightpaint.images.pixel_blocks import Size as Size
    from lightpaint.images.pixel_blocks import bands_of as bands_of
    from lightpaint.images.pixel_blocks import block_mean as block_mean
    from lightpaint.images.pixel_blocks import block_pixels as block_pixels
    from lightpaint.images.pixel_blocks import block_sums as block_sums
    from lightpaint.images.pixel_blocks import blocks_in as blocks_in
    from lightpaint.images.pixel_blocks import by_bands as by_bands
    from lightpaint.images.pixel_blocks import check_factor as check_factor
    from lightpaint.images.pixel_blocks import check_size as check_size
    from lightpaint.images.pixel_blocks import covered as covered
    from lightpaint.images.pixel_blocks import enlarged as enlarged
    from lightpaint.images.pixel_blocks import fitting_factor as fitting_factor
    from lightpaint.images.pixel_blocks import in_turns as in_turns
    from lightpaint.images.pixel_blocks import is_large as is_large
    from lightpaint.images.pixel_blocks import left_over as left_over
    from lightpaint.images.pixel_blocks import resampled as resampled
    from lightpaint.images.pixel_blocks import sum_by_bands as sum_by_bands
    from lightpaint.images.pixel_blocks import whole_factor as whole_factor
    from lightpaint.images.surface_filter import SurfaceFilter as SurfaceFilter

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
