"""lightpaint: paint how a scene should look; get the lighting that comes closest.

The method of "Painting with Light" (Schoeneman, Dorsey, Smits, Arvo, Greenberg, SIGGRAPH
1993) in image space on Mitsuba 3. Data passes through five stages in one direction:

    call                        in → out                             question
    load_scene                  scene XML → Scene                    which lights are there?
    render_basis, read_basis    Scene → Basis                        what does each do alone?
    read_light_groups           another renderer's EXR → LightGroups the same
    render_template             Scene → a folder to paint on
    template_of_basis           Basis → the same, without a renderer
    read_target                 painting → Target                    what is wanted, and where?
    solve                       Basis, Target → Solution             which lighting is closest?
    analyse                     Solution → Analysis of each view     how sure, and why not closer?
    compare_appearance          Solution → Appearance                how close does it look?
    combine                     Basis, Lighting → Estimate           what will it look like?
    relight                     Scene, Lighting → relit Scene        write it into the scene
    verify                      Estimate, relit Scene → Verification does it look like that?
    measure_illuminance         Scene, planes → Illuminance          how many lux does each give?

The examples below are tested: `lp` is this package, `np` NumPy, `basis` one of the scene room.xml,
whose lights are a panel and a bulb, and `target` a painting of it.

`paint_with_light` is all of it in one call, for one view or several: a `Job`, and a `run` of it.
Each name is imported when it is first used (PEP 562): importing this loads no
library. No Mitsuba variant is set before the first scene is loaded.
"""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names
from lightpaint.scene.runtime.drjit_import import choose_llvm_at_import
from lightpaint.version import __version__

if TYPE_CHECKING:
    from lightpaint.basis.file.basis_file import read_basis as read_basis
    from lightpaint.basis.file.basis_file import write_basis as write_basis
    from lightpaint.basis.light_basis import Basis as Basis
    from lightpaint.basis.lightgroups.frame_sequence import FrameSequence as FrameSequence
    from lightpaint.basis.lightgroups.frame_sequence import find_frames as find_frames
    from lightpaint.basis.lightgroups.light_groups import LightGroups as LightGroups
    from lightpaint.basis.lightgroups.light_groups import read_light_groups as read_light_groups
    from lightpaint.basis.render.basis_render import render_basis as render_basis
    from lightpaint.colour.display.view_transform import TransformChoice as TransformChoice
    from lightpaint.colour.display.view_transform import ViewTransform as ViewTransform
    from lightpaint.demo import Demo as Demo
    from lightpaint.demo import write_demo as write_demo
    from lightpaint.errors import LightpaintError as LightpaintError
    from lightpaint.images.estimate import Estimate as Estimate
    from lightpaint.images.formats.png import display_picture as display_picture
    from lightpaint.images.object_map import Objects as Objects
    from lightpaint.lighting.analysis.answer_analysis import Analysis as Analysis
    from lightpaint.lighting.analysis.answer_analysis import analyse as analyse
    from lightpaint.lighting.analysis.appearance.answer_appearance import Appearance as Appearance
    from lightpaint.lighting.analysis.appearance.answer_appearance import (
        compare_appearance as compare_appearance,
    )
    from lightpaint.lighting.analysis.diagnosis import Diagnosis as Diagnosis
    from lightpaint.lighting.analysis.diagnosis import diagnose as diagnose
    from lightpaint.lighting.analysis.noise.noise_correction import correct_noise as correct_noise
    from lightpaint.lighting.analysis.noise.noise_correction import refine as refine
    from lightpaint.lighting.analysis.noise.uncertainty import Uncertainty as Uncertainty
    from lightpaint.lighting.analysis.noise.uncertainty import error_bars as error_bars
    from lightpaint.lighting.analysis.noise.uncertainty import with_error_bars as with_error_bars
    from lightpaint.lighting.answer.certificate import Certificate as Certificate
    from lightpaint.lighting.answer.combination import combine as combine
    from lightpaint.lighting.answer.lighting import Lighting as Lighting
    from lightpaint.lighting.answer.lighting_file import read_lighting as read_lighting
    from lightpaint.lighting.answer.lighting_file import write_lighting as write_lighting
    from lightpaint.lighting.constraints.constraint_table import Constraints as Constraints
    from lightpaint.lighting.constraints.constraints_file import (
        read_constraints as read_constraints,
    )
    from lightpaint.lighting.default_solve import solve as solve
    from lightpaint.lighting.fit import Fit as Fit
    from lightpaint.lighting.problem import Problem as Problem
    from lightpaint.lighting.solution import Solution as Solution
    from lightpaint.paint.notebook.widget import Painter as Painter
    from lightpaint.photometry.illuminance import Illuminance as Illuminance
    from lightpaint.photometry.illuminance import MeasuringPlane as MeasuringPlane
    from lightpaint.photometry.measure import measure_glare as measure_glare
    from lightpaint.photometry.measure import measure_illuminance as measure_illuminance
    from lightpaint.photometry.planes_file import read_planes as read_planes
    from lightpaint.pipeline.job.settings import Settings as Settings
    from lightpaint.pipeline.job.solve_job import Job as Job
    from lightpaint.pipeline.job.sources import Painting as Painting
    from lightpaint.pipeline.job.sources import SceneFile as SceneFile
    from lightpaint.pipeline.job_run import run as run
    from lightpaint.pipeline.one_call import paint_with_light as paint_with_light
    from lightpaint.pipeline.relit_renders import relight_frames as relight_frames
    from lightpaint.pipeline.look import Look as Look
    from lightpaint.pipeline.templates import render_template as render_template
    from lightpaint.pipeline.templates import template_of_basis as template_of_basis
    from lightpaint.placement.freedom import Freedom as Freedom
    from lightpaint.placement.light_changes import AddedLight as AddedLight
    from lightpaint.placement.light_changes import Move as Move
    from lightpaint.placement.light_changes import Placement as Placement
    from lightpaint.placement.new_lights import MirroredPair as MirroredPair
    from lightpaint.placement.new_lights import NewLights as NewLights
    from lightpaint.placement.place_search import place as place
    from lightpaint.placement.place_search import suggest_lights as suggest_lights
    from lightpaint.placement.rigging import Rigging as Rigging
    from lightpaint.placement.suggestion import Suggestion as Suggestion
    from lightpaint.relit.export.exports import write_exports as write_exports
    from lightpaint.relit.relit_scene import relight as relight
    from lightpaint.relit.verification import Verification as Verification
    from lightpaint.relit.verification_render import verify as verify
    from lightpaint.report.verdict_sentences import verdict as verdict
    from lightpaint.scene.lights.new_emitter import NewEmitter as NewEmitter
    from lightpaint.scene.mitsuba_scene import Scene as Scene
    from lightpaint.scene.properties.pose import Pose as Pose
    from lightpaint.scene.runtime.variant import use_variant as use_variant
    from lightpaint.scene.scene_reader import load_scene as load_scene
    from lightpaint.target.painted_target import Target as Target
    from lightpaint.target.target_reader import read_target as read_target

choose_llvm_at_import()

_NAMES: list[str]
if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, _NAMES = lazy_names(__name__)

#: Names that need an extra, and are not part of `import *`.
_EXTRAS = ("Painter",)

__all__ = ["__version__", *(name for name in _NAMES if name not in _EXTRAS)]
