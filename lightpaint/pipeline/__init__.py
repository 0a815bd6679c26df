"""The pipeline: a job, its run, and its results."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    from lightpaint.pipeline.job.job_checks import remarks_of_film as remarks_of_film
    from lightpaint.pipeline.job.job_checks import remarks_of_memory as remarks_of_memory
    from lightpaint.pipeline.job.job_checks import remarks_of_scene as remarks_of_scene
    from lightpaint.pipeline.job.job_checks import remarks_on_spectra as remarks_on_spectra
    from lightpaint.pipeline.job.job_record import decode_job as decode_job
    from lightpaint.pipeline.job.job_record import encode_job as encode_job
    from lightpaint.pipeline.job.settings import Settings as Settings
    from lightpaint.pipeline.job.settings import SettingsByName as SettingsByName
    from lightpaint.pipeline.job.solve_job import Job as Job
    from lightpaint.pipeline.job.solve_job import PaintedView as PaintedView
    from lightpaint.pipeline.job.sources import BasisFile as BasisFile
    from lightpaint.pipeline.job.sources import GroupsFile as GroupsFile
    from lightpaint.pipeline.job.sources import Painting as Painting
    from lightpaint.pipeline.job.sources import PlacementFile as PlacementFile
    from lightpaint.pipeline.job.sources import SceneFile as SceneFile
    from lightpaint.pipeline.job.sources import check_needed as check_needed
    from lightpaint.pipeline.job.sources import check_nothing_unused as check_nothing_unused
    from lightpaint.pipeline.job.sources import check_spectral as check_spectral
    from lightpaint.pipeline.job.sources import content as content
    from lightpaint.pipeline.job.sources import lamps_of_scene as lamps_of_scene
    from lightpaint.pipeline.job.sources import observer_of as observer_of
    from lightpaint.pipeline.job.sources import scaled_constraints as scaled_constraints
    from lightpaint.pipeline.job.sources import spectral_scene as spectral_scene
    from lightpaint.pipeline.job.sources import vars_of as vars_of
    from lightpaint.pipeline.job_bases import Certainty as Certainty
    from lightpaint.pipeline.job_bases import needed_counts as needed_counts
    from lightpaint.pipeline.job_bases import obtain as obtain
    from lightpaint.pipeline.job_run import run as run
    from lightpaint.pipeline.one_call import paint_with_light as paint_with_light
    from lightpaint.pipeline.placed_lights import find_places as find_places
    from lightpaint.pipeline.placed_lights import moved_basis as moved_basis
    from lightpaint.pipeline.placed_lights import say_changes as say_changes
    from lightpaint.pipeline.relit_renders import DENOISED as DENOISED
    from lightpaint.pipeline.relit_renders import frames_to_write as frames_to_write
    from lightpaint.pipeline.relit_renders import relight_frames as relight_frames
    from lightpaint.pipeline.relit_renders import relight_look as relight_look
    from lightpaint.pipeline.relit_renders import relit_folder as relit_folder
    from lightpaint.pipeline.relit_renders import render_final as render_final
    from lightpaint.pipeline.relit_renders import write_final_exr as write_final_exr
    from lightpaint.pipeline.relit_renders import write_final_png as write_final_png
    from lightpaint.pipeline.results.look import Look as Look
    from lightpaint.pipeline.results.look import hung_of as hung_of
    from lightpaint.pipeline.results.look import result_folders as result_folders
    from lightpaint.pipeline.results.look import verify_result as verify_result
    from lightpaint.pipeline.results.look import view_names as view_names
    from lightpaint.pipeline.results.look import write_predicted as write_predicted
    from lightpaint.pipeline.results.result_folder import LIGHTING as LIGHTING
    from lightpaint.pipeline.results.result_folder import PLANES_FOLDER as PLANES_FOLDER
    from lightpaint.pipeline.results.result_folder import RECORD as RECORD
    from lightpaint.pipeline.results.result_folder import RELIT as RELIT
    from lightpaint.pipeline.results.result_folder import ResultFolder as ResultFolder
    from lightpaint.pipeline.results.result_folder import answer_files as answer_files
    from lightpaint.pipeline.results.result_folder import files_of_planes as files_of_planes
    from lightpaint.pipeline.results.result_folder import is_as_written as is_as_written
    from lightpaint.pipeline.results.result_folder import new_answer as new_answer
    from lightpaint.pipeline.results.result_folder import write_answer as write_answer
    from lightpaint.pipeline.results.result_folder import write_planes as write_planes
    from lightpaint.pipeline.templates import check_sheet as check_sheet
    from lightpaint.pipeline.templates import look_of_basis as look_of_basis
    from lightpaint.pipeline.templates import render_look as render_look
    from lightpaint.pipeline.templates import render_sheet as render_sheet
    from lightpaint.pipeline.templates import render_template as render_template
    from lightpaint.pipeline.templates import template_of_basis as template_of_basis
    from lightpaint.pipeline.wished_planes import PLAN as PLAN
    from lightpaint.pipeline.wished_planes import LightPlan as LightPlan
    from lightpaint.pipeline.wished_planes import MeasuredPlanes as MeasuredPlanes
    from lightpaint.pipeline.wished_planes import check_planes as check_planes
    from lightpaint.pipeline.wished_planes import check_reached as check_reached
    from lightpaint.pipeline.wished_planes import constraints_and_scale as constraints_and_scale
    from lightpaint.pipeline.wished_planes import limited_power as limited_power
    from lightpaint.pipeline.wished_planes import measure_planes as measure_planes
    from lightpaint.pipeline.wished_planes import no_glare_remark as no_glare_remark
    from lightpaint.pipeline.wished_planes import plan_folder as plan_folder
    from lightpaint.pipeline.wished_planes import plan_lighting as plan_lighting
    from lightpaint.pipeline.wished_planes import with_glare as with_glare

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
