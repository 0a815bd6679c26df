"""The room of lightings: `Basis` and `Target` become a `Solution`."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    from lightpaint.lighting.algebra.method import Method as Method
    from lightpaint.lighting.algebra.optimum import minimise as minimise
    from lightpaint.lighting.analysis.answer_analysis import Analysis as Analysis
    from lightpaint.lighting.analysis.answer_analysis import analyse as analyse
    from lightpaint.lighting.analysis.answer_analysis import with_findings as with_findings
    from lightpaint.lighting.analysis.appearance.answer_appearance import CLOSE as CLOSE
    from lightpaint.lighting.analysis.appearance.answer_appearance import INVISIBLE as INVISIBLE
    from lightpaint.lighting.analysis.appearance.answer_appearance import Appearance as Appearance
    from lightpaint.lighting.analysis.appearance.answer_appearance import (
        compare_appearance as compare_appearance,
    )
    from lightpaint.lighting.analysis.appearance.answer_appearance import (
        with_undetermined as with_undetermined,
    )
    from lightpaint.lighting.analysis.appearance.color_choices import Choices as Choices
    from lightpaint.lighting.analysis.appearance.color_choices import ColorChoice as ColorChoice
    from lightpaint.lighting.analysis.appearance.color_choices import (
        can_change_colors as can_change_colors,
    )
    from lightpaint.lighting.analysis.appearance.delivery import Delivery as Delivery
    from lightpaint.lighting.analysis.appearance.delivery import main_deliveries as main_deliveries
    from lightpaint.lighting.analysis.appearance.delivery import mean_shares as mean_shares
    from lightpaint.lighting.analysis.appearance.delivery import (
        measure_deliveries as measure_deliveries,
    )
    from lightpaint.lighting.analysis.appearance.delivery import merge_views as merge_views
    from lightpaint.lighting.analysis.appearance.delivery import newest_delivery as newest_delivery
    from lightpaint.lighting.analysis.appearance.delivery import spoken_share as spoken_share
    from lightpaint.lighting.analysis.appearance.delivery import worst_delivery as worst_delivery
    from lightpaint.lighting.analysis.appearance.display_difference import NOTICED as NOTICED
    from lightpaint.lighting.analysis.appearance.display_difference import (
        PaintComparison as PaintComparison,
    )
    from lightpaint.lighting.analysis.appearance.display_difference import (
        UnpaintedChange as UnpaintedChange,
    )
    from lightpaint.lighting.analysis.appearance.display_difference import (
        change_from_scene as change_from_scene,
    )
    from lightpaint.lighting.analysis.appearance.display_difference import (
        unpainted_change as unpainted_change,
    )
    from lightpaint.lighting.analysis.appearance.held_answer import (
        hold_to_current as hold_to_current,
    )
    from lightpaint.lighting.analysis.appearance.limiting_reasons import Loosening as Loosening
    from lightpaint.lighting.analysis.appearance.limiting_reasons import Reason as Reason
    from lightpaint.lighting.analysis.appearance.pixel_sample import LimitGroup as LimitGroup
    from lightpaint.lighting.analysis.diagnosis import Diagnosis as Diagnosis
    from lightpaint.lighting.analysis.diagnosis import Place as Place
    from lightpaint.lighting.analysis.diagnosis import diagnose as diagnose
    from lightpaint.lighting.analysis.diagnosis import error_shares as error_shares
    from lightpaint.lighting.analysis.noise.basis_noise import denoised_matrix as denoised_matrix
    from lightpaint.lighting.analysis.noise.noise_correction import correct_noise as correct_noise
    from lightpaint.lighting.analysis.noise.noise_correction import refine as refine
    from lightpaint.lighting.analysis.noise.sample_demand import pixel_variances as pixel_variances
    from lightpaint.lighting.analysis.noise.sample_demand import sample_demand as sample_demand
    from lightpaint.lighting.analysis.noise.sample_demand import top_up_counts as top_up_counts
    from lightpaint.lighting.analysis.noise.uncertainty import Uncertainty as Uncertainty
    from lightpaint.lighting.analysis.noise.uncertainty import error_bars as error_bars
    from lightpaint.lighting.analysis.rendered_colors import LightRendering as LightRendering
    from lightpaint.lighting.analysis.rendered_colors import SurfaceColor as SurfaceColor
    from lightpaint.lighting.analysis.rendered_colors import renderings_of as renderings_of
    from lightpaint.lighting.analysis.rendered_colors import surface_colors as surface_colors
    from lightpaint.lighting.answer.certificate import Bound as Bound
    from lightpaint.lighting.answer.certificate import Certificate as Certificate
    from lightpaint.lighting.answer.certificate import Software as Software
    from lightpaint.lighting.answer.certificate import version as version
    from lightpaint.lighting.answer.combination import combine as combine
    from lightpaint.lighting.answer.combination import dimmed as dimmed
    from lightpaint.lighting.answer.lighting import ALL_REACHED as ALL_REACHED
    from lightpaint.lighting.answer.lighting import Lighting as Lighting
    from lightpaint.lighting.answer.lighting import LightSetting as LightSetting
    from lightpaint.lighting.answer.lighting import color_of_emitter as color_of_emitter
    from lightpaint.lighting.answer.lighting import in_own_color as in_own_color
    from lightpaint.lighting.answer.lighting_file import lighting_fields as lighting_fields
    from lightpaint.lighting.answer.lighting_file import read_lighting as read_lighting
    from lightpaint.lighting.answer.lighting_file import write_lighting as write_lighting
    from lightpaint.lighting.answer.lighting_keys import LightingKey as LightingKey
    from lightpaint.lighting.answer.lighting_keys import key_slopes as key_slopes
    from lightpaint.lighting.constraints.absolute_scale import Scale as Scale
    from lightpaint.lighting.constraints.absolute_scale import agreed_scale as agreed_scale
    from lightpaint.lighting.constraints.absolute_scale import unscaled_error as unscaled_error
    from lightpaint.lighting.constraints.absolute_scale import with_scale as with_scale
    from lightpaint.lighting.constraints.absolute_scale import with_sure_scale as with_sure_scale
    from lightpaint.lighting.constraints.constraint_table import LAMP_KEYS as LAMP_KEYS
    from lightpaint.lighting.constraints.constraint_table import LIGHT_KEYS as LIGHT_KEYS
    from lightpaint.lighting.constraints.constraint_table import Constraints as Constraints
    from lightpaint.lighting.constraints.constraint_table import LightConstraint as LightConstraint
    from lightpaint.lighting.constraints.constraint_table import Requirements as Requirements
    from lightpaint.lighting.constraints.constraint_table import is_pattern as is_pattern
    from lightpaint.lighting.constraints.constraints_file import constraints_of as constraints_of
    from lightpaint.lighting.constraints.constraints_file import (
        read_constraints as read_constraints,
    )
    from lightpaint.lighting.constraints.light_constraints import (
        KEYS_BY_KIND as KEYS_BY_KIND,
    )
    from lightpaint.lighting.constraints.light_constraints import start_weights as start_weights
    from lightpaint.lighting.constraints.light_constraints import tables_by_light as tables_by_light
    from lightpaint.lighting.constraints.light_constraints import tied_lights as tied_lights
    from lightpaint.lighting.constraints.values import check_keys as check_keys
    from lightpaint.lighting.fit import DEFAULT_HOLD as DEFAULT_HOLD
    from lightpaint.lighting.fit import Colors as Colors
    from lightpaint.lighting.fit import Emitters as Emitters
    from lightpaint.lighting.fit import Fit as Fit
    from lightpaint.lighting.fit import Space as Space
    from lightpaint.lighting.fit import resolve_fit as resolve_fit
    from lightpaint.lighting.fit import resolve_for_targets as resolve_for_targets
    from lightpaint.lighting.joined_views import check_same_lights as check_same_lights
    from lightpaint.lighting.joined_views import joint_estimate as joint_estimate
    from lightpaint.lighting.linear_problem import Sums as Sums
    from lightpaint.lighting.linear_problem import reason_against_sums as reason_against_sums
    from lightpaint.lighting.linear_problem import reduce_lights as reduce_lights
    from lightpaint.lighting.linear_problem import sum_rows as sum_rows
    from lightpaint.lighting.linear_problem import summed_problem as summed_problem
    from lightpaint.lighting.linear_solve import solve_squares as solve_squares
    from lightpaint.lighting.live.live_solver import LiveSolver as LiveSolver
    from lightpaint.lighting.live.live_view import LiveView as LiveView
    from lightpaint.lighting.loss.painting import ignored_paint as ignored_paint
    from lightpaint.lighting.loss.painting import resolve_importance as resolve_importance
    from lightpaint.lighting.normal_equations import NormalEquations as NormalEquations
    from lightpaint.lighting.problem import Problem as Problem
    from lightpaint.lighting.solution import Solution as Solution
    from lightpaint.lighting.solver import choose_mixes as choose_mixes
    from lightpaint.lighting.solver import solution_of as solution_of
    from lightpaint.lighting.solver import solve as solve
    from lightpaint.lighting.solver import solve_frames as solve_frames
    from lightpaint.lighting.unknowns.full_lamps import FullLamp as FullLamp
    from lightpaint.lighting.unknowns.full_lamps import full_lamps as full_lamps
    from lightpaint.lighting.unknowns.lamp_parts import WholeLamps as WholeLamps
    from lightpaint.lighting.unknowns.reduced_problem import reduced_problems as reduced_problems
    from lightpaint.lighting.unknowns.reduction import Reduction as Reduction
    from lightpaint.lighting.unknowns.reduction import lamps_by_name as lamps_by_name
    from lightpaint.lighting.unknowns.reduction import reduce_to as reduce_to
    from lightpaint.lighting.wishes.planes_answer import PlanesAnswer as PlanesAnswer
    from lightpaint.lighting.wishes.planes_answer import WishOutcome as WishOutcome
    from lightpaint.lighting.wishes.planes_answer import planes_answer as planes_answer
    from lightpaint.lighting.wishes.wish_problems import RequiredProblem as RequiredProblem
    from lightpaint.lighting.wishes.wish_problems import least_watts as least_watts
    from lightpaint.lighting.wishes.wish_problems import (
        requirements_within_reach as requirements_within_reach,
    )
    from lightpaint.lighting.wishes.wish_problems import with_wishes as with_wishes
    from lightpaint.lighting.wishes.wish_problems import without_wishes as without_wishes
    from lightpaint.lighting.wishes.wished_light import LitCase as LitCase
    from lightpaint.lighting.wishes.wished_light import WishedLight as WishedLight
    from lightpaint.lighting.wishes.wished_light import check_powers as check_powers
    from lightpaint.lighting.wishes.wished_light import watts_allowed as watts_allowed
    from lightpaint.lighting.wishes.wished_light import wished_light as wished_light

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
