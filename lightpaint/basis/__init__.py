"""The basis of a `Scene`: one image per light."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    # fmt: off
    from lightpaint.basis.cache.denoised_planes import (
        DenoisedPlanes, RoughPlanes, as_halves, cache_denoised_planes, denoise_to_halves,
        obtain_denoised_planes, read_denoised_planes, scale_of,
    )
    from lightpaint.basis.denoised_mixes import (
        MixQuality, denoise_current_look, denoise_mix, denoise_mixes, denoise_plane, read_look,
        read_look_noise, read_look_side,
    )
    from lightpaint.basis.derived_planes import (
        PlaneReference, block_means, compose_planes, in_one_row,
    )
    from lightpaint.basis.file.basis_file import is_basis_file, is_large, read_basis, write_basis
    from lightpaint.basis.file.file_planes import spooled
    from lightpaint.basis.light_basis import (
        Basis, Origin, as_multiplied, can_be_multiplied, channel_responses, meter_exposure,
    )
    from lightpaint.basis.lightgroups.frame_sequence import (
        SIGN, FrameSequence, find_frames, is_pattern, parse_frames, spoken_frames,
    )
    from lightpaint.basis.lightgroups.light_groups import (
        LightGroups, first_frame, read_light_groups, with_equal_lights,
    )
    from lightpaint.basis.lightgroups.render_layers import (
        RenderLayer, is_exr, is_light_groups, is_own_basis,
    )
    from lightpaint.basis.lights import (
        TEXELS, BasisLight, LightImage, Lights, free_name, is_of_texels, joined_texels,
        light_images, texel_lights,
    )
    from lightpaint.basis.plane_results import array_name, array_once, make_once
    from lightpaint.basis.planes import (
        BLOCK_PIXELS, FEW_LIGHTS, IndirectLight, LitEntries, MemoryPlanes, Planes, Rooms, as_planes,
        as_slice, block_of, blocks_of, joined_planes, mix_channels, thinned, walked_blocks,
    )
    from lightpaint.basis.working_primaries import multipliers_in
    # fmt: on

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
