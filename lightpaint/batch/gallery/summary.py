"""The results of each look, read from its folder: numbers, lights, and a small picture."""

import csv
import io
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from PIL import Image

from lightpaint.arrays import RGB
from lightpaint.basis import light_images
from lightpaint.batch.manifest.file_names import SUMMARY_FORMAT, THUMBNAILS
from lightpaint.batch.plan.journal import JournalLine
from lightpaint.batch.plan.plan_steps import Plan, PlannedLook
from lightpaint.batch.work.work_items import EXPORT, Kind
from lightpaint.colour import ViewTransform, choose_exposure, to_8_bit
from lightpaint.errors import LightpaintError
from lightpaint.files import read_text, replacing
from lightpaint.images import block_mean, denoised, fitting_factor, read_estimate
from lightpaint.lighting import read_lighting
from lightpaint.photometry import PLANES, plane_title
from lightpaint.pipeline import PLANES_FOLDER as PLANES_FOLDER
from lightpaint.pipeline import RECORD
from lightpaint.relit import plain_cell
from lightpaint.storage.json_records import strict_json
from lightpaint.version import __version__

#: Greatest width of a gallery picture in pixels: WIDE for at most WIDE_LOOKS looks, which are
#: compared as large as a window, else NARROW; and the quality of its JPEG.
WIDE, WIDE_LOOKS, NARROW, QUALITY = 960, 64, 320, 82

#: Columns of summary.csv before the columns of the lights.
COLUMNS = (
    "look",
    "sensor",
    "state",
    "delta_e",
    "noise",
    "share_met",
    "agrees",
    "target",
    "scene",
    "variation",
    "folder",
    "why",
    "spp",
    "fingerprint",
)

#: Suffixes of a light's columns: luminance, emission, kelvin; and, where the spectra of a lamp are
#: known in some look, its distance from Planck's locus, and how it renders colours.
LIGHT_COLUMNS = ("", " R", " G", " B", " K")
RENDERING_COLUMNS = (" Duv", " Ra", " Rf")

#: Columns of a plane: its mean illuminance, and the ratio of its least to that. And the columns of
#: the glare of an observer, of the power of all lamps, in watts, and of the planes that do not get
#: what was wished for.
PLANE_COLUMNS, GLARE_COLUMN = (" Em lx", " U0"), " UGR"
POWER_COLUMN, MISSED_COLUMN = "W", "wishes missed"

State = Literal["done", "failed", "waiting"]


@dataclass(frozen=True)
class LightRow:
    """A light in a look.

    y: luminance of its emission, in the scene's unit. hex: its colour. share: of its image, if it
    is a texel. drives: of a lamp of emitters, by their names. ra, rf: how a lamp of known spectra
    renders colours, as in report.json.
    """

    name: str
    y: float
    emission: RGB | None = None
    hex: str | None = None
    kelvin: float | None = None
    duv: float | None = None
    stops: float | None = None
    share: float | None = None
    drives: Mapping[str, float] = field(default_factory=dict)
    ra: float | None = None
    rf: float | None = None


@dataclass(frozen=True)
class PlaneRow:
    """The illuminance on a measuring plane in a look.

    name: of the plane and its case. mean_lx: the mean illuminance in lx. uniformity: the least over
    the mean.
    """

    name: str
    mean_lx: float
    uniformity: float


@dataclass(frozen=True)
class ObserverRow:
    """The glare that an observer sees in a look.

    name: of the observer and the case. ugr: None if it is unknown.
    """

    name: str
    ugr: float | None


@dataclass(frozen=True)
class SummaryRow:
    """A look, or one view of it.

    folder: of its results, relative to the batch's. delta_e, noise, share_met: as in report.json;
    None if nothing was painted. agrees: whether a render confirms it; None if there was none.
    spp: samples per pixel of its basis; None if nothing was rendered. fingerprint: hash of its
    request and of the files that it reads, as in the journal.
    planes: on which illuminance was measured. observers: for whom glare was. watts: power of all
    lamps, where there are planes and the power of each lamp is known. missed_planes: names of
    planes whose wishes are not all met.
    files: to open. picture: small, relative to the batch's folder; "" where there is none.
    """

    look: str
    state: State
    why: str
    folder: str
    sensor: str = ""
    scene: str = ""
    target: str = ""
    variation: str = ""
    delta_e: float | None = None
    noise: float | None = None
    share_met: float | None = None
    agrees: bool | None = None
    view: tuple[str, float] | None = None
    lights: tuple[LightRow, ...] = ()
    files: tuple[str, ...] = ()
    picture: str = ""
    size: tuple[int, int] = field(default=(4, 3))
    spp: float | None = None
    fingerprint: str = ""
    planes: tuple[PlaneRow, ...] = ()
    observers: tuple[ObserverRow, ...] = ()
    watts: float | None = None
    missed_planes: tuple[str, ...] = ()


