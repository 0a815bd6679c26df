"""The pipeline: a job, its run, and its results."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    # fmt: off
    from lightpaint.pipeline.job.job_checks import (
        remarks_of_film, remarks_of_memory, remarks_of_scene, remarks_on_spectra,
    )
    from lightpaint.pipeline.job.job_record import decode_job, encode_job
    from lightpaint.pipeline.job.settings import Settings, SettingsByName
    from lightpaint.pipeline.job.solve_job import Job, PaintedView
    from lightpaint.pipeline.job.sources import (
        BasisFile, GroupsFile, Painting, PlacementFile, SceneFile, check_needed,
        check_nothing_unused, check_spectral, content, lamps_of_scene, observer_of,
        scaled_constraints, spectral_scene, vars_of,
    )
    from lightpaint.pipeline.job_bases import Certainty, needed_counts, obtain
    from lightpaint.pipeline.job_run import run
    from lightpaint.pipeline.look import (
        Look, checked_names, hung_of, result_folders, verify_result, view_names, write_predicted,
    )
    from lightpaint.pipeline.one_call import paint_with_light
    from lightpaint.pipeline.placed_lights import find_places, moved_basis, say_changes
    from lightpaint.pipeline.relit_renders import (
        DENOISED, frames_to_write, relight_frames, relight_look, relit_folder, render_final,
        write_final_exr, write_final_png,
    )
    from lightpaint.pipeline.result_folder import (
        LIGHTING, PLANES_FOLDER, RECORD, RELIT, ResultFolder, answer_files, files_of_planes,
        is_as_written, new_answer, write_answer, write_planes,
    )
    from lightpaint.pipeline.templates import (
        check_sheet, look_of_basis, render_look, render_sheet, render_template, template_of_basis,
    )
    from lightpaint.pipeline.wished_planes import (
        PLAN, LightPlan, MeasuredPlanes, check_planes, check_reached, constraints_and_scale,
        limited_power, measure_planes, no_glare_remark, plan_folder, plan_lighting, with_glare,
    )
    # fmt: on

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
