"""The gallery: index.html, a self-contained page of all looks, and contact.png, a contact sheet.

It shows the looks of a batch, or the looks of one `solve` command without a manifest.

A mixer uses small planes of its basis, which are kept beside the looks and shared by all of them,
so that it works when the basis is gone.
"""

import base64
import hashlib
import json
import os
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from markupsafe import Markup
from PIL import Image, ImageDraw, ImageFont

from lightpaint import report
from lightpaint.basis import Basis, LightGroups, light_images
from lightpaint.batch.gallery import summary
from lightpaint.batch.manifest.entries import LookEntry
from lightpaint.batch.manifest.file_names import SUMMARY, THUMBNAILS
from lightpaint.batch.plan.journal import JournalLine
from lightpaint.batch.plan.plan_steps import PlaceGroup, Plan, PlannedLook, PlanStep
from lightpaint.batch.work.item_execution import job_fields
from lightpaint.batch.work.work_items import Kind, Task
from lightpaint.batch.work.worker_storage import WorkerCache
from lightpaint.colour import ViewTransform
from lightpaint.display_text import visible
from lightpaint.errors import LightpaintError
from lightpaint.files import read_text, write_bytes, write_text
from lightpaint.images.formats import png_bytes
from lightpaint.lighting import read_lighting
from lightpaint.pipeline import BasisFile, GroupsFile, Job, SceneFile, content, hung_of
from lightpaint.placement import PlacementRecord
from lightpaint.storage.json_records import strict_json
from lightpaint.version import __version__
from lightpaint.viewer import bundled, styles

#: Style sheets of the page.
STYLES = ("batch/gallery/gallery.css", "viewer/mixer/wipe.css", "viewer/mixer/mixer.css")

#: Contact sheet: most pictures, pictures in a row, width of each, gap and height of a caption.
MAX_PICTURES, COLUMNS, WIDTH, GAP, CAPTION_HEIGHT = 120, 6, 240, 14, 22

#: Colours of the sheet: background, text, faint text, warnings.
GROUND, TEXT, FAINT, WARNING = (24, 24, 26), (226, 226, 226), (142, 142, 146), (255, 140, 120)

#: Maximum number of mixers of a page (each may take two megabytes), and most lights of a mixer with
#: sliders.
MAX_MIXERS, MAX_LIGHTS = 8, 40

#: Suffix of the names of files of small planes.
SUFFIX = ".planes.json"

#: Number of their format, which changes with its fields.
FORMAT = 2

#: Longest of them that is read, in bytes.
MAX_BYTES = 2**27


@dataclass(frozen=True)
class GroupPlaces:
    """The moved lights of a group of looks, for the page. picture: data: URI; "" without one."""

    sentence: str
    changes: Sequence[report.LightChange]
    picture: str


def write_gallery(
    folder: Path, plan: Plan, lines: Mapping[tuple[str, Kind], JournalLine]
) -> list[summary.SummaryRow]:
    """Write index.html, contact.png, summary.csv and summary.json of the results so far.

    Returns the rows, failures first.
    """
    rows = summary.rows_of(plan, lines)
    rows.sort(key=lambda row: ("failed", "waiting", "done").index(row.state))
    summary.drop_pictures(folder, rows)
    bases = bases_of_rows(folder, plan)
    drop_planes(folder, set(bases.values()))
    write_text(folder / SUMMARY, summary.summary_json(rows))
    write_text(folder / "summary.csv", summary.summary_csv(rows))
    write_text(folder / "index.html", _page(folder, plan, rows, bases))
    write_bytes(folder / "contact.png", png_bytes(contact_sheet(folder, rows)))
    return rows


def bases_of_rows(folder: Path, plan: Plan) -> dict[str, str]:
    """Return the name of the planes for each picture's mixer, by the picture's folder."""
    return {
        place.relative_to(plan.folder).as_posix(): planes_name(folder, key)
        for look in plan.looks
        for place, key in zip(summary.view_folders(look), look.steps[0].task.bases, strict=False)
    }


def _page(
    folder: Path, plan: Plan, rows: Sequence[summary.SummaryRow], bases: Mapping[str, str]
) -> str:
    return gallery_page(folder, plan.manifest.name, rows, bases, places=places_of(plan))