def rows_of(plan: Plan, lines: Mapping[tuple[str, Kind], JournalLine]) -> list[SummaryRow]:
    """Return a row for each view of each look, in the order of the manifest."""
    rows: list[SummaryRow] = []
    widest = WIDE if len(plan.looks) <= WIDE_LOOKS else NARROW
    views: dict[str, tuple[str, float] | None] = {}
    for look in plan.looks:
        state, reason = state_of(look, lines)
        for folder in view_folders(look):
            row = _row(plan, look, folder, state, reason)
            if state == "done":
                row = replace(row, fingerprint=lines[look.entry.name, "answer"].made_of)
            # A look that combines others is shown through their view transform.
            view = row.view or next(
                (views[x] for x in look.entry.combined_looks if views.get(x)), None
            )
            views.setdefault(look.entry.name, view)
            if state == "done":
                row = _with_picture(row, plan.folder, folder, view, _key(look, lines), widest)
            rows.append(row)
    return rows


def state_of(look: PlannedLook, lines: Mapping[tuple[str, Kind], JournalLine]) -> tuple[State, str]:
    """Return whether all steps are done as now requested, and why one failed."""
    state: State = "done"
    for step in look.steps:
        line = lines.get((step.task.look, step.task.kind))
        if line is not None and line.state == "failed" and line.made_of == step.fingerprint:
            return "failed", line.why
        if line is None or line.made_of != step.fingerprint:
            state = "waiting"
    return state, ""


def _key(look: PlannedLook, lines: Mapping[tuple[str, Kind], JournalLine]) -> str:
    return lines[look.entry.name, "answer"].made_of[:16]


def view_folders(look: PlannedLook) -> list[Path]:
    """Return the folder of each view's pictures."""
    if not look.entry.by_sensor:
        return [look.folder]
    return [look.folder / str(scene.sensor) for scene in look.entry.scenes]


def _row(plan: Plan, look: PlannedLook, folder: Path, state: State, reason: str) -> SummaryRow:
    entry, report = look.entry, {}
    if state == "done":
        report = _json(folder / "report.json")
    basis, closeness, view = (report.get(key) or {} for key in ("basis", "seen", "view"))
    sensor = basis.get("sensor") or (folder.name if entry.by_sensor else "")
    if not sensor and entry.scenes and entry.scenes[0].sensor is not None:
        sensor = str(entry.scenes[0].sensor)
    scene = entry.scenes[0].path if entry.scenes else entry.basis.path if entry.basis else ""
    names = ("report.html", "comparison.png", "relit.png", "relit.exr", "lighting.json")
    places = dict.fromkeys((folder, look.folder))
    result_files = [place / x for place in places for x in names if (place / x).is_file()]
    planes = planes_of_answer(look.folder) if state == "done" else ()
    if any(step.task.kind == "export" for step in look.steps):
        result_files += sorted(x for x in (look.folder / EXPORT).glob("*") if x.name != RECORD)
    return SummaryRow(
        entry.name,
        state,
        reason,
        folder.relative_to(plan.folder).as_posix(),
        sensor,
        Path(scene).name,
        report.get("target", ""),
        entry.variation,
        closeness.get("delta_e"),
        closeness.get("noise"),
        closeness.get("share_met"),
        (report.get("verification") or {}).get("agrees"),
        (view["name"], view["stops"]) if "name" in view else None,
        lights_of_answer(look.folder, report) if state == "done" else (),
        tuple(x.relative_to(plan.folder).as_posix() for x in result_files)
        if state == "done"
        else (),
        spp=basis.get("spp"),
        planes=planes,
        observers=observers_of_answer(look.folder) if planes else (),
        watts=watts_of_answer(look.folder) if planes else None,
        missed_planes=missed_planes(report),
    )


def lights_of_answer(folder: Path, report: Mapping[str, Any]) -> tuple[LightRow, ...]:
    """Return the lights of an answer in a folder. report: its report.json."""
    with suppress(LightpaintError):
        lighting = read_lighting(folder / "lighting.json")
        shares = dict[int, float]()
        for image in light_images(lighting.lights):
            shares |= zip(image.lights.tolist(), image.light_shares.tolist(), strict=True)
        rows = []
        for k, light in enumerate(lighting.lights):
            measures = lighting.photometry(light)
            stops = (report.get("lights") or {}).get(light.name, {}).get("stops")
            values = (light.emission, measures.hex, measures.kelvin, measures.duv, stops)
            rendering = (report.get("rendering") or {}).get(light.name, {})
            indices = {key: rendering.get(key) for key in ("ra", "rf")}
            row = LightRow(light.name, measures.y, *values, share=shares.get(k), **indices)
            rows.append(replace(row, drives=dict(light.drives)))
        return tuple(rows)
    return ()


