"""The basis of a `Scene`: one image per light."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    from lightpaint.basis.cache.denoised_planes import DenoisedPlanes as DenoisedPlanes
    from lightpaint.basis.cache.denoised_planes import RoughPlanes as RoughPlanes
    from lightpaint.basis.cache.denoised_planes import as_halves as as_halves
    from lightpaint.basis.cache.denoised_planes import (
        cache_denoised_planes as cache_denoised_planes,
    )
    from lightpaint.basis.cache.denoised_planes import denoise_to_halves as denoise_to_halves
    from lightpaint.basis.cache.denoised_planes import (
        obtain_denoised_planes as obtain_denoised_planes,
    )
    from lightpaint.basis.cache.denoised_planes import read_denoised_planes as read_denoised_planes
    from lightpaint.basis.cache.denoised_planes import scale_of as scale_of
    from lightpaint.basis.denoised_mixes import denoise_current_look as denoise_current_look
    from lightpaint.basis.denoised_mixes import denoise_mix as denoise_mix
    from lightpaint.basis.denoised_mixes import denoise_mixes as denoise_mixes
    from lightpaint.basis.denoised_mixes import denoise_plane as denoise_plane
    from lightpaint.basis.derived_planes import PlaneReference as PlaneReference
    from lightpaint.basis.derived_planes import block_means as block_means
    from lightpaint.basis.derived_planes import compose_planes as compose_planes
    from lightpaint.basis.derived_planes import in_one_row as in_one_row
    from lightpaint.basis.file.basis_file import is_basis_file as is_basis_file
    from lightpaint.basis.file.basis_file import is_large as is_large
    from lightpaint.basis.file.basis_file import read_basis as read_basis
    from lightpaint.basis.file.basis_file import write_basis as write_basis
    from lightpaint.basis.file.file_planes import spooled as spooled
    from lightpaint.basis.light_basis import Basis as Basis
    from lightpaint.basis.light_basis import Origin as Origin
    from lightpaint.basis.light_basis import meter_exposure as meter_exposure
    from lightpaint.basis.lightgroups.frame_sequence import SIGN as SIGN
    from lightpaint.basis.lightgroups.frame_sequence import FrameSequence as FrameSequence
    from lightpaint.basis.lightgroups.frame_sequence import find_frames as find_frames
    from lightpaint.basis.lightgroups.frame_sequence import is_pattern as is_pattern
    from lightpaint.basis.lightgroups.frame_sequence import parse_frames as parse_frames
    from lightpaint.basis.lightgroups.frame_sequence import spoken_frames as spoken_frames
    from lightpaint.basis.lightgroups.light_groups import LightGroups as LightGroups
    from lightpaint.basis.lightgroups.light_groups import first_frame as first_frame
    from lightpaint.basis.lightgroups.light_groups import read_light_groups as read_light_groups
    from lightpaint.basis.lightgroups.light_groups import with_equal_lights as with_equal_lights
    from lightpaint.basis.lightgroups.render_layers import RenderLayer as RenderLayer
    from lightpaint.basis.lightgroups.render_layers import is_exr as is_exr
    from lightpaint.basis.lightgroups.render_layers import is_light_groups as is_light_groups
    from lightpaint.basis.lightgroups.render_layers import is_own_basis as is_own_basis
    from lightpaint.basis.lights import TEXELS as TEXELS
    from lightpaint.basis.lights import BasisLight as BasisLight
    from lightpaint.basis.lights import LightImage as LightImage
    from lightpaint.basis.lights import Lights as Lights
    from lightpaint.basis.lights import free_name as free_name
    from lightpaint.basis.lights import is_of_texels as is_of_texels
    from lightpaint.basis.lights import joined_texels as joined_texels
    from lightpaint.basis.lights import light_images as light_images
    from lightpaint.basis.lights import texel_lights as texel_lights
    from lightpaint.basis.plane_results import array_name as array_name
    from lightpaint.basis.plane_results import array_once as array_once
    from lightpaint.basis.plane_results import make_once as make_once
    from lightpaint.basis.planes import BLOCK_PIXELS as BLOCK_PIXELS
    from lightpaint.basis.planes import FEW_LIGHTS as FEW_LIGHTS
    from lightpaint.basis.planes import IndirectLight as IndirectLight
    from lightpaint.basis.planes import LitEntries as LitEntries
    from lightpaint.basis.planes import MemoryPlanes as MemoryPlanes
    from lightpaint.basis.planes import Planes as Planes
    from lightpaint.basis.planes import Rooms as Rooms
    from lightpaint.basis.planes import as_planes as as_planes
    from lightpaint.basis.planes import as_slice as as_slice
    from lightpaint.basis.planes import block_of as block_of
    from lightpaint.basis.planes import joined_planes as joined_planes
    from lightpaint.basis.planes import mix_channels as mix_channels
    from lightpaint.basis.planes import thinned as thinned

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
