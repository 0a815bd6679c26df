"""Rendering a basis with Mitsuba: all lights in one pass, or one after the other."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    from lightpaint.basis.render.banded_film import check_memory as check_memory
    from lightpaint.basis.render.banded_film import memory_expected as memory_expected
    from lightpaint.basis.render.banded_film import memory_needed as memory_needed
    from lightpaint.basis.render.banded_film import renders_in_bands as renders_in_bands
    from lightpaint.basis.render.basis_render import check_size as check_size
    from lightpaint.basis.render.basis_render import render_basis as render_basis
    from lightpaint.basis.render.basis_render import train_guide as train_guide
    from lightpaint.basis.render.basis_render import training_samples as training_samples
    from lightpaint.basis.render.basis_render import with_first_hits as with_first_hits
    from lightpaint.basis.render.integrators import check_renders_spectra as check_renders_spectra
    from lightpaint.basis.render.integrators import (
        remark_on_separate_renders as remark_on_separate_renders,
    )
    from lightpaint.basis.render.integrators import why_not_one_pass as why_not_one_pass
    from lightpaint.basis.render.pixel_top_up import KeptTracer as KeptTracer
    from lightpaint.basis.render.pixel_top_up import kept_loaded as kept_loaded
    from lightpaint.basis.render.render_budget import check_samples as check_samples
    from lightpaint.basis.render.render_parts import Part as Part
    from lightpaint.basis.render.render_parts import PartRenderer as PartRenderer
    from lightpaint.basis.render.render_parts import PartSums as PartSums
    from lightpaint.basis.render.render_parts import plan_parts as plan_parts
    from lightpaint.basis.render.rendered_basis import ONE_PASS as ONE_PASS
    from lightpaint.basis.render.rendered_basis import basis_lights as basis_lights
    from lightpaint.basis.render.rendered_basis import basis_of_sums as basis_of_sums
    from lightpaint.basis.render.rendered_basis import is_of as is_of
    from lightpaint.basis.render.rendered_basis import method_of as method_of
    from lightpaint.basis.render.rendered_basis import samples_for as samples_for
    from lightpaint.basis.render.separate_renders import emitters_seen as emitters_seen

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