def planes_of_answer(folder: Path) -> tuple[PlaneRow, ...]:
    """Return what an answer in a folder gives on measuring planes; nothing without any."""
    rows = list[PlaneRow]()
    for case, document in _measured_cases(folder):
        with suppress(AttributeError, KeyError, TypeError, ValueError):
            rows += [
                PlaneRow(plane_title(name, case), float(x["mean"]), float(x["uniformity"]))
                for name, x in document["planes"].items()
            ]
    return tuple(rows)


def _measured_cases(folder: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the measurements of an answer by case, each of which has a folder; "" without cases."""
    base = folder / PLANES_FOLDER
    for file in sorted(base.glob(f"**/{PLANES}")):
        yield "" if file.parent == base else file.parent.name, _json(file)


def observers_of_answer(folder: Path) -> tuple[ObserverRow, ...]:
    """Return the glare in an answer in a folder; nothing without observers."""
    rows = list[ObserverRow]()
    for case, document in _measured_cases(folder):
        with suppress(AttributeError, KeyError, TypeError, ValueError):
            rows += [
                ObserverRow(plane_title(name, case), None if x["ugr"] is None else float(x["ugr"]))
                for name, x in document["observers"].items()
            ]
    return tuple(rows)


def missed_planes(report: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the planes whose wishes are not all met. report: the report.json of an answer."""
    with suppress(AttributeError, KeyError, TypeError):
        planes = report["planes"]["planes"]
        return tuple(
            name for name, x in planes.items() if not all(wish["is_met"] for wish in x["wishes"])
        )
    return ()


def watts_of_answer(folder: Path) -> float | None:
    """Return the power of all lamps of an answer in a folder; None if the power of one is unknown.

    Lights of unknown emitters, such as a sky, are no lamps.
    """
    with suppress(LightpaintError):
        lights = read_lighting(folder / "lighting.json").lights
        watts = [light.watts for light in lights if light.lamp is not None]
        known = [x for x in watts if x is not None]
        return sum(known) if len(known) == len(watts) > 0 else None
    return None


def _json(path: Path) -> dict[str, Any]:
    """Return the object in a JSON file; {} if there is none, or a value that is not an object."""
    with suppress(LightpaintError, ValueError):
        report = strict_json(read_text(path, "report", LightpaintError))
        return report if isinstance(report, dict) else {}
    return {}


def _with_picture(
    row: SummaryRow, base: Path, folder: Path, view: tuple[str, float] | None, key: str, widest: int
) -> SummaryRow:
    """Return the row with a picture of the prediction, which is made once for each answer.
    widest: width limit in pixels.
    """
    of_view = f"-{folder.name}" if row.folder != row.look else ""
    name = f"{THUMBNAILS}/{key}{of_view}-{widest}.jpg"
    path = base / name
    with suppress(LightpaintError, OSError):
        if not _is_whole(path):
            predicted = read_estimate(folder / "predicted.exr")[0]
            height, width = predicted.size
            factor = fitting_factor((height, width), -(-width // widest))
            thumbnail = block_mean(predicted.image, factor)
            if predicted.half_difference.any():
                thumbnail = denoised(thumbnail)
            stops = choose_exposure(predicted.image)
            transform = ViewTransform(*view) if view else ViewTransform("srgb", stops)
            with replacing(path) as temporary:
                picture = Image.fromarray(to_8_bit(np.clip(transform.encode(thumbnail), 0, 1)))
                options = {"quality": QUALITY, "subsampling": 0}
                picture.save(
                    temporary, "JPEG", **options, comment=f"{transform.name} {transform.stops!r}"
                )
        with Image.open(path) as image:
            size, comment = image.size, image.info.get("comment", b"").decode()
        # A mixer needs the view transform as well, whether or not it was chosen here.
        transform_name, _, stops = comment.partition(" ")
        view = (transform_name, float(stops)) if stops else view
        return SummaryRow(**{**vars(row), "picture": name, "size": size, "view": view})
    return row


def _is_whole(path: Path) -> bool:
    """Return whether there is a small picture that can be shown."""
    try:
        with Image.open(path) as image:
            image.load()
            name, _, stops = image.info.get("comment", b"").decode().partition(" ")
            return image.format == "JPEG" and bool(name) and math.isfinite(float(stops))
    except (OSError, SyntaxError, ValueError):
        return False


def drop_pictures(folder: Path, rows: Iterable[SummaryRow]) -> None:
    """Delete small pictures of earlier answers."""
    used_names = {row.picture for row in rows}
    for path in (folder / THUMBNAILS).glob("*.jpg"):
        if f"{THUMBNAILS}/{path.name}" not in used_names:
            path.unlink(missing_ok=True)


def summary_document(rows: Iterable[SummaryRow]) -> dict[str, Any]:
    """Return the content of summary.json: all rows, with their lights."""
    looks = [{k: v for k, v in asdict(row).items() if v not in (None, "", ())} for row in rows]
    counts = {state: sum(x["state"] == state for x in looks) for state in ("done", "failed")}
    return {"format": SUMMARY_FORMAT, "lightpaint": __version__, **counts, "looks": looks}


def summary_json(rows: Iterable[SummaryRow]) -> str:
    """Return summary.json as text."""
    return json.dumps(summary_document(rows), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def summary_csv(rows: list[SummaryRow]) -> str:
    """Return summary.csv: a line for each row, five columns for each light, and one for each drive.

    These are the luminance of its emission, under its name, the emission in R, G and B, and its
    colour temperature in kelvin, if it has one, and where the spectra of lamps are known Duv, Ra
    and Rf; behind all, the drives of lamps of emitters. Where illuminance was measured, two columns
    for each plane come before them, one for the UGR of each observer, one for the power of all
    lamps, and one for planes that do not get what was wished for.
    """
    names = list(dict.fromkeys(light.name for row in rows for light in row.lights))
    planes = list(dict.fromkeys(plane.name for row in rows for plane in row.planes))
    observers = list(dict.fromkeys(x.name for row in rows for x in row.observers))
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    measured = [f"{name}{ending}" for name in planes for ending in PLANE_COLUMNS]
    measured += [f"{name}{GLARE_COLUMN}" for name in observers]
    measured += [POWER_COLUMN, MISSED_COLUMN] if planes else []
    has_spectra = any(light.rf is not None for row in rows for light in row.lights)
    endings = LIGHT_COLUMNS + (RENDERING_COLUMNS if has_spectra else ())
    columns = _light_columns(names, endings, taken={*COLUMNS, *measured})
    drives = list(dict.fromkeys((x.name, e) for row in rows for x in row.lights for e in x.drives))
    columns += [f"{name} drive {emitter}" for name, emitter in drives]
    table.writerow([*COLUMNS, *map(plain_cell, measured), *map(plain_cell, columns)])
    for row in rows:
        lights = {light.name: _light_cells(light)[: len(endings)] for light in row.lights}
        cells = [_cell(getattr(row, column)) for column in COLUMNS]
        cells += _measured_cells(row, planes, observers)
        empty_cells = [""] * len(endings)
        cells += [x for name in names for x in lights.get(name, empty_cells)]
        of_lamps = {light.name: light.drives for light in row.lights}
        cells += [_cell(of_lamps.get(name, {}).get(emitter)) for name, emitter in drives]
        table.writerow(cells)
    return text.getvalue()


def _measured_cells(row: SummaryRow, planes: Sequence[str], observers: Sequence[str]) -> list[str]:
    """Return the cells of all planes, of the glare, of the power and of what is missed; none if no
    row has a plane.
    """
    by_name = {plane.name: [plane.mean_lx, plane.uniformity] for plane in row.planes}
    values = [x for name in planes for x in by_name.get(name, [None] * len(PLANE_COLUMNS))]
    glare = {x.name: x.ugr for x in row.observers}
    values += [glare.get(name) for name in observers]
    return [_cell(x) for x in [*values, row.watts, "; ".join(row.missed_planes)]] if planes else []


def _light_columns(names: Sequence[str], endings: Sequence[str], taken: set[str]) -> list[str]:
    """Return the headings of the columns of each light, no two of them equal.

    endings: of its columns. taken: the other columns.
    They begin with its name; with `light` before it where that would be the heading of another
    column, as for lights called `state`, or `key` beside `key R`.
    """
    taken, headings = set(taken), list[str]()
    for name in sorted(names, key=len):
        own = name
        while taken & {f"{own}{ending}" for ending in endings}:
            own = f"light {own}"
        taken |= {f"{own}{ending}" for ending in endings}
        headings.append(own)
    heading_of = dict(zip(sorted(names, key=len), headings, strict=True))
    return [f"{heading_of[name]}{ending}" for name in names for ending in endings]


def _light_cells(light: LightRow) -> list[str]:
    rgb = light.emission or ("", "", "")
    kelvin = "" if light.kelvin is None else f"{light.kelvin:.0f}"
    duv = "" if light.rf is None or light.duv is None else f"{light.duv:.4f}"
    indices = ["" if x is None else f"{x:.1f}" for x in (light.ra, light.rf)]
    return [f"{light.y:.6g}", *(x if x == "" else f"{x:.6g}" for x in rgb), kelvin, duv, *indices]


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else plain_cell(str(value))
