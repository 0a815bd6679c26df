"""A painting prepared for the solve: linear pixels with their weights; and lightpaint's own file
format for it: light, importance, and how it was painted.

An EXR does not state its display, and marks unpainted pixels only by importance. A painting from
lightpaint records both, so that its solution is the same as during painting.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from lightpaint import images
from lightpaint.arrays import Floats, in_all_channels, in_any_channel
from lightpaint.colour import ViewTransform, luminance
from lightpaint.display_text import Shown
from lightpaint.errors import SizeError, TargetError
from lightpaint.images.formats import ExrPart, rgb_channels, write_parts
from lightpaint.keywords import keywords
from lightpaint.sentences import Hint, Remedy
from lightpaint.storage.json_records import fields_of, read_record, strict_json
from lightpaint.target.painted_pixels import TargetPixels
from lightpaint.validation import check_shape

#: Negative luminance that resampling leaves beside bright edges, as a share of the brightest.
NEGATIVE = 1e-3


#: Between these lies the brightest light of a painting that is not black: for other light, lamps
#: would be beyond the numbers that are computed with.
DIMMEST, BRIGHTEST_PAINT = 1e-25, 1e25

#: The name of a target made from arrays, unless another is given.
DEFAULT_NAME = "target"

#: Share of painted pixels that rounds to all of them.
WHOLE_SHARE = 0.9995

#: Text attribute of the EXR.
KEY = "lightpaint.painting"

FORMAT: Literal["lightpaint-painting 1"] = "lightpaint-painting 1"


@dataclass(frozen=True, eq=False)
class Wish:
    """A layer, an object or a stroke: what a person would name if asked what was painted.

    Attributes:
        name: Its name for people.
        area: (h, w) float32 from 0 to 1, how much of each pixel is painted by it and not by
            another wish above it.
        layer: Id of its layer in a painter's session; None for a painting without layers.
        group: Name of the group of its layer, such as a preset; "" without one.
        has_strokes: Whether separate strokes in it are wishes of their own.
        is_exact: Whether its colours were given as numbers, and not painted by eye.
    """

    name: str
    area: Floats
    layer: int | None = None
    group: str = ""
    has_strokes: bool = False
    is_exact: bool = False

    def __post_init__(self) -> None:
        if self.area.ndim != 2:
            raise SizeError(f"wish {self.name}: an area of {self.area.shape}: expected (h, w)")

    def resized(self, size: tuple[int, int]) -> "Wish":
        """Return the wish resampled to `size` (height, width)."""
        area = np.clip(images.resampled(self.area[..., None], size)[..., 0], 0, 1)
        return replace(self, area=np.asarray(area, np.float32))

    def reduced(self, factor: int) -> "Wish":
        """Return the wish averaged over blocks of factor × factor pixels."""
        return replace(self, area=np.asarray(images.block_mean(self.area, factor), np.float32))

    def cropped(self, height: int, width: int) -> "Wish":
        """Return the top left part, of this size."""
        return replace(self, area=self.area[:height, :width])


def separate(areas: Sequence[Floats]) -> list[Floats]:
    """Return the part of each area that no later one covers, (h, w) float32 each.

    areas: (h, w) coverages from 0 to 1, the lowest first.
    """
    uncovered, parts = None, []
    for area in reversed(areas):
        coverage = np.clip(area, 0, 1).astype(np.float32)
        parts.append(coverage if uncovered is None else coverage * uncovered)
        uncovered = (1 - coverage) if uncovered is None else uncovered * (1 - coverage)
    return parts[::-1]


def titled(name: str) -> str:
    """Return a target's name for messages: `target evening.exr`, or `the target` if it has no
    name.
    """
    return "the target" if name == DEFAULT_NAME else f"target {name}"


#: Advice about a painting of another size.
PASS_RESIZE = Remedy("pass ", Hint("resize", True))


@keywords()
@dataclass(frozen=True)
class Target(Shown):
    """The painted image Ψ and its importance D.

    Attributes:
        name: Its name in messages and results.
        image: (h, w, 3) float32, linear Rec.709, finite.
        importance: (h, w) float32 >= 0, the weight of each pixel's squared residual.
        everything: Whether it is unknown what was painted, so that every pixel counts 1.
        not_finite: Number of pixels with NaN or Inf, which have no importance.
        at_least: (h, w, 3) bool, True where the painting has the largest value of its file, which
            means this light or any brighter; None if its file has no such value.
        notes: Remarks for the user on how it was read, one sentence each.
        content: The identity of the scene that it was painted on, if known from a template.
        sensor: Id of the sensor that it was painted through, if known from a template.
        transform: The view transform of the display while it was painted; None if unknown.
        through_view: Whether its values came from a display rather than from light.
        over_look: Whether it was painted over the current look, which unpainted pixels keep.
        reads_emitters: Whether paint over visible emitters still has to be interpreted: as paint
            for what they light or, if painted over the current look, for their glow.
        files: The files that it was read from: the painting first, then mask and template.
        full_size_share: `painted_share` of the painting as it was read; None if it has not been
            cropped or averaged since.
        wishes: Its parts that ask for something of their own, the lowest first; empty where it has
            no layers, and `find_wishes` tells them apart.

    Examples:
        >>> image = np.full((16, 16, 3), 0.5)
        >>> left = np.arange(16) < 8
        >>> lp.Target.of(image, np.tile(left, (16, 1)), name="left half")
        Target 'left half', 16x16
          counts   50 % of the pixels
          light    0.5 to 0.5
    """

    name: str
    image: Floats
    importance: Floats
    everything: bool
    not_finite: int = 0
    at_least: npt.NDArray[np.bool_] | None = None
    notes: tuple[str, ...] = ()
    content: str = ""
    sensor: str = ""
    transform: ViewTransform | None = None
    through_view: bool = False
    over_look: bool = False
    reads_emitters: bool = True
    files: tuple[Path, ...] = ()
    full_size_share: float | None = None
    wishes: tuple[Wish, ...] = ()

    def __post_init__(self) -> None:
        if self.image.shape != (*self.importance.shape, 3):
            raise SizeError(
                self.title,
                f": image {self.image.shape} and importance {self.importance.shape} differ in size",
            )
        if self.at_least is not None and self.at_least.shape != self.image.shape:
            raise SizeError(
                self.title,
                f": image {self.image.shape} and at_least {self.at_least.shape} differ in size",
            )
        if any(wish.area.shape != self.importance.shape for wish in self.wishes):
            raise SizeError(
                self.title, f": a wish of another size than its importance, {self.importance.shape}"
            )
        if lost_count := int((~in_all_channels(np.isfinite(self.image))).sum()):
            raise TargetError(
                self.title,
                f" holds NaN or Inf in {lost_count} of "
                f"{self.importance.size} pixels: make them 0, and their importance too",
            )
        if not np.isfinite(self.importance).all() or (self.importance < 0).any():
            raise TargetError(
                self.title,
                ": importance must be finite and not negative; it is between "
                f"{np.min(self.importance):g} and {np.max(self.importance):g}",
            )
        if not self.importance.any():
            if self.not_finite == self.importance.size:
                raise TargetError(self.title, " holds NaN or Inf in every pixel")
            raise TargetError(
                self.title,
                " has importance 0 everywhere, so nothing in it counts: "
                "paint with some alpha, or give a mask that is not black",
            )
        _check_range(self.title, self.image, self.importance > 0)

    @classmethod
    def of(
        cls,
        image: npt.ArrayLike,
        importance: npt.ArrayLike | None = None,
        *,
        name: str = DEFAULT_NAME,
    ) -> "Target":
        """Create a target from arrays, which are copied as float32.

        image: (h, w, 3) floats, linear Rec.709, finite. Single components may be negative, as in
        colours outside Rec.709; the luminance of pixels that count must not be, beyond a thousandth
        of the brightest. importance: (h, w) >= 0, or a boolean mask; without it every pixel counts
        1. name: its name in messages and results.
        Raises TargetError or SizeError for invalid arrays.
        """
        array = np.asarray(image)
        if array.ndim != 3 or array.shape[-1] != 3 or not array.size:
            raise SizeError(
                f"{titled(name)}: an image of the shape {array.shape}: expected (height, width, 3)"
            )
        if array.dtype.kind != "f":
            raise TargetError(
                f"{titled(name)}: an image of {array.dtype}: expected floats, linear Rec.709; "
                "display values of 8 bits are ViewTransform().decode(image / 255)"
            )
        counts = np.ones(array.shape[:2]) if importance is None else np.asarray(importance)
        if counts.dtype.kind not in "bfui":
            raise TargetError(f"{titled(name)}: importance of {counts.dtype}: expected numbers")
        with np.errstate(over="ignore"):  # values beyond float32 become infinite, and are rejected
            pixels, counts = array.astype(np.float32), counts.astype(np.float32)
        if counts.shape == pixels.shape[:2]:  # otherwise the constructor reports the shapes
            _check_is_light(titled(name), pixels, counts > 0)
        return cls(name, pixels, counts, everything=importance is None)

    def __repr__(self) -> str:
        (height, width), counts = self.size, self.importance > 0
        light = self.image[counts]
        lines = [
            f"Target {self.name!r}, {width}x{height}",
            f"  counts   {100 * counts.mean():.3g} % of the pixels",
            f"  light    {light.min():.3g} to {light.max():.3g}",
        ]
        if self.at_least is not None:
            brighter = 100 * np.mean(in_any_channel(self.at_least), where=counts)
            lines.append(f"  at least {brighter:.3g} % of what counts, or anything brighter")
        if self.transform is not None:
            lines.append(f"  seen     through {self.transform.spoken}")
        return "\n".join([*lines, *(f"  note     {note}" for note in self.notes)])

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self.image.shape[0], self.image.shape[1]

    @property
    def title(self) -> Path | str:
        """The file that the target was read from, or its name: what messages call it."""
        return self.files[0] if self.files else titled(self.name)

    @property
    def painted_share(self) -> float:
        """The share of its pixels with any paint, however faint, 0 to 1.

        It refers to the painting as it was read: a mean over pixels is painted if one of them is,
        so a reduced picture would have a larger share.
        """
        return share_of(self.importance) if self.full_size_share is None else self.full_size_share

    @property
    def is_whole(self) -> bool:
        """True if all of it is painted, but for a share of pixels that its text would not show."""
        return self.painted_share >= WHOLE_SHARE

    @property
    def spoken_share(self) -> str:
        """`painted_share` as text, such as `63.7 %`, the same everywhere."""
        return spoken_share(self.painted_share)

    def resized(self, size: tuple[int, int]) -> "Target":
        """Return the target resampled to `size` (height, width), in linear light, weighted by
        importance. Raises SizeError for a size that no image has.
        """
        images.check_size(size)
        if size == self.size:
            return self
        return self._with_pixels(
            self._pixels.resampled(size), [wish.resized(size) for wish in self.wishes]
        )

    def cropped(self, height: int, width: int) -> "Target":
        """Return the top left part of the target, of this size.

        Raises SizeError for a size that it does not have.
        """
        if not (0 < height <= self.size[0] and 0 < width <= self.size[1]):
            raise SizeError(
                f"the target is {self.size[1]}x{self.size[0]}, and has no part of {width}x{height}"
            )
        return self._with_pixels(
            self._pixels.cropped(height, width),
            [wish.cropped(height, width) for wish in self.wishes],
        )

    def reduced(self, factor: int) -> "Target":
        """Return the target averaged over blocks of factor × factor pixels, weighted by importance.

        The importance of a block is the mean over its pixels. For images that are constant in each
        block, the squared residual stays the same up to a constant. Raises
        SizeError where the target has no such blocks.
        """
        images.check_factor(self.size, factor)
        if factor == 1:
            return self
        return self._with_pixels(
            self._pixels.averaged(factor), [wish.reduced(factor) for wish in self.wishes]
        )

    @property
    def _pixels(self) -> TargetPixels:
        return TargetPixels(self.image, self.importance, self.at_least)

    def _with_pixels(self, pixels: TargetPixels, wishes: Sequence[Wish]) -> "Target":
        """Return the target with its pixels and wishes at another size."""
        share = self.painted_share
        return replace(self, **pixels._asdict(), full_size_share=share, wishes=tuple(wishes))

    def without(self, holes: npt.NDArray[np.bool_]) -> "Target":
        """Return the target with importance 0 in the pixels `holes`, (h, w), which the basis
        lacks. Raises SizeError for another shape, TargetError for an array of numbers.
        """
        check_shape("holes", holes, self.importance.shape, "the target's pixels", error=SizeError)
        if holes.dtype != np.bool_:
            raise TargetError(f"holes of {holes.dtype}: expected True and False")
        lost_mask = holes & (self.importance > 0)
        if not lost_mask.any():
            return self
        return replace(
            self,
            importance=np.where(holes, np.float32(0), self.importance),
            not_finite=self.not_finite + int(lost_mask.sum()),
        )

    def fitted_to(self, size: tuple[int, int], *, resize: bool) -> "Target":
        """Return the target at `size` (height, width) of the basis.

        A target with a square block of pixels for each pixel of the basis is averaged, for example
        if it was painted in full size for a basis on a reduced film. Raises SizeError if it has
        another size and must not be resampled.
        """
        images.check_size(size)
        if factor := images.whole_factor(self.size, size):
            return self.reduced(factor)
        if not resize:
            check_fits(self.title, self.size, size)
        (height, width), (mine_h, mine_w) = size, self.size
        if abs(width * mine_h / (height * mine_w) - 1) > 0.02:
            raise SizeError(
                self.title,
                f" is {mine_w}x{mine_h}, but the basis is {width}x{height}, "
                "of another aspect ratio: crop it to that ratio, since ",
                Hint("resize", True),
                " does not stretch",
            )
        return self.resized(size)


def check_fits(title: object, size: tuple[int, int], needed: tuple[int, int]) -> None:
    """Raise SizeError if a painting has no square block of pixels for each pixel of a basis.

    title: of the painting. size, needed: (height, width) of both.
    """
    if images.whole_factor(size, needed) is None:
        raise SizeError(
            title,
            f" is {size[1]}x{size[0]} but the basis is {needed[1]}x{needed[0]}: export it at that "
            "size, or ",
            PASS_RESIZE,
        )


def _check_is_light(title: str, image: Floats, counts: npt.NDArray[np.bool_]) -> None:
    """Raise TargetError for negative luminance. title: of the target in messages."""
    if negative_text := describe_negative(image, counts):
        raise TargetError(
            f"{title} has {negative_text}: expected light, which is never below 0; "
            "np.maximum(image, 0) cuts it off"
        )


def describe_negative(image: Floats, counts: npt.NDArray[np.bool_]) -> str:
    """Return where light is below 0, beyond what resampling leaves; "" if nowhere.

    image: (h, w, 3) linear. counts: (h, w), the pixels that are looked at.
    """
    brightness = np.where(counts & in_all_channels(np.isfinite(image)), luminance(image), 0)
    darkest = float(brightness.min())
    if darkest >= -NEGATIVE * float(np.abs(brightness).max()):
        return ""
    negative_count = int((brightness < 0).sum())
    return (
        f"a negative luminance in {negative_count} of {brightness.size} pixels, down to "
        f"{darkest:.3g}"
    )


def _check_range(title: str | Path, image: Floats, counts: npt.NDArray[np.bool_]) -> None:
    """Raise TargetError for light beyond all lamps, or next to nothing that is not black.

    title: of the target in messages.
    """
    peak = float(np.abs(image).max(initial=0, where=counts[..., None]))
    if peak > BRIGHTEST_PAINT or 0 < peak < DIMMEST:
        raise TargetError(
            title,
            f" has light up to {peak:.3g} where it counts: expected between "
            f"{DIMMEST:g} and {BRIGHTEST_PAINT:g}, or black; was it exported in another unit?",
        )


def share_of(importance: Floats) -> float:
    """Return the share of the pixels (h, w) with any paint, 0 to 1."""
    return float((importance > 0).mean())


def spoken_share(share: float) -> str:
    """Return a share of the pixels as text with three digits, such as `63.7 %`."""
    return f"{100 * share:.3g} %"


@dataclass(frozen=True)
class Painted:
    """The way a target was painted; see `Target`. view, stops: the transform; "" for none."""

    format: Literal["lightpaint-painting 1"] = FORMAT
    over_look: bool = False
    through_view: bool = False
    view: str = ""
    stops: float = 0.0

    @property
    def transform(self) -> ViewTransform | None:
        """The view transform of the painting, or None."""
        return ViewTransform(self.view, self.stops) if self.view else None


def write_painting(path: Path, target: Target) -> None:
    """Write a target as an EXR, from which `read_target` restores it to the last bit."""
    transform = target.transform
    name, stops = ("", 0.0) if transform is None else (transform.name, transform.stops)
    painted = Painted(FORMAT, target.over_look, target.through_view, name, stops)
    channels = rgb_channels(target.image) | {"W": target.importance.astype(np.float32)}
    if target.at_least is not None and target.at_least.any():
        channels |= rgb_channels(target.at_least.astype(np.float32), images.AT_LEAST)
    write_parts(path, [ExrPart("rgb", channels, {KEY: json.dumps(fields_of(painted))})])


def painted_of(attributes: Mapping[str, str], path: Path) -> Painted | None:
    """Return how the EXR at `path` was painted; None if it does not say. Raises TargetError."""
    if KEY not in attributes:
        return None
    try:
        return read_record(Painted, strict_json(attributes[KEY]))
    except ValueError as error:
        raise TargetError(path, f": its attribute {KEY} is damaged: {error}") from None
