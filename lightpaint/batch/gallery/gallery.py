"""The gallery: index.html, a self-contained page of all looks, and contact.png, a contact sheet.

It shows the looks of a batch, or those of one `solve` command without a manifest.
"""

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from markupsafe import Markup
from PIL import Image, ImageDraw, ImageFont

from lightpaint.basis.basis import Basis
from lightpaint.batch.gallery.gallery_mixers import (
    drop_planes,
    mixers_html,
    planes_name,
    script_json,
    transforms_of,
    write_planes,
)
from lightpaint.batch.gallery.summary import (
    SummaryRow,
    drop_pictures,
    rows_of,
    summary_csv,
    summary_json,
    view_folders,
)
from lightpaint.batch.manifest.entries import LookEntry
from lightpaint.batch.manifest.file_names import SUMMARY
from lightpaint.batch.plan.journal import JournalLine
from lightpaint.batch.plan.plan import PlaceGroup, Plan, PlannedLook, PlanStep
from lightpaint.batch.work.task import Kind, Task
from lightpaint.display_text import visible
from lightpaint.files import write_bytes, write_text
from lightpaint.images.formats import png_bytes
from lightpaint.pipeline.job.job import Job
from lightpaint.pipeline.job.sources import BasisFile, GroupsFile, SceneFile
from lightpaint.pipeline.results.placement_changes import hung_of
from lightpaint.placement import PlacementRecord
from lightpaint.report.comparison import shorten_to_width
from lightpaint.report.page.html import html
from lightpaint.report.rig.hung_lights import LightChange
from lightpaint.version import __version__
from lightpaint.viewer.bundle import bundled, styles

#: Style sheets of the page.
STYLES = ("batch/gallery/gallery.css", "viewer/mixer/wipe.css", "viewer/mixer/mixer.css")

#: Contact sheet: most pictures, pictures in a row, width of each, gap and height of a caption.
MAX_PICTURES, COLUMNS, WIDTH, GAP, CAPTION_HEIGHT = 120, 6, 240, 14, 22

#: Colours of the sheet: background, text, faint text, warnings.
GROUND, TEXT, FAINT, WARNING = (24, 24, 26), (226, 226, 226), (142, 142, 146), (255, 140, 120)


@dataclass(frozen=True)
class GroupPlaces:
    """The moved lights of a group of looks, for the page. picture: data: URI; "" without one."""

    sentence: str
    changes: Sequence[LightChange]
    picture: str


def write_gallery(
    folder: Path, plan: Plan, lines: Mapping[tuple[str, Kind], JournalLine]
) -> list[SummaryRow]:
    """Write index.html, contact.png, summary.csv and summary.json of the results so far.

    Returns the rows, failures first.
    """
    rows = rows_of(plan, lines)
    rows.sort(key=lambda row: ("failed", "waiting", "done").index(row.state))
    drop_pictures(folder, rows)
    bases = bases_of_rows(folder, plan)
    drop_planes(folder, set(bases.values()))
    write_text(folder / SUMMARY, summary_json(rows))
    write_text(folder / "summary.csv", summary_csv(rows))
    write_text(folder / "index.html", _page(folder, plan, rows, bases))
    write_bytes(folder / "contact.png", png_bytes(contact_sheet(folder, rows)))
    return rows


def bases_of_rows(folder: Path, plan: Plan) -> dict[str, str]:
    """Return the name of the planes for each picture's mixer, by the picture's folder."""
    return {
        place.relative_to(plan.folder).as_posix(): planes_name(folder, key)
        for look in plan.looks
        for place, key in zip(view_folders(look), look.steps[0].task.bases, strict=False)
    }


def _page(folder: Path, plan: Plan, rows: Sequence[SummaryRow], bases: Mapping[str, str]) -> str:
    return gallery_page(folder, plan.manifest.name, rows, bases, places=places_of(plan))


def gallery_page(
    folder: Path,
    title: str,
    rows: Sequence[SummaryRow],
    bases: Mapping[str, str] | None = None,
    *,
    places: Sequence[GroupPlaces] = (),
) -> str:
    """Return the page as HTML text.

    folder: of the small pictures and planes. bases: planes of each row, by its folder. places: the
    lights that hang at the same places in several looks.
    """
    finished_rows = [row for row in rows if row.state == "done"]
    mixers = mixers_html(folder, finished_rows, bases or {})
    records = []
    for row in rows:
        record = {k: v for k, v in asdict(row).items() if v not in (None, "", ())}
        record["links"] = [[Path(x).name, quote(x)] for x in row.files]
        record.pop("files", None)
        if row.picture:
            data = base64.b64encode((folder / row.picture).read_bytes()).decode("ascii")
            record["picture"] = f"data:image/jpeg;base64,{data}"
        if (bases or {}).get(row.folder) in mixers:
            record["basis"] = (bases or {})[row.folder]
        records.append(record)
    page = html(
        "batch/gallery/gallery",
        title=visible(title),
        about=counts_text(rows),
        has_failed=any(row.state == "failed" for row in rows),
        looks=Markup(script_json(records)),
        transforms=Markup(script_json(transforms_of(finished_rows) if mixers else {})),
        mixers=list(mixers.values()),
        places=places,
        style=Markup(styles(*STYLES)),
        script=Markup(bundled("batch/gallery/gallery.js")),
        version=__version__,
    )
    return str(page)


def places_of(plan: Plan) -> list[GroupPlaces]:
    """Return the moved lights of each group of looks.

    Looks that are placed alone are in their own reports instead.
    """
    placed_groups = [(group, group.read_record()) for group in plan.groups if len(group.tasks) > 1]
    return [_group_places(group, record) for group, record in placed_groups if record is not None]


