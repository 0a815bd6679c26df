"""Report pages, pictures, tables and sentences about a result; this room solves nothing."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    from lightpaint.report.answer_pictures import CleanLooks as CleanLooks
    from lightpaint.report.answer_pictures import report_transform as report_transform
    from lightpaint.report.answer_pictures import residual_of as residual_of
    from lightpaint.report.answer_pictures import spoken_view as spoken_view
    from lightpaint.report.answer_pictures import target_picture as target_picture
    from lightpaint.report.basis_memo import make_ahead as make_ahead
    from lightpaint.report.basis_memo import page_reduction as page_reduction
    from lightpaint.report.comparison import comparison_image as comparison_image
    from lightpaint.report.comparison import shorten_to_width as shorten_to_width
    from lightpaint.report.contact_sheet import light_sheet as light_sheet
    from lightpaint.report.diagnosis_sentences import ALONE_ADVICE as ALONE_ADVICE
    from lightpaint.report.diagnosis_sentences import ANY_COLOR as ANY_COLOR
    from lightpaint.report.diagnosis_sentences import NO_ERROR as NO_ERROR
    from lightpaint.report.diagnosis_sentences import bound_sentences as bound_sentences
    from lightpaint.report.diagnosis_sentences import (
        compensation_sentences as compensation_sentences,
    )
    from lightpaint.report.diagnosis_sentences import error_sentences as error_sentences
    from lightpaint.report.diagnosis_sentences import fit_sentence as fit_sentence
    from lightpaint.report.diagnosis_sentences import hold_clause as hold_clause
    from lightpaint.report.diagnosis_sentences import is_one_painting as is_one_painting
    from lightpaint.report.diagnosis_sentences import named_worst_wish as named_worst_wish
    from lightpaint.report.diagnosis_sentences import partly_reached as partly_reached
    from lightpaint.report.diagnosis_sentences import spoken_about as spoken_about
    from lightpaint.report.diagnosis_sentences import spoken_came as spoken_came
    from lightpaint.report.diagnosis_sentences import spoken_cause as spoken_cause
    from lightpaint.report.diagnosis_sentences import spoken_errors as spoken_errors
    from lightpaint.report.diagnosis_sentences import spoken_mean_shares as spoken_mean_shares
    from lightpaint.report.diagnosis_sentences import spoken_newest as spoken_newest
    from lightpaint.report.diagnosis_sentences import spoken_shares as spoken_shares
    from lightpaint.report.diagnosis_sentences import uncertainty_sentence as uncertainty_sentence
    from lightpaint.report.diagnosis_sentences import unreached_channels as unreached_channels
    from lightpaint.report.diagnosis_sentences import untold_lights as untold_lights
    from lightpaint.report.measures import LEAST_SHARE as LEAST_SHARE
    from lightpaint.report.measures import ReportedAnswer as ReportedAnswer
    from lightpaint.report.measures import energy_shares as energy_shares
    from lightpaint.report.measures import picture_errors as picture_errors
    from lightpaint.report.page.figures import data_uri as data_uri
    from lightpaint.report.page.figures import resized as resized
    from lightpaint.report.page.figures import thumbnail as thumbnail
    from lightpaint.report.page.html import html as html
    from lightpaint.report.page.limit_sections import closer_choice as closer_choice
    from lightpaint.report.page.mixer import kelvin_colors as kelvin_colors
    from lightpaint.report.page.mixer import light_data as light_data
    from lightpaint.report.page.mixer import lighting_data as lighting_data
    from lightpaint.report.page.mixer import mixer_assets as mixer_assets
    from lightpaint.report.page.mixer import mixer_html as mixer_html
    from lightpaint.report.page.mixer import packed_gels as packed_gels
    from lightpaint.report.page.mixer import planes_for_page as planes_for_page
    from lightpaint.report.page.mixer import transform_data as transform_data
    from lightpaint.report.page.placement_section import spoken_position as spoken_position
    from lightpaint.report.page.placement_section import spoken_suggestions as spoken_suggestions
    from lightpaint.report.page.placement_section import spoken_turn as spoken_turn
    from lightpaint.report.page.report_page import prepare_page as prepare_page
    from lightpaint.report.page.report_page import report_page as report_page
    from lightpaint.report.phrases import NO_CLOSER_TEXT as NO_CLOSER_TEXT
    from lightpaint.report.phrases import rendering_sentences as rendering_sentences
    from lightpaint.report.phrases import spoken_amount as spoken_amount
    from lightpaint.report.phrases import spoken_changed as spoken_changed
    from lightpaint.report.phrases import spoken_drives as spoken_drives
    from lightpaint.report.phrases import spoken_elsewhere as spoken_elsewhere
    from lightpaint.report.phrases import spoken_lamp as spoken_lamp
    from lightpaint.report.phrases import spoken_part as spoken_part
    from lightpaint.report.phrases import spoken_percent as spoken_percent
    from lightpaint.report.phrases import spoken_place as spoken_place
    from lightpaint.report.phrases import spoken_preference as spoken_preference
    from lightpaint.report.phrases import spoken_progress as spoken_progress
    from lightpaint.report.phrases import spoken_wheels as spoken_wheels
    from lightpaint.report.planes_text import GLARE_HEADINGS as GLARE_HEADINGS
    from lightpaint.report.planes_text import HEADINGS as HEADINGS
    from lightpaint.report.planes_text import glare_by_title as glare_by_title
    from lightpaint.report.planes_text import glare_rows as glare_rows
    from lightpaint.report.planes_text import glare_sentences as glare_sentences
    from lightpaint.report.planes_text import plane_rows as plane_rows
    from lightpaint.report.planes_text import planes_numbers as planes_numbers
    from lightpaint.report.planes_text import planes_sentences as planes_sentences
    from lightpaint.report.report_json import finite as finite
    from lightpaint.report.report_json import report_numbers as report_numbers
    from lightpaint.report.report_json import verification_numbers as verification_numbers
    from lightpaint.report.rig.hung_lights import HungLight as HungLight
    from lightpaint.report.rig.hung_lights import HungLights as HungLights
    from lightpaint.report.rig.hung_lights import LightChange as LightChange
    from lightpaint.report.rig.hung_lights import hung_lights as hung_lights
    from lightpaint.report.rig.hung_lights import spoken_fraction as spoken_fraction
    from lightpaint.report.rig.rig_drawing import rig_drawing as rig_drawing
    from lightpaint.report.verdict_sentences import agreement as agreement
    from lightpaint.report.verdict_sentences import headline as headline
    from lightpaint.report.verdict_sentences import spoken_distance as spoken_distance
    from lightpaint.report.verdict_sentences import spoken_lack as spoken_lack
    from lightpaint.report.verdict_sentences import spoken_missing as spoken_missing
    from lightpaint.report.verdict_sentences import spoken_on_the_whole as spoken_on_the_whole
    from lightpaint.report.verdict_sentences import spoken_reason as spoken_reason
    from lightpaint.report.verdict_sentences import spoken_whole as spoken_whole
    from lightpaint.report.verdict_sentences import verdict as verdict
    from lightpaint.report.visible_emitters import emitter_remarks as emitter_remarks

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
