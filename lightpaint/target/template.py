"""A template to paint on: the current look, pictures that help with selections, and its origin."""

import json
import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.colour import ViewTransform, to_8_bit
from lightpaint.errors import LightpaintError, TargetError, ViewError
from lightpaint.files import one_line, read_text, write_bytes, write_text
from lightpaint.images import formats
from lightpaint.sentences import Datum
from lightpaint.storage.json_records import fields_of, read_record, strict_json
from lightpaint.storage.staging import is_below, staged

FORMAT: Literal["lightpaint-template 1"] = "lightpaint-template 1"

#: The files of a template: its origin, pictures to paint on, and pictures that help.
RECORD_FILE, LIGHT_FILE, SHOWN_FILE, ALBEDO = (
    "template.json",
    "template.exr",
    "template.png",
    "albedo.exr",
)
CLEAN, NORMALS, DEPTH, MATTES, LIGHTS = (
    "clean.exr",
    "normals.exr",
    "depth.exr",
    "mattes",
    "lights",
)

#: Its files except the pictures of single objects or lights.
PLAIN_FILES = (LIGHT_FILE, SHOWN_FILE, CLEAN, ALBEDO, NORMALS, DEPTH, RECORD_FILE)

#: Maximum size of template.json in bytes.
MAX_ABOUT = 2**20


@dataclass(frozen=True)
class Template:
    """The look to paint over.

    image: (h, w, 3) linear Rec.709, as rendered. transform: of template.png. scene:
    name of its file. content: its hash (see `Scene.content`). sensor: its id. albedo: (h, w, 3) in
    [0, 1], share of light that surfaces reflect diffusely; None if not rendered.
    clean: (h, w, 3), the denoised `image` as in template.png; None if that shows `image` itself.
    """

    image: Floats
    transform: ViewTransform
    scene: str = ""
    content: str = ""
    sensor: str = ""
    albedo: Floats | None = None
    clean: Floats | None = None

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self.image.shape[0], self.image.shape[1]

    @property
    def looks(self) -> list[Floats]:
        """The pictures that a painting may have started from, linear; the picture of template.png
        first.
        """
        return [self.image] if self.clean is None else [self.clean, self.image]

    @property
    def shown(self) -> Floats:
        """The values of template.png in [0, 1], rounded to its 16 bits."""
        return np.round(self.transform.encode(self.looks[0]) * 65535) / 65535


@dataclass(frozen=True)
class _ShownTransform:
    """A view transform and its exposure."""

    name: str
    stops: float


@dataclass(frozen=True)
class _TemplateRecord:
    """Content of template.json. size: (width, height). files: files of the template, relative to
    it.
    """

    format: Literal["lightpaint-template 1"]
    scene: str
    content: str
    sensor: str
    size: tuple[int, int]
    view: _ShownTransform
    files: tuple[str, ...] = ()


