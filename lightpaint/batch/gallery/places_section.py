"""The section of the gallery on lights that hang at the same places in several looks."""

import base64
from html import escape

from lightpaint.batch.plan.place_groups import PlaceGroup
from lightpaint.batch.plan.plan import Plan
from lightpaint.pipeline.results.placement_changes import hung_of
from lightpaint.placement.placement_record import PlacementRecord


def places_section(plan: Plan) -> str:
    """Return the section on moved lights: for each group of looks a table, a plan and an elevation.

    Looks that are placed alone are in their own reports instead.
    """
    placed_groups = [(group, group.read_record()) for group in plan.groups if len(group.tasks) > 1]
    parts = "".join(
        _group_html(group, record) for group, record in placed_groups if record is not None
    )
    return f'<section class="places"><h2>Where the lights hang</h2>{parts}</section>' * bool(parts)


def _group_html(group: PlaceGroup, record: PlacementRecord) -> str:
    placement = hung_of(record, None)
    items = "".join(f"<li>{escape(change.text)}</li>" for change in placement.changes)
    picture = ""
    if group.picture.is_file():
        data = base64.b64encode(group.picture.read_bytes()).decode("ascii")
        picture = (
            '<img alt="Plan and elevation of the room with its lights." '
            f'src="data:image/png;base64,{data}">'
        )
    return f"<p>{escape(placement.shared_sentence)}</p><ul>{items}</ul>{picture}"
