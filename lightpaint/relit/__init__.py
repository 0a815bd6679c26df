"""The relit scene: its XML, and an independent render that verifies it."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    # fmt: off
    from lightpaint.relit.emission_xml import plugin_remark
    from lightpaint.relit.export.exports import EXPORTS, plain_cell, relit_part, write_exports
    from lightpaint.relit.export.nuke import spoken_unreadable
    from lightpaint.relit.export.rig_files import (
        Cue, LevelRow, cue_list_csv, level_csv, level_document, level_json, level_rows,
    )
    from lightpaint.relit.export.usd import check_usd
    from lightpaint.relit.exported_answer import Source
    from lightpaint.relit.formats import FORMS, names_of_forms, write_content, writers_of
    from lightpaint.relit.relit_scene import (
        check_relightable, relight, scene_of, settle, solved_identity,
    )
    from lightpaint.relit.verification import (
        ERROR, LIMIT, LightShares, Verification, limit_of_tests, with_light_tests,
    )
    from lightpaint.relit.verification_render import (
        SPECTRAL_DOUBLINGS, VerificationBudget, refine_by_rendering, verification_budget, verify,
        verify_in_stages,
    )
    # fmt: on

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
