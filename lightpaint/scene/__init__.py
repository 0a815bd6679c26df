"""Scenes: a Mitsuba XML becomes a `Scene` with named lights."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    # fmt: off
    from lightpaint.scene.lights.emitters import Emitter
    from lightpaint.scene.lights.hung_luminaires import (
        SPOT_MARK, HungLuminaire, luminaire_lines, luminaire_of_spot, matrix_text, panel_lines,
        rgb_text,
    )
    from lightpaint.scene.lights.image_split import even_image, texel_image, with_split
    from lightpaint.scene.lights.light import WHOLE_EMISSION, Light, free_names, part_name
    from lightpaint.scene.lights.new_emitter import PLUGIN_OF, NewEmitter, new_emitter_at
    from lightpaint.scene.mitsuba_scene import Scene
    from lightpaint.scene.properties.emission import (
        AS_AUTHORED, ENVIRONMENTS, MULTIPLE, PLUGINS, Scaling, child_named,
    )
    from lightpaint.scene.properties.film import (
        MeasuringPoints, check_resolution, reduction_to, with_width,
    )
    from lightpaint.scene.properties.integrator import Integrator
    from lightpaint.scene.properties.pose import FARTHEST, Pose, motion_of, pose_of
    from lightpaint.scene.scene_reader import load_scene, with_layout
    from lightpaint.scene.scene_render import (
        SAMPLES_PER_PASS, Stream, as_float32, estimate_of, largest_pass, pass_seed, pass_sum,
        passes_of, plan_passes, ranges_of, render, render_in_stages, render_pass, sampled_by,
        view_seed,
    )
    from lightpaint.scene.scene_tree import without_emitters
    from lightpaint.scene.surfaces import (
        loaded_features, names_by_shape, render_features, render_first_hits, render_reflectances,
        render_surfaces,
    )
    # fmt: on

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