def write_template(
    folder: Path,
    template: Template,
    *,
    normals: Floats | None = None,
    depth: Floats | None = None,
    mattes: Mapping[str, Floats] | None = None,
    lights: Mapping[str, Floats],
    texts: Mapping[str, Mapping[str, str]] | None = None,
) -> list[Path]:
    """Write a template into `folder` atomically, replacing an earlier one.

    Returns its files. normals: (h, w, 3). depth: (h, w). mattes: by object name, (h, w) in [0, 1].
    None skips a file. lights: by name, (h', w', 3) linear, the image of each light alone. texts:
    texts for the headers of pictures, by SHOWN and LIGHTS.
    """
    texts, mattes = texts or {}, mattes or {}
    matte_files = [f"{MATTES}/{name}.png" for name in file_names(mattes)]
    light_files = [f"{LIGHTS}/{name}.png" for name in file_names(lights)]
    images = {ALBEDO: template.albedo, CLEAN: template.clean, NORMALS: normals, DEPTH: depth}
    optional = {name: image for name, image in images.items() if image is not None}
    written_names = [LIGHT_FILE, SHOWN_FILE, *optional, RECORD_FILE, *matte_files, *light_files]
    with staged(folder, earlier_files(folder)) as stage:
        write_look(
            stage / LIGHT_FILE,
            template.image,
            template.transform,
            clean=template.clean,
            texts=texts.get(SHOWN_FILE),
        )
        for name, image in optional.items():
            if name == DEPTH:
                formats.write_parts(
                    stage / DEPTH, [formats.ExrPart("depth", {"Y": image.astype(np.float32)})]
                )
            else:
                attributes = texts.get(SHOWN_FILE) if name == CLEAN else None
                formats.write_rgb(stage / name, image, attributes=attributes)
        for file, matte in zip(matte_files, mattes.values(), strict=True):
            write_bytes(stage / file, formats.png_bytes(to_8_bit(matte)))
        for file, look in zip(light_files, lights.values(), strict=True):
            thumbnail = _thumbnail(look, template.transform.name, texts.get(LIGHTS))
            write_bytes(stage / file, thumbnail)
        write_text(stage / RECORD_FILE, _record_text(template, written_names))
    return [folder / name for name in written_names]


def _thumbnail(look: Floats, transform: str, texts: Mapping[str, str] | None) -> bytes:
    """Return a linear picture as PNG, exposed to be visible at any brightness."""
    white_level = max(float(np.percentile(look.max(axis=-1), 99)), 1e-12)
    shown = ViewTransform(transform, float(np.clip(-np.log2(white_level), -60, 60)))
    return formats.png_bytes(to_8_bit(shown.encode(look)), texts)


def _record_text(template: Template, files: Iterable[str]) -> str:
    height, width = template.size
    shown = _ShownTransform(template.transform.name, template.transform.stops)
    identity = (template.scene, template.content, template.sensor)
    record = fields_of(_TemplateRecord(FORMAT, *identity, (width, height), shown, tuple(files)))
    return json.dumps(record, indent=2, ensure_ascii=False) + "\n"


def earlier_files(folder: Path) -> list[Path]:
    """Return the files of a template in `folder`; none if the folder is something else."""
    if not (folder / RECORD_FILE).is_file():
        return []
    try:
        names = _read_about(folder)[0].files
    except (ValueError, LightpaintError):
        names = ()
    if names:
        return [folder / name for name in names if is_below(name)]
    plain_paths = [folder / name for name in PLAIN_FILES]
    return [*plain_paths, *(folder / MATTES).glob("*.png"), *(folder / LIGHTS).glob("*.png")]


def files_in_the_way(folder: Path) -> list[Path]:
    """Return the existing files that a new template in `folder` might replace, whatever they
    are.
    """
    plain_paths = [folder / name for name in PLAIN_FILES]
    # The names of objects and lights are not known yet.
    pictures = [*(folder / MATTES).glob("*.png"), *(folder / LIGHTS).glob("*.png")]
    existing_files = [*earlier_files(folder), *plain_paths, *pictures]
    return list(dict.fromkeys(file for file in existing_files if os.path.lexists(file)))


def template_files(folder: Path) -> list[Path]:
    """Return the files of the template in `folder` that `read_template` reads.

    Templates of light groups have no albedo and no clean picture.
    """
    optional = [folder / name for name in (CLEAN, ALBEDO) if (folder / name).exists()]
    return [folder / RECORD_FILE, folder / LIGHT_FILE, *optional]


def write_look(
    path: Path,
    image: Floats,
    transform: ViewTransform,
    *,
    clean: Floats | None = None,
    texts: Mapping[str, str] | None = None,
) -> Path:
    """Write only the look: a linear EXR, and a 16-bit PNG beside it. Returns the path of the PNG.

    clean: picture for the PNG instead of `image`. texts: texts for its header.
    """
    formats.write_rgb(path, image)
    picture = path.with_suffix(".png")
    shown = transform.encode(image if clean is None else clean)
    formats.write_png_16(picture, shown, texts=texts_of(transform) | dict(texts or {}))
    return picture


