"""Rendering a basis with Mitsuba: all lights in one pass, or one after the other."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    # fmt: off
    from lightpaint.basis.render.banded_film import (
        check_memory, memory_expected, memory_needed, renders_in_bands,
    )
    from lightpaint.basis.render.basis_render import (
        check_size, render_basis, train_guide, training_samples, with_first_hits,
    )
    from lightpaint.basis.render.integrators import (
        check_renders_spectra, remark_on_fog, remark_on_separate_renders, why_not_one_pass,
    )
    from lightpaint.basis.render.pixel_top_up import KeptTracer, kept_loaded
    from lightpaint.basis.render.plain_look import render_plain_look
    from lightpaint.basis.render.render_budget import check_samples
    from lightpaint.basis.render.render_parts import Part, PartRenderer, PartSums, plan_parts
    from lightpaint.basis.render.rendered_basis import (
        ONE_PASS, basis_lights, basis_of_sums, is_of, method_of, samples_for,
    )
    from lightpaint.basis.render.separate_renders import emitters_seen
    # fmt: on

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
