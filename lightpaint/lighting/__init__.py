"""The room of lightings: `Basis` and `Target` become a `Solution`."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    # fmt: off
    from lightpaint.lighting.algebra import Method
    from lightpaint.lighting.algebra.optimum import minimise
    from lightpaint.lighting.analysis.answer_analysis import Analysis, analyse, with_findings
    from lightpaint.lighting.analysis.appearance.answer_appearance import (
        CLOSE, INVISIBLE, Appearance, compare_appearance, with_undetermined,
    )
    from lightpaint.lighting.analysis.appearance.color_choices import (
        Choices, ColorChoice, can_change_colors,
    )
    from lightpaint.lighting.analysis.appearance.delivery import (
        Delivery, main_deliveries, mean_shares, measure_deliveries, merge_views, newest_delivery,
        spoken_share, worst_delivery,
    )
    from lightpaint.lighting.analysis.appearance.display_difference import (
        NOTICED, PaintComparison, UnpaintedChange, change_from_scene, unpainted_change,
    )
    from lightpaint.lighting.analysis.appearance.held_answer import hold_to_current
    from lightpaint.lighting.analysis.appearance.limiting_reasons import Loosening, Reason
    from lightpaint.lighting.analysis.appearance.pixel_sample import LimitGroup
    from lightpaint.lighting.analysis.diagnosis import Diagnosis, Place, diagnose, error_shares
    from lightpaint.lighting.analysis.noise.basis_noise import denoised_matrix
    from lightpaint.lighting.analysis.noise.noise_correction import correct_noise, refine
    from lightpaint.lighting.analysis.noise.noise_of_sums import covariance_of_sums
    from lightpaint.lighting.analysis.noise.rendered_painting import answer_to_render
    from lightpaint.lighting.analysis.noise.sample_demand import (
        pixel_variances, sample_demand, top_up_counts,
    )
    from lightpaint.lighting.analysis.noise.uncertainty import Uncertainty, error_bars
    from lightpaint.lighting.analysis.rendered_colors import (
        LightRendering, SurfaceColor, renderings_of, surface_colors,
    )
    from lightpaint.lighting.answer.certificate import Bound, Certificate, Software, version
    from lightpaint.lighting.answer.combination import combine, dimmed
    from lightpaint.lighting.answer.lighting import (
        ALL_REACHED, Lighting, LightSetting, color_of_emitter, in_own_color,
    )
    from lightpaint.lighting.answer.lighting_file import (
        lighting_fields, read_lighting, write_lighting,
    )
    from lightpaint.lighting.answer.lighting_keys import LightingKey, key_slopes
    from lightpaint.lighting.constraints.absolute_scale import (
        Scale, agreed_scale, unscaled_error, with_scale, with_sure_scale,
    )
    from lightpaint.lighting.constraints.constraint_table import (
        LAMP_KEYS, LIGHT_KEYS, Constraints, LightConstraint, Requirements, is_pattern,
    )
    from lightpaint.lighting.constraints.constraints_file import constraints_of, read_constraints
    from lightpaint.lighting.constraints.light_constraints import (
        KEYS_BY_KIND, start_weights, tables_by_light, tied_lights,
    )
    from lightpaint.lighting.constraints.values import check_keys
    from lightpaint.lighting.default_solve import answer_as_multiplied, default_answer, solve
    from lightpaint.lighting.fit import (
        DEFAULT_HOLD, Colors, Emitters, Fit, Space, resolve_fit, resolve_for_targets,
    )
    from lightpaint.lighting.joined_views import check_same_lights, joint_estimate
    from lightpaint.lighting.light_wishes import (
        LitCase, WishedLight, check_powers, watts_allowed, wished_light,
    )
    from lightpaint.lighting.linear_problem import (
        Sums, reason_against_sums, reduce_lights, sum_rows, summed_problem,
    )
    from lightpaint.lighting.linear_solve import solve_squares
    from lightpaint.lighting.live.live_solver import LiveSolver
    from lightpaint.lighting.live.live_view import LiveView
    from lightpaint.lighting.loss.painting import ignored_paint, resolve_importance
    from lightpaint.lighting.normal_equations import NormalEquations
    from lightpaint.lighting.problem import Problem
    from lightpaint.lighting.solution import Solution
    from lightpaint.lighting.solver import choose_mixes, solution_of, tie_frames
    from lightpaint.lighting.unknowns.full_lamps import FullLamp, full_lamps
    from lightpaint.lighting.unknowns.lamp_parts import WholeLamps
    from lightpaint.lighting.unknowns.reduced_problem import reduced_problems
    from lightpaint.lighting.unknowns.reduction import Reduction, lamps_by_name, reduce_to
    from lightpaint.lighting.wish_outcomes import PlanesAnswer, WishOutcome, planes_answer
    from lightpaint.lighting.wish_problems import (
        RequiredProblem, least_watts, requirements_within_reach, with_wishes, without_wishes,
    )
    # fmt: on

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
