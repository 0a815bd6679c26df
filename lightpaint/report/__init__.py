"""Report pages, pictures, tables and sentences about a result; this room solves nothing."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    # fmt: off
    from lightpaint.report.answer_pictures import (
        CleanLooks, report_transform, residual_of, spoken_view, target_picture,
    )
    from lightpaint.report.basis_memo import look_reduction, make_ahead, page_reduction
    from lightpaint.report.comparison import comparison_image, shorten_to_width
    from lightpaint.report.contact_sheet import light_sheet
    from lightpaint.report.diagnosis_sentences import (
        ALONE_ADVICE, ANY_COLOR, NO_ERROR, bound_sentences, compensation_sentences, error_sentences,
        fit_sentence, is_one_painting, named_worst_wish, partly_reached, reach_clause, spoken_about,
        spoken_came, spoken_cause, spoken_errors, spoken_mean_shares, spoken_newest, spoken_shares,
        uncertainty_sentence, unreached_channels, untold_lights,
    )
    from lightpaint.report.hung_light import (
        HungLight, HungLights, LightChange, hung_lights, spoken_fraction,
    )
    from lightpaint.report.measures import (
        LEAST_SHARE, ReportedAnswer, energy_shares, picture_errors,
    )
    from lightpaint.report.page.figures import data_uri, resized, thumbnail
    from lightpaint.report.page.html import html, script_json
    from lightpaint.report.page.limit_sections import closer_choice
    from lightpaint.report.page.mixer import (
        kelvin_colors, light_data, lighting_data, mixer_assets, mixer_html,
        mixes_of_mixer, packed_gels, planes_for_page, transform_data,
    )
    from lightpaint.report.page.placement_section import (
        spoken_position, spoken_suggestions, spoken_turn,
    )
    from lightpaint.report.page.report_page import prepare_page, report_page
    from lightpaint.report.phrases import (
        NO_CLOSER_TEXT, rendering_sentences, spoken_amount, spoken_changed, spoken_drives,
        spoken_elsewhere, spoken_lamp, spoken_part, spoken_percent, spoken_place, spoken_preference,
        spoken_progress, spoken_wheels,
    )
    from lightpaint.report.planes_text import (
        GLARE_HEADINGS, HEADINGS, glare_by_title, glare_rows, glare_sentences, plane_rows,
        planes_numbers, planes_sentences,
    )
    from lightpaint.report.report_json import finite, report_numbers, verification_numbers
    from lightpaint.report.rig_plan import rig_drawing
    from lightpaint.report.verdict_sentences import (
        agreement, headline, spoken_distance, spoken_lack, spoken_missing, spoken_on_the_whole,
        spoken_reason, spoken_whole, verdict,
    )
    from lightpaint.report.visible_emitters import answer_remarks, emitter_remarks
    # fmt: on

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