def gallery_page(
    folder: Path,
    title: str,
    rows: Sequence[summary.SummaryRow],
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
    page = report.html(
        "batch/gallery/gallery",
        title=visible(title),
        about=counts_text(rows),
        has_failed=any(row.state == "failed" for row in rows),
        looks=report.script_json(records),
        transforms=report.script_json(transforms_of(finished_rows) if mixers else {}),
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


def counts_text(rows: Sequence[summary.SummaryRow]) -> str:
    """Return `12 looks: 1 failed, 2 not done yet`."""
    counts = {state: sum(row.state == state for row in rows) for state in ("failed", "waiting")}
    parts = [f"{counts['failed']} failed"] * bool(counts["failed"])
    parts += [f"{counts['waiting']} not done yet"] * bool(counts["waiting"])
    looks = f"{len(rows)} look{'s' * (len(rows) != 1)}"
    return f"{looks}: {', '.join(parts) or 'all done'}"


def contact_sheet(folder: Path, rows: list[summary.SummaryRow]) -> Any:
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
    draw.text((GAP, GAP), report.shorten_to_width(title, font, size[0] - 2 * GAP), FAINT, font)
    for k, row in enumerate(rows_with_pictures):
        x = GAP + k % columns * (WIDTH + GAP)
        y = 2 * GAP + CAPTION_HEIGHT + k // columns * (height + CAPTION_HEIGHT + GAP)
        _draw(sheet, folder, row, (x, y, WIDTH, height), font)
    return np.asarray(sheet)


def _draw(
    sheet: Image.Image,
    folder: Path,
    row: summary.SummaryRow,
    box: tuple[int, int, int, int],
    font: Any,
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
    draw.text(
        (x, baseline), report.shorten_to_width(visible(name), font, room), TEXT, font, anchor="ls"
    )


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
) -> list[summary.SummaryRow]:
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


def mixers_html(
    folder: Path, rows: Sequence[summary.SummaryRow], bases: Mapping[str, str]
) -> dict[str, Markup]:
    """Return the first mixers as sections of HTML, by their names.

    folder: of the batch. rows: candidates. bases: name of each row's planes, by the row's folder.
    """
    rows_by_basis: dict[str, list[summary.SummaryRow]] = {}
    for row in rows:
        if row.lights and row.folder in bases:
            rows_by_basis.setdefault(bases[row.folder], []).append(row)
    sections: dict[str, Markup] = {}
    for name, basis_rows in rows_by_basis.items():
        record = read_planes(folder / THUMBNAILS / f"{name}{SUFFIX}")
        if len(sections) < MAX_MIXERS and record:
            # A damaged file costs its mixer, but not the gallery.
            with suppress(LightpaintError, AttributeError, LookupError, TypeError, ValueError):
                sections[name] = _mixer(folder, name, record, basis_rows)
    return sections


def _mixer(
    folder: Path, name: str, record: Mapping[str, Any], rows: Sequence[summary.SummaryRow]
) -> Markup:
    """Return one mixer. record: as `write_planes` wrote it."""
    lights = [
        {**light, "answer": light["present"], "kelvin": {"present": None, "answer": None}}
        for light in record["lights"]
    ]
    # Results of several views have one lighting, in the folder of the look.
    lighting = read_lighting(folder / rows[0].look / "lighting.json")
    data = {
        "size": record["size"],
        "planes": record["planes"],
        "lights": lights,
        "shown": _strongest_lights(record, rows),
        "joint": [
            {**image, "levels": {"answer": 1.0, "present": 1.0}} for image in record["images"]
        ],
        "kelvins": report.kelvin_colors(),
        "gels": report.packed_gels(),
        "transform": report.transform_data(ViewTransform()),
        "painting": None,
        "lighting": report.lighting_data(lighting),
        "command": None,
    }
    section = (
        '<section class="mixer" data-ready data-basis="{}" hidden>'
        '<script type="application/json">{}</script></section>'
    )
    return Markup(section).format(name, report.script_json(data))


def _strongest_lights(record: Mapping[str, Any], rows: Sequence[summary.SummaryRow]) -> list[int]:
    """Return the lights that get sliders, by their index in the basis: all, if they are few, but
    for the texels of images.
    """
    names = [light["name"] for light in record["lights"]]
    texels = {k for image in record["images"] for k in image["members"]}
    singles = [k for k in range(len(names)) if k not in texels]
    if len(singles) <= MAX_LIGHTS:
        return singles
    power = dict.fromkeys(names, 0.0)
    for row in rows:
        for light in row.lights:
            power[light.name] = max(power.get(light.name, 0.0), light.y)
    share = {name: power[name] * total for name, total in zip(names, record["totals"], strict=True)}
    return sorted(sorted(singles, key=lambda k: -share[names[k]])[:MAX_LIGHTS])


def transforms_of(rows: Sequence[summary.SummaryRow]) -> dict[str, Any]:
    """Return the looks' view transforms by name; the exposure belongs to each look."""
    transforms = {"srgb": report.transform_data(ViewTransform())}
    for name in dict.fromkeys(row.view[0] for row in rows if row.view):
        with suppress(LightpaintError):
            transforms.setdefault(name, report.transform_data(ViewTransform(name)))
    return transforms


def planes_name(folder: Path, key: str) -> str:
    """Return the name of a basis' small planes in the folder of a batch. key: of `bases_of`.

    Paths are relative to the folder, so that a batch finds its planes after a move with its files.
    """
    base = os.path.realpath(folder)
    record = json.dumps(_relative_paths(json.loads(key), base))
    return hashlib.sha256(record.encode()).hexdigest()[:16]


def write_planes(folder: Path, key: str, basis: Basis) -> None:
    """Write a basis' small planes for the gallery in `folder`, unless they exist."""
    path = folder / THUMBNAILS / f"{planes_name(folder, key)}{SUFFIX}"
    identity = _identity(basis)
    if read_planes(path).get("identity") == identity:
        return
    is_noisy = any(x.any() for x in basis.noise)
    size, planes = report.planes_for_page(basis, is_clean=is_noisy)
    record = {
        "identity": identity,
        "scene": Path(basis.origin.scene).name,
        "sensor": basis.origin.sensor,
        "size": size,
        "totals": [float(sum(total)) for total in basis.totals],
        "lights": [
            {**report.light_data(x), "present": list(map(float, x.emission))} for x in basis.lights
        ],
        "images": [
            {
                "label": image.name,
                "columns": image.size[0],
                "members": image.lights.tolist(),
                "places": image.map_order,
            }
            for image in light_images(basis.lights)
            if image.is_whole
        ],
        "planes": planes,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, json.dumps(record, ensure_ascii=False, allow_nan=False) + "\n")


def write_task_planes(folder: Path, task: Task, bases: Sequence[Basis], cache: WorkerCache) -> None:
    """Write the small planes of a task's bases. bases: those that were not read from files."""
    if not bases:
        source = content(job_fields(task, cache)["basis"])
        bases = [source.basis if isinstance(source, LightGroups) else source]
    for key, basis in zip(task.bases, bases, strict=True):
        write_planes(folder, key, basis)


def read_planes(path: Path) -> dict[str, Any]:
    """Return the record that `write_planes` wrote; {} if it cannot be read."""
    with suppress(LightpaintError, ValueError):
        record = strict_json(read_text(path, "planes", LightpaintError, limit=MAX_BYTES))
        return record if isinstance(record, dict) else {}
    return {}


def drop_planes(folder: Path, used_names: Collection[str]) -> None:
    """Delete small planes that no look uses. used_names: names of those to keep."""
    for path in (folder / THUMBNAILS).glob(f"*{SUFFIX}"):
        if path.name.removesuffix(SUFFIX) not in used_names:
            path.unlink(missing_ok=True)


def _identity(basis: Basis) -> str:
    """Return a hash of everything that is shown of a basis: equal hashes mean equal samples."""
    lights = [(light.name, light.unit, list(light.emission)) for light in basis.lights]
    record = [__version__, FORMAT, basis.origin.scene_identity, basis.origin.halves, lights]
    text = json.dumps([*record, basis.totals.tolist()], default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def _relative_paths(record: Any, base: str) -> Any:
    """Return plain values with their paths relative to `base`."""
    if isinstance(record, dict):
        return {key: _relative_paths(value, base) for key, value in record.items()}
    if isinstance(record, str) and os.sep in record:
        return os.path.relpath(os.path.realpath(record), base)
    return record
