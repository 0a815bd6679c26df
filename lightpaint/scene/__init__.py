"""Scenes: a Mitsuba XML becomes a `Scene` with named lights."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    from lightpaint.scene.lights.emitters import Emitter as Emitter
    from lightpaint.scene.lights.hung_luminaires import SPOT_MARK as SPOT_MARK
    from lightpaint.scene.lights.hung_luminaires import HungLuminaire as HungLuminaire
    from lightpaint.scene.lights.hung_luminaires import luminaire_lines as luminaire_lines
    from lightpaint.scene.lights.hung_luminaires import luminaire_of_spot as luminaire_of_spot
    from lightpaint.scene.lights.hung_luminaires import matrix_text as matrix_text
    from lightpaint.scene.lights.hung_luminaires import panel_lines as panel_lines
    from lightpaint.scene.lights.hung_luminaires import rgb_text as rgb_text
    from lightpaint.scene.lights.image_split import even_image as even_image
    from lightpaint.scene.lights.image_split import texel_image as texel_image
    from lightpaint.scene.lights.image_split import with_split as with_split
    from lightpaint.scene.lights.light import WHOLE_EMISSION as WHOLE_EMISSION
    from lightpaint.scene.lights.light import Light as Light
    from lightpaint.scene.lights.light import free_names as free_names
    from lightpaint.scene.lights.light import part_name as part_name
    from lightpaint.scene.lights.new_emitter import PLUGIN_OF as PLUGIN_OF
    from lightpaint.scene.lights.new_emitter import NewEmitter as NewEmitter
    from lightpaint.scene.lights.new_emitter import new_emitter_at as new_emitter_at
    from lightpaint.scene.mitsuba_scene import Scene as Scene
    from lightpaint.scene.properties.emission import AS_AUTHORED as AS_AUTHORED
    from lightpaint.scene.properties.emission import ENVIRONMENTS as ENVIRONMENTS
    from lightpaint.scene.properties.emission import MULTIPLE as MULTIPLE
    from lightpaint.scene.properties.emission import PLUGINS as PLUGINS
    from lightpaint.scene.properties.emission import Scaling as Scaling
    from lightpaint.scene.properties.emission import child_named as child_named
    from lightpaint.scene.properties.film import MeasuringPoints as MeasuringPoints
    from lightpaint.scene.properties.film import check_resolution as check_resolution
    from lightpaint.scene.properties.film import reduction_to as reduction_to
    from lightpaint.scene.properties.film import with_width as with_width
    from lightpaint.scene.properties.integrator import Integrator as Integrator
    from lightpaint.scene.properties.pose import FARTHEST as FARTHEST
    from lightpaint.scene.properties.pose import Pose as Pose
    from lightpaint.scene.properties.pose import motion_of as motion_of
    from lightpaint.scene.properties.pose import pose_of as pose_of
    from lightpaint.scene.scene_reader import load_scene as load_scene
    from lightpaint.scene.scene_reader import with_layout as with_layout
    from lightpaint.scene.scene_render import SAMPLES_PER_PASS as SAMPLES_PER_PASS
    from lightpaint.scene.scene_render import Stream as Stream
    from lightpaint.scene.scene_render import as_float32 as as_float32
    from lightpaint.scene.scene_render import estimate_of as estimate_of
    from lightpaint.scene.scene_render import largest_pass as largest_pass
    from lightpaint.scene.scene_render import pass_seed as pass_seed
    from lightpaint.scene.scene_render import pass_sum as pass_sum
    from lightpaint.scene.scene_render import passes_of as passes_of
    from lightpaint.scene.scene_render import plan_passes as plan_passes
    from lightpaint.scene.scene_render import ranges_of as ranges_of
    from lightpaint.scene.scene_render import render as render
    from lightpaint.scene.scene_render import render_in_stages as render_in_stages
    from lightpaint.scene.scene_render import render_pass as render_pass
    from lightpaint.scene.scene_render import sampled_by as sampled_by
    from lightpaint.scene.scene_render import view_seed as view_seed
    from lightpaint.scene.scene_tree import without_emitters as without_emitters
    from lightpaint.scene.surfaces import loaded_features as loaded_features
    from lightpaint.scene.surfaces import names_by_shape as names_by_shape
    from lightpaint.scene.surfaces import render_features as render_features
    from lightpaint.scene.surfaces import render_first_hits as render_first_hits
    from lightpaint.scene.surfaces import render_reflectances as render_reflectances
    from lightpaint.scene.surfaces import render_surfaces as render_surfaces

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
