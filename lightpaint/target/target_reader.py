"""Reads painted files as targets: the image, and the pixels that count.

A picture from another program does not state its view. But most of a painting is unpainted, and
there it equals the look through one view, up to rounding in its file.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from lightpaint.arrays import Doubles, Floats, in_all_channels, in_any_channel, largest
from lightpaint.colour import BUILT_IN, TransformChoice, ViewTransform, luminance
from lightpaint.errors import SizeError, TargetError
from lightpaint.images import Picture, box_mean, read_mask, read_picture
from lightpaint.keywords import keywords
from lightpaint.sentences import Hint, Sentence, Word
from lightpaint.target import painted_pixels, painted_target
from lightpaint.target.template import (
    CLEAN,
    LIGHT_FILE,
    SHOWN_FILE,
    Template,
    find_template,
    read_template,
    template_files,
)

#: The meaning of paint: the look of the picture, or the light that falls on surfaces.
Paint = Literal["look", "light"]

#: Painted share of the picture from which the difference may be a conversion rather than paint.
NEARLY_ALL = 0.97

#: Ratio to the light on the template's brightest parts beyond which light is implausible; and the
#: share of paint that may need such light without a remark.
BEYOND_FACTOR, FEW_SHARE = 10.0, 0.01

#: Minimum share of informative pixels that must equal the look.
MAX_DIFFERENCE = 0.5

#: Display values of informative pixels: not near black or white, where many pictures are alike; and
#: the minimum share of such pixels in a picture.
TELLING_RANGE, MIN_TELLING_SHARE = (0.04, 0.96), 0.01

#: Difference in stops up to which exposures are equal up to rounding in a file.
BIN = 0.04


@dataclass(frozen=True)
class _Reading:
    """The state of reading a target.

    template, folder: template of the painting, and its folder, if known. transform: the view of the
    painting. look: name in messages of a template without a folder.
    """

    path: Path
    picture: Picture
    template: Template | None
    folder: Path | None
    transform: ViewTransform | None
    notes: tuple[str, ...]
    look: str = ""

    @property
    def painted_on(self) -> str:
        """The name of the template in messages: its file that corresponds to the painting."""
        if self.look:
            return self.look
        name = LIGHT_FILE if self.picture.codes is None else SHOWN_FILE
        return name if self.folder is None else str(self.folder / name)


@keywords()
def read_target(
    path: str | Path,
    *,
    mask: str | Path | None = None,
    layer: str | None = None,
    transform: ViewTransform | TransformChoice | None = None,
    template: str | Path | None = None,
    find: bool = True,
    paint: Paint = "look",
) -> painted_target.Target:
    """Read a painting: an EXR in linear light, or a PNG, TIFF, JPEG or layered file.

    Importance comes from the first of these that exists: `mask`; an EXR's W channel; alpha; the
    difference from the template it was painted on. Without any of them, every pixel counts the
    same. Pixels with alpha 0 have no colour and never count, even with a mask.

    Args:
        path: The painting.
        mask: Picture of the importance, black for pixels that do not count.
        layer: Layer, part or view of an EXR.
        transform: View transform that encoded 8 or 16 bits. Open parts come from `template`, else
            from the file, else from a template found for it, else from sRGB.
        template: Folder written by `lightpaint template`.
        find: Whether to look for a template beside the painting if none is given.
        paint: `light` takes colours as the light that falls on a surface, and multiplies them by
            its albedo: 1 makes white look like 1 (Schoeneman et al. 1993, section 3).

    Raises:
        ImageError: If a file cannot be read.
        TargetError: If the painting cannot be solved for.
        SizeError: If target and mask or template differ in size.

    Examples:
        >>> lp.read_target("painting.exr").size
        (16, 16)
    """
    return _target_of(_open_picture(Path(path), layer, transform, template, find=find), mask, paint)


def read_over_look(
    path: Path, look: Floats, name: str, *, layer: str | None, transform: TransformChoice
) -> painted_target.Target | None:
    """Return the painting at `path` if it was painted over `look`; None if it was not.

    For a painting that does not itself say what counts, and whose template is unknown. look: (h, w,
    3) linear, the current look of a basis or of light groups. name: name of the look in messages.
    layer, transform: as in `read_target`.
    """
    picture = read_picture(path, layer=layer, transform=transform)
    view = view_of_look(path, picture, look, transform)
    if view is None:
        return None
    if picture.transform is not None:
        picture = read_picture(path, layer=layer, transform=view)
    template = Template(look, view)
    if not painted_pixels.painted_where(path, picture, template).any():
        return None  # it is the look itself, so all of it counts
    shown = None if picture.transform is None else view
    transform_text = "" if shown is None else f" through {shown.spoken}"
    return _target_of(_Reading(path, picture, template, None, shown, (), f"{name}{transform_text}"))


def _target_of(
    reading: _Reading, mask: str | Path | None = None, paint: Paint = "look"
) -> painted_target.Target:
    """Find the painted pixels and create the target. mask, paint: as in `read_target`."""
    picture, template = reading.picture, reading.template
    importance, notes = _importance(reading, mask)
    # Pixels that the file does not store were not painted, whatever the mask.
    is_there = picture.finite if picture.stored is None else picture.finite & picture.stored
    counted = np.where(is_there, 1 if importance is None else importance, 0)
    image, painted = picture.image, painted_target.painted_of(picture.attributes, reading.path)
    if paint == "light":
        image, counted, note = _lit(reading, counted)
    else:
        note = _beyond(reading, counted)
    if text := painted_target.describe_negative(image, counted > 0):
        # It may be a colour outside Rec.709, or a mistake.
        note = [*note, f"{text}: no light makes that, and black comes closest"]
    return painted_target.Target(
        name=reading.path.stem,
        image=image,
        importance=counted.astype(np.float32),
        everything=importance is None,
        not_finite=int(picture.finite.size - picture.finite.sum()),
        at_least=picture.saturated,
        notes=(*picture.notes, *reading.notes, *notes, *note),
        content="" if template is None else template.content,
        sensor="" if template is None else template.sensor,
        transform=reading.transform,
        through_view=picture.transform is not None
        or (painted is not None and painted.through_view),
        # A layer saved alone was painted over something. Pixels outside a mask do not count.
        over_look=template is not None
        or (painted is not None and painted.over_look)
        or (picture.transform is not None and picture.alpha is not None and mask is None),
        files=(
            reading.path,
            *([] if mask is None else [Path(mask)]),
            *([] if reading.folder is None else template_files(reading.folder)),
        ),
        full_size_share=None if importance is None else painted_target.share_of(importance),
    )


def _open_picture(
    path: Path,
    layer: str | None,
    transform: ViewTransform | TransformChoice | None,
    template: str | Path | None,
    *,
    find: bool,
) -> _Reading:
    """Read the picture and the template it was painted on. Arguments as in `read_target`."""
    choice, base = TransformChoice.of(transform), None
    notes: tuple[str, ...] = ()
    folder = None if template is None else Path(template)
    if folder is not None:
        # A file in the folder stands for the folder.
        folder = folder.parent if folder.is_file() else folder
        base = read_template(folder)
        choice = TransformChoice.of(choice.over(base.transform))
    elif find and (folder := find_template(path)) is not None:
        base = read_template(folder)
    otherwise = None if base is None else base.transform
    picture = read_picture(path, layer=layer, transform=choice, otherwise=otherwise)
    if base is not None and folder is not None and base.size != picture.size:
        if template is not None:
            raise SizeError(
                path,
                f" is {picture.size[1]}x{picture.size[0]} but {folder / SHOWN_FILE} is "
                f"{base.size[1]}x{base.size[0]}: give the template it was painted on",
            )
        notes = (f"not compared with {folder / SHOWN_FILE}, which has another size",)
        # The painting has another template, and therefore another transform.
        base, otherwise = None, None
        picture = read_picture(path, layer=layer, transform=choice)
    own_marks = painted_target.painted_of(picture.attributes, path)
    if own_marks is not None:
        otherwise = own_marks.transform
    shown = picture.transform or (otherwise if choice.is_open else choice.over(otherwise))
    return _Reading(path, picture, base, folder, shown, notes)


def _importance(reading: _Reading, mask: str | Path | None) -> tuple[Floats | None, list[str]]:
    """Return the importance (h, w), or None if it is unknown, and remarks on it."""
    path, picture, template = reading.path, reading.picture, reading.template
    if mask is not None:
        importance = read_mask(mask)
        if importance.shape != picture.size:
            raise SizeError(
                "mask ",
                mask,
                f" is {importance.shape[1]}x{importance.shape[0]} but the target ",
                path,
                f" is {picture.size[1]}x{picture.size[0]}: export both at one size",
            )
        if picture.alpha is not None and picture.weight is None:
            importance = np.where(picture.alpha > 0, importance, np.float32(0))
        return importance, []
    if picture.weight is not None:
        return picture.weight, []
    is_opaque = picture.alpha is None or bool((picture.alpha == 1).all())
    if template is None and picture.alpha is None and picture.transform is not None:
        # Without a template, the meaning of display values is unknown.
        view, stops = picture.transform.name, picture.transform.stops
        view += f" at {stops:+g} stops" if stops else ""
        note = Sentence(
            f"all of it counts, as {view} shows it: no template says what was painted (",
            Hint("template"),
            " names one)",
        )
        return None, [note]
    if template is None or not is_opaque:
        return picture.alpha, []
    importance = painted_pixels.painted_where(path, picture, template)
    share = painted_target.share_of(importance)
    if share == 0:
        folder = Path(reading.painted_on).parent
        if path.resolve() in [
            (folder / name).resolve() for name in (LIGHT_FILE, SHOWN_FILE, CLEAN)
        ]:
            raise TargetError(path, " is the template itself: give the painting made over it")
        raise TargetError(
            "nothing in ",
            path,
            f" differs from {reading.painted_on}: paint over it, or pass ",
            Hint("find", False),
            " if all of it counts",
        )
    painted_text = (
        f"{painted_target.spoken_share(share)} painted: what differs from {reading.painted_on}"
    )
    if share > NEARLY_ALL and (remark := _of_all(picture, template)):
        return importance, [Sentence(painted_text, "; ", remark)]
    return importance, [painted_text]


def _of_all(picture: Picture, template: Template) -> str:
    """Return a clause on what, other than paint, happened to a template of which little remains."""
    transform = picture.transform or template.transform
    codes, template_codes = (transform.encode(x) for x in (picture.image, template.image))
    if picture.lossy:  # compression preserves the means of a few pixels
        codes, template_codes = (
            box_mean(x, painted_pixels.SHARP_RADIUS) for x in (codes, template_codes)
        )
    return explain_mismatch(codes, template_codes)


def _lit(reading: _Reading, counted: Floats) -> tuple[Floats, Floats, list[str]]:
    """Return image and importance of a painting of light: its colours times the surfaces'
    albedo.
    """
    if reading.template is None or reading.template.albedo is None:
        raise TargetError(
            "reading ",
            reading.path,
            " as light needs its template, which has the albedo of "
            "surfaces: give the folder that lightpaint template wrote as ",
            Hint("template"),
        )
    albedo = reading.template.albedo
    # Metals, glass and the background reflect no diffuse light, so paint on them says nothing.
    blind = (largest(albedo) <= 0) & (counted > 0)
    counted_light = np.where(blind, 0, counted)
    if not counted_light.any():
        raise TargetError(reading.path, ": no painted pixel shows a surface that reflects light")
    lost_count = int(blind.sum())
    note = (
        [f"{lost_count} painted pixels show no surface that reflects light"] if lost_count else []
    )
    return (reading.picture.image * albedo).astype(np.float32), counted_light, note


def _beyond(reading: _Reading, counted: Floats) -> list[str]:
    """Return a remark if paint needs a colour that the surface hardly reflects."""
    template = reading.template
    if template is None or template.albedo is None:
        return []
    albedo = np.maximum(template.albedo, 1e-3)
    there_is = largest(template.albedo) > 0
    painted = (counted > 0) & there_is
    if not painted.any():
        return []
    light = np.maximum(reading.picture.image, 0) / albedo
    light_needed = np.asarray(luminance(np.maximum(template.image, 0) / albedo))
    bright_level = float(np.percentile(light_needed[there_is], 95))
    # Nearly black pixels need little light, whatever the ratio.
    is_beyond = (light > BEYOND_FACTOR * bright_level) & (
        reading.picture.image > 0.02 * template.transform.white
    )
    share = float((in_any_channel(is_beyond) & painted).sum() / painted.sum())
    if share <= FEW_SHARE:
        return []
    remark = Sentence(
        f"{100 * share:.0f} % of the paint needs a colour that the surface hardly reflects, and so "
        f"more than {BEYOND_FACTOR:g} times the light of the template's brightest parts: ",
        Hint("paint", Word("light")),
        " paints the light instead",
    )
    return [remark]


def view_of_look(
    path: Path, picture: Picture, look: Floats, choice: TransformChoice
) -> ViewTransform | None:
    """Return the view through which most of `picture` equals `look`; None if it does not.

    path: the file of the picture. look: (h, w, 3) linear. choice: the part of the view that is
    given; the remainder, including the exposure, is searched. A file that holds light has no view,
    and is compared in sRGB.
    """
    if picture.size != look.shape[:2]:
        return None
    views = [ViewTransform()]
    display = (picture.transform or views[0]).encode(picture.image)
    if picture.transform is not None:
        views = list(_plausible(display, look, choice))
    agreements = [_agreement(path, picture, display, view.encode(look)) for view in views]
    best_index = max(range(len(views)), key=agreements.__getitem__)
    return views[best_index] if agreements[best_index][0] > MAX_DIFFERENCE else None


def _plausible(display: Floats, look: Floats, choice: TransformChoice) -> Iterator[ViewTransform]:
    """Yield views, each at the exposure that maps the look to most of the display values."""
    for name in (
        [choice.name] if choice.name is not None else [n for n in BUILT_IN if n != "linear"]
    ):
        view = TransformChoice(name, choice.stops or 0.0).over(None)
        yield view
        if choice.stops is None:
            stops = _stops_between(view, display, look)
            # People choose round numbers.
            for digits in (1, 2, 4):
                yield ViewTransform(view.name, round(stops, digits))


def _stops_between(view: ViewTransform, display: Floats, look: Floats) -> float:
    """Return the approximate exposure at which that view shows most of `look` as in `display`."""
    light, look_brightness = luminance(view.decode(display)), luminance(look)
    low, high = TELLING_RANGE
    is_unclipped = in_all_channels((display > low) & (display < high))
    is_unclipped &= (light > 0) & (look_brightness > 0)
    if not is_unclipped.any():
        return 0.0
    stops = np.log2(light[is_unclipped] / look_brightness[is_unclipped])
    # Unpainted pixels share the most common exposure; painted ones vary.
    counts = np.bincount(np.floor((stops - stops.min()) / BIN).astype(np.intp))
    smoothed = np.convolve(counts, [1, 1, 1], "same")
    commonest = stops.min() + BIN * (np.argmax(smoothed) + 0.5)
    return float(np.clip(np.median(stops[np.abs(stops - commonest) < 1.5 * BIN]), -60, 60))


def _agreement(
    path: Path, picture: Picture, display: Floats, encoded_look: Floats
) -> tuple[float, float]:
    """Return the share of informative pixels that are equal, and their closeness; larger is better.

    display, encoded_look: (h, w, 3), display values of the picture and of the look.
    """
    low, high = TELLING_RANGE
    is_informative = (largest(encoded_look) > low) & (encoded_look.min(axis=-1) < high)
    if is_informative.mean() < MIN_TELLING_SHARE:
        return 0.0, 0.0
    if picture.lossy:
        difference, tolerance = (
            painted_pixels.lossy_difference(
                display, painted_pixels.compressed_like(path, encoded_look)
            ),
            painted_pixels.LOSSY,
        )
    else:
        difference, tolerance = largest(np.abs(display - encoded_look)), painted_pixels.ROUNDING
    is_same = difference[is_informative] <= tolerance
    if not is_same.any():
        return 0.0, 0.0
    # Rounded to fiftieths and tenths of a code, so that the first of nearly equal views wins.
    return round(50 * float(is_same.mean())) / 50, -round(
        2550 * float(difference[is_informative][is_same].mean())
    )


#: Maximum error of a smooth function of the template's colours, relative to the painting's
#: contrast. Measured: views and profiles leave at most 0.04, paintings at least 0.2.
SMOOTH = 0.1

#: Number of evenly spread sample pixels; and the display value from which a channel is clipped.
PIXELS, WHITE = 20_000, 0.998


def explain_mismatch(picture: Floats, template: Floats) -> str:
    """Return a clause on why the whole template differs; "" if it was painted over.

    picture, template: (h, w, 3), display values of painting and template.
    """
    if _is_function(picture, template):
        return Sentence(
            "a single change of colours explains all of it: unless you graded it, it was saved "
            "through another view or profile (",
            Hint("transform"),
            ", ",
            Hint("mask"),
            ")",
        )
    for turn, turned_template in _turned(template):
        if _is_function(picture, turned_template):
            return f"it is the template {turn}: turn it back"
    down, right = _offset(picture, template)
    if (down or right) and _is_function(*_overlap(picture, template, down, right)):
        return f"it is the template moved by {right} pixels to the right and {down} down: undo that"
    return ""


def _is_function(picture: Floats, template: Floats) -> bool:
    """Return whether `picture` is a smooth function of `template` wherever neither is clipped."""
    picture, template = (x.reshape(-1, 3).astype(np.float64) for x in (picture, template))
    unclipped = np.flatnonzero((picture < WHITE).all(axis=-1) & (template < WHITE).all(axis=-1))
    unclipped = unclipped[:: max(1, unclipped.size // PIXELS)]
    terms = _terms(template[unclipped])
    if unclipped.size < 2 * terms.shape[1]:
        return False  # too few to decide
    solution, *_ = np.linalg.lstsq(terms, picture[unclipped], rcond=None)
    mean_square_error = np.square(picture[unclipped] - terms @ solution).mean()
    return bool(mean_square_error <= SMOOTH**2 * picture[unclipped].var(axis=0).mean())


def _terms(rgb: Doubles) -> Doubles:
    """Return the terms of a curve for each channel with a little crosstalk, (n, 13)."""
    r, g, b = rgb.T
    ones = np.ones_like(r)
    terms = (ones, r, g, b, r * r, g * g, b * b, r * g, r * b, g * b, r**3, g**3, b**3)
    return np.stack(terms, axis=-1)


def _turned(template: Floats) -> Iterator[tuple[str, Floats]]:
    yield "mirrored", template[:, ::-1]
    yield "upside down and mirrored", template[::-1]
    yield "upside down", template[::-1, ::-1]


def _offset(picture: Floats, template: Floats) -> tuple[int, int]:
    """Return the shift in pixels (down, right) with the largest phase correlation."""
    size = picture.shape[:2]
    first, second = (np.fft.rfft2(x.mean(axis=-1) - x.mean()) for x in (picture, template))
    cross = first * np.conj(second)
    peaks = np.fft.irfft2(cross / np.maximum(np.abs(cross), 1e-12), s=size)
    peak = np.unravel_index(int(np.argmax(peaks)), size)
    down, right = (int(k) if k <= n // 2 else int(k) - n for k, n in zip(peak, size, strict=True))
    return down, right


def _overlap(picture: Floats, template: Floats, down: int, right: int) -> tuple[Floats, Floats]:
    """Return the parts of two pictures that overlap when one is shifted."""
    height, width = picture.shape[0] - abs(down), picture.shape[1] - abs(right)
    top, left = max(down, 0), max(right, 0)
    part = picture[top : top + height, left : left + width]
    top, left = max(-down, 0), max(-right, 0)
    return part, template[top : top + height, left : left + width]