def read_template(folder: Path) -> Template:
    """Read a template written by `write_template`. Raises TargetError if it is not one."""
    try:
        record, transform = _read_about(folder)
        image = _read_picture(folder / LIGHT_FILE, record.size)
        albedo, clean = (
            _read_picture(folder / name, record.size) if (folder / name).exists() else None
            for name in (ALBEDO, CLEAN)
        )
    except LightpaintError as error:
        reason = error.sentence.spelled(partial(_name_within, folder))
        raise _not_a_template(folder, reason) from None
    except OSError as error:
        if error.filename is not None:
            error.filename = os.path.relpath(error.filename, folder)
        raise _not_a_template(folder, str(error)) from None
    except MemoryError as error:
        raise _not_a_template(folder, str(error) or type(error).__name__) from None
    return Template(image, transform, record.scene, record.content, record.sensor, albedo, clean)


def _not_a_template(folder: Path, reason: str) -> TargetError:
    advice = "; make one with lightpaint template"
    return TargetError(folder, " is not a template: ", one_line(reason), advice)


def _name_within(folder: Path, datum: Datum) -> str | None:
    """Return the name of a template's file relative to its folder; None for other data."""
    if isinstance(datum, Path) and datum != folder and datum.is_relative_to(folder):
        return str(datum.relative_to(folder))
    return None


def _read_about(folder: Path) -> tuple[_TemplateRecord, ViewTransform]:
    """Read template.json and its view. Raises TargetError if it is missing or damaged."""
    path = folder / RECORD_FILE
    text = read_text(path, "file", TargetError, limit=MAX_ABOUT)
    try:
        record = read_record(_TemplateRecord, strict_json(text), others=True)
        return record, ViewTransform(record.view.name, record.view.stops)
    except (ValueError, ViewError) as error:
        raise TargetError(path, f": {one_line(str(error))}") from None


def _read_picture(path: Path, size: tuple[int, int]) -> Floats:
    image = formats.read_parts(path)[0].rgb()
    height, width, _ = image.shape
    if size != (width, height):
        raise TargetError(path, f" is {width}x{height}, but {RECORD_FILE} says {size[0]}x{size[1]}")
    if not np.isfinite(image).all():
        raise TargetError(path, " holds NaN or Inf")
    return image


def find_template(painting: Path) -> Path | None:
    """Return the folder of the template that `painting` was most likely painted on.

    The candidates are its own folder, `template/` in it, the template beside it under another name
    if it is the only one, and `template/` in the current folder.
    """
    folder = painting.parent
    # Other programs also have files of its record's name.
    beside = [
        x.parent for x in folder.glob(f"*/{RECORD_FILE}") if x.with_name(SHOWN_FILE).is_file()
    ]
    places = (folder, folder / "template", *(beside if len(beside) == 1 else ()), Path("template"))
    # What has its name is not absent, be it a pipe, or a link that leads nowhere.
    return next((place for place in places if os.path.lexists(place / RECORD_FILE)), None)


def file_names(names: Iterable[str]) -> list[str]:
    """Return a file name for each name, valid on all systems and unique even without case."""
    files: list[str] = []
    used_names: set[str] = set()
    for name in names:
        stem = re.sub(r"[^\w.+-]", "_", name).strip("._")[:80] or "_"
        unique, k = stem, 2
        while unique.lower() in used_names:
            unique, k = f"{stem}-{k}", k + 1
        used_names.add(unique.lower())
        files.append(unique)
    return files


def texts_of(transform: ViewTransform) -> dict[str, str]:
    """Return the text for a PNG that names its transform."""
    return {formats.TRANSFORM_KEY: f"{transform.name} {transform.stops!r}"}
