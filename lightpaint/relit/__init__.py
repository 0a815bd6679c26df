"""The relit scene: its XML, and an independent render that verifies it."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    from lightpaint.relit.emission_xml import plugin_remark as plugin_remark
    from lightpaint.relit.export.exports import EXPORTS as EXPORTS
    from lightpaint.relit.export.exports import plain_cell as plain_cell
    from lightpaint.relit.export.exports import relit_part as relit_part
    from lightpaint.relit.export.exports import write_exports as write_exports
    from lightpaint.relit.export.nuke import spoken_unreadable as spoken_unreadable
    from lightpaint.relit.export.rig_files import Cue as Cue
    from lightpaint.relit.export.rig_files import LevelRow as LevelRow
    from lightpaint.relit.export.rig_files import cue_list_csv as cue_list_csv
    from lightpaint.relit.export.rig_files import level_csv as level_csv
    from lightpaint.relit.export.rig_files import level_document as level_document
    from lightpaint.relit.export.rig_files import level_json as level_json
    from lightpaint.relit.export.rig_files import level_rows as level_rows
    from lightpaint.relit.export.usd import check_usd as check_usd
    from lightpaint.relit.exported_answer import Source as Source
    from lightpaint.relit.formats import FORMS as FORMS
    from lightpaint.relit.formats import names_of_forms as names_of_forms
    from lightpaint.relit.formats import write_content as write_content
    from lightpaint.relit.formats import writers_of as writers_of
    from lightpaint.relit.relit_scene import check_relightable as check_relightable
    from lightpaint.relit.relit_scene import relight as relight
    from lightpaint.relit.relit_scene import scene_of as scene_of
    from lightpaint.relit.relit_scene import settle as settle
    from lightpaint.relit.relit_scene import solved_identity as solved_identity
    from lightpaint.relit.verification import ERROR as ERROR
    from lightpaint.relit.verification import LIMIT as LIMIT
    from lightpaint.relit.verification import LightShares as LightShares
    from lightpaint.relit.verification import Verification as Verification
    from lightpaint.relit.verification import limit_of_tests as limit_of_tests
    from lightpaint.relit.verification import with_light_tests as with_light_tests
    from lightpaint.relit.verification_render import SPECTRAL_DOUBLINGS as SPECTRAL_DOUBLINGS
    from lightpaint.relit.verification_render import VerificationBudget as VerificationBudget
    from lightpaint.relit.verification_render import refine_by_rendering as refine_by_rendering
    from lightpaint.relit.verification_render import verification_budget as verification_budget
    from lightpaint.relit.verification_render import verify as verify
    from lightpaint.relit.verification_render import verify_in_stages as verify_in_stages

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