def _group_places(group: PlaceGroup, record: PlacementRecord) -> GroupPlaces:
    placement, picture = hung_of(record, None), ""
    if group.picture.is_file():
        data = base64.b64encode(group.picture.read_bytes()).decode("ascii")
        picture = f"data:image/png;base64,{data}"
    return GroupPlaces(placement.shared_sentence, placement.changes, picture)


def counts_text(rows: Sequence[SummaryRow]) -> str:
    """Return `12 looks: 1 failed, 2 not done yet`."""
    counts = {state: sum(row.state == state for row in rows) for state in ("failed", "waiting")}
    parts = [f"{counts['failed']} failed"] * bool(counts["failed"])
    parts += [f"{counts['waiting']} not done yet"] * bool(counts["waiting"])
    looks = f"{len(rows)} look{'s' * (len(rows) != 1)}"
    return f"{looks}: {', '.join(parts) or 'all done'}"


def contact_sheet(folder: Path, rows: list[SummaryRow]) -> Any:
    """Return small pictures side by side with their names, (H, W, 3) uint8.
    Only the first MAX_PICTURES are drawn.
    """
    rows_with_pictures = rows[:MAX_PICTURES]
    columns = max(1, min(COLUMNS, len(rows_with_pictures)))
    height = max(
        [round(WIDTH * row.size[1] / row.size[0]) for row in rows_with_pictures], default=WIDTH
    )
    height = min(height, 2 * WIDTH)
    count = -(-len(rows_with_pictures) // columns)
    size = (
        columns * (WIDTH + GAP) + GAP,
        count * (height + CAPTION_HEIGHT + GAP) + 2 * GAP + CAPTION_HEIGHT,
    )
    sheet = Image.new("RGB", size, GROUND)
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(14)
    title = counts_text(rows)
    if len(rows) > MAX_PICTURES:
        title += f"; the first {MAX_PICTURES} are shown"
    draw.text((GAP, GAP), shorten_to_width(title, font, size[0] - 2 * GAP), FAINT, font)
    for k, row in enumerate(rows_with_pictures):
        x = GAP + k % columns * (WIDTH + GAP)
        y = 2 * GAP + CAPTION_HEIGHT + k // columns * (height + CAPTION_HEIGHT + GAP)
        _draw(sheet, folder, row, (x, y, WIDTH, height), font)
    return np.asarray(sheet)


def _draw(
    sheet: Image.Image, folder: Path, row: SummaryRow, box: tuple[int, int, int, int], font: Any
) -> None:
    """Draw one look in its box (x, y, width, height), with its name and miss below."""
    (x, y, width, height), draw = box, ImageDraw.Draw(sheet)
    if row.picture:
        with Image.open(folder / row.picture) as image:
            scale = min(width / image.width, height / image.height)
            size = max(1, round(scale * image.width)), max(1, round(scale * image.height))
            filter_ = Image.Resampling.NEAREST if scale > 2 else Image.Resampling.LANCZOS
            thumbnail = image.resize(size, filter_)
        sheet.paste(thumbnail, (x + (width - size[0]) // 2, y + (height - size[1]) // 2))
    else:
        draw.rectangle((x, y, x + width - 1, y + height - 1), outline=FAINT)
        text = {"failed": "failed", "waiting": "not done yet"}.get(row.state, "no picture")
        color = WARNING if row.state == "failed" else FAINT
        draw.text((x + width // 2, y + height // 2), text, color, font, anchor="mm")
    text = "" if row.delta_e is None else f"dE {row.delta_e:.1f}"
    baseline = y + height + round(0.75 * CAPTION_HEIGHT)
    draw.text((x + width, baseline), text, FAINT, font, anchor="rs")
    room = width - round(font.getlength(text)) - 8
    name = row.look if row.folder == row.look else f"{row.look} {row.sensor}"
    draw.text((x, baseline), shorten_to_width(visible(name), font, room), TEXT, font, anchor="ls")


def entry_of(job: Job, folder: Path | None = None, variation: str = "") -> LookEntry:
    """Return a gallery's entry for a look.

    `job` solved the look or, if `folder` is given, the look was derived from the job's answer.
    variation: its word.
    """
    scenes = tuple(scene for scene in job.scenes if isinstance(scene, SceneFile))
    basis = job.basis if isinstance(job.basis, BasisFile | GroupsFile) else None
    return LookEntry(
        (folder or job.folder).name,
        "",
        scenes,
        basis,
        by_sensor=job.by_sensor,
        variation=variation,
        combined_looks=() if folder is None else (job.folder.name,),
    )


def write_solve_gallery(
    folder: Path, entries: Sequence[LookEntry], failures: Mapping[str, str], bases: Sequence[Basis]
) -> list[SummaryRow]:
    """Write the gallery of the looks in `folder`, by the names of their folders there.

    failures: reasons by name. bases: one for each view, shared by all looks.
    """
    looks, lines = [], {}
    keys = tuple(json.dumps({"view": k}) for k in range(len(bases)))
    for key, basis in zip(keys, bases, strict=True):
        write_planes(folder, key, basis)
    for entry in entries:
        name = entry.name
        fingerprint = "" if name in failures else _content_hash(folder / name / "lighting.json")
        step = PlanStep(Task(name, "answer", "", bases=keys), fingerprint, True)
        looks.append(PlannedLook(entry, folder / name, (step,)))
        line_key: tuple[str, Kind] = (name, "answer")
        state = "failed" if name in failures else "done"
        lines[line_key] = JournalLine(name, "answer", state, fingerprint, failures.get(name, ""))  # type: ignore[arg-type]
    names = frozenset(entry.name for entry in entries)
    plan = Plan(Path(folder.resolve().name), folder, tuple(looks), {}, names)
    return write_gallery(folder, plan, lines)


def _content_hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
