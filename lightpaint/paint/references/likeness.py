"""*Look like this* on the views of a session: layers that ask for the light of a reference, and the
changes of brightness and colour that make a picture look like it.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats, Slices, as_rgb
from lightpaint.colour import luminance
from lightpaint.errors import PaintError
from lightpaint.paint.layers.canvas import Canvas
from lightpaint.paint.layers.canvases import Canvases
from lightpaint.paint.layers.composition import adjusted
from lightpaint.paint.layers.layer_stack import MAX_NAME_LENGTH, Layer
from lightpaint.paint.presets import lighting_presets
from lightpaint.paint.presets.view_areas import Mask, ViewAreas
from lightpaint.paint.protocol import ApplyPreset, LookLike
from lightpaint.paint.references import reference_light
from lightpaint.paint.references.reference_table import ReferenceTable
from lightpaint.paint.references.tones import DETAIL_SIZE, Tones, Weights, edges
from lightpaint.paint.store.history_steps import Region

#: Heights of a part, in heights of the view.
HEIGHTS = 0.95 ** np.arange(19)

#: Rows or columns of a small picture that one line covers, and the share of edges in them above
#: which these tell no place from another.
LINE, PLAIN = 4, 0.75

#: Stops below the brightest parts of a view at which all is equally dark.
DARKEST = 7.0

Point = tuple[float, float]

#: Correlation of the edges of a reference and of a part of a view from which on they show one
#: place: parts of the shipped scenes under other lightings have .5 to .9, other places .47 at most.
SAME_PLACE = 0.5

#: Most stops by which tones and bands of the picture are made brighter or darker for a reference
#: of another place.
TONE_STOPS, BAND_STOPS = 1.0, 0.45


@dataclass(frozen=True)
class ViewPart:
    """A part of a view. All numbers are shares of the view.

    likeness: correlation of the edges of reference and part. is_mirrored: whether the reference
    shows it mirrored.
    """

    left: float
    top: float
    width: float
    height: float
    is_mirrored: bool
    likeness: float

    def place(self, x: float, y: float) -> Point:
        """Return the place in the view of one in the reference, both 0 to 1."""
        across = 1 - x if self.is_mirrored else x
        return self.left + self.width * across, self.top + self.height * y

    def slices(self, size: tuple[int, int]) -> Slices:
        """Return its rows and columns in a picture of the view of a size."""
        rows = slice(round(self.top * size[0]), round((self.top + self.height) * size[0]))
        columns = slice(round(self.left * size[1]), round((self.left + self.width) * size[1]))
        return rows, columns


def find_part(reference: Tones, light: Floats) -> ViewPart:
    """Return the part of a view, (h, w, 3) linear, whose edges are most like a reference's.

    All of it, with a likeness of 0, where there are hardly any edges to compare.
    """
    bright = float(np.quantile(luminance(light), 0.75))
    levels = np.log2(np.maximum(luminance(light), 0) + max(bright, 1e-30) * 2.0**-DARKEST)
    nowhere = ViewPart(0.0, 0.0, 1.0, 1.0, is_mirrored=False, likeness=0.0)
    found = _parts(reference, np.asarray(levels, np.float64))
    return max(found, key=lambda part: part.likeness, default=nowhere)


def _parts(reference: Tones, levels: Doubles) -> Iterator[ViewPart]:
    """Yield the likeliest part of the view for each height, and all of it."""
    theirs = edges(reference.levels, DETAIL_SIZE)
    theirs = (theirs - theirs.mean()) / max(float(theirs.std()), 1e-9)
    if _plainness(theirs) > PLAIN:
        return
    rows, columns = DETAIL_SIZE
    height, width = levels.shape
    aspect = reference.size[1] / reference.size[0]
    sizes = [(round(rows / x), round(columns * width / (x * height * aspect))) for x in HEIGHTS]
    for size in (DETAIL_SIZE, *sizes):
        if size[1] < columns:
            continue
        ours = edges(levels, size)
        windows = np.lib.stride_tricks.sliding_window_view(ours, DETAIL_SIZE)
        spread = np.maximum(windows.std(axis=(2, 3)), 0.2 * max(float(ours.std()), 1e-9))
        for is_mirrored in (False, True):
            edge = theirs[:, ::-1] if is_mirrored else theirs
            found = np.einsum("yxij,ij->yx", windows, edge) / edge.size / spread
            top, left = np.unravel_index(int(np.argmax(found)), found.shape)
            if _plainness(windows[top, left]) > PLAIN:
                continue
            yield ViewPart(
                float(left / size[1]),
                float(top / size[0]),
                columns / size[1],
                rows / size[0],
                is_mirrored,
                float(found[top, left]),
            )


def _plainness(edge: Doubles) -> float:
    """Return the share of edges (h, w) in a few rows or columns: 1 for the edge of one shadow."""
    squares = edge**2
    lines = squares.sum(axis=0), squares.sum(axis=1)
    most = max(float(np.convolve(x, np.ones(LINE), "valid").max()) for x in lines)
    return most / max(float(squares.sum()), 1e-30)


#: Most stops that an area is made brighter or darker, and that a channel of it is tinted.
MAX_STOPS, MAX_TINT = 3.0, 1.5

#: Changes that nobody sees: these are not asked for.
MIN_STOPS, MIN_TINT = 0.08, 0.04

#: Rounds in which the areas, which overlap, are brought near the reference.
ROUNDS = 3

#: Radius of the place that is compared, and of that which is changed, in longer sides.
SEEN_RADIUS, CHANGED_RADIUS = 0.03, 0.12

#: Parts of a picture by name, and their radius in longer sides.
PARTS = {
    f"{row} {column}".strip().capitalize(): (x, y)
    for y, row in ((0.2, "upper"), (0.5, ""), (0.8, "lower"))
    for x, column in ((0.15, "left"), (0.5, "middle"), (0.85, "right"))
}
PART_RADIUS = 0.15

#: Least share of the picture that an area has to have.
MIN_AREA = 0.004


@dataclass(frozen=True)
class LightArea:
    """An area that is compared, and changed.

    seen: weights of its pixels in a picture, or in the reference by `seen_there`. mask: where it is
    changed. has_level, has_color: whether its brightness and its colour are compared.
    max_stops: most by which it is made brighter or darker.
    """

    name: str
    seen: Callable[[Tones], Weights]
    mask: Callable[[ViewAreas], Mask]
    has_level: bool = True
    has_color: bool = True
    max_stops: float = MAX_STOPS
    seen_there: Callable[[Tones], Weights] | None = None


@dataclass(frozen=True)
class AreaChange:
    """A change of an area. tint: stops of each channel, of no luminance."""

    area: LightArea
    stops: float
    tint: Doubles

    @property
    def is_visible(self) -> bool:
        """True if anybody sees it."""
        return abs(self.stops) >= MIN_STOPS or float(np.abs(self.tint).max()) >= MIN_TINT

    def layer(self, number: int, group: int) -> Layer:
        """Return the layer of an id, in a group, that asks for this."""
        gains = 2.0**self.tint
        tint = as_rgb(gains / luminance(gains))
        gain = float(2.0**self.stops)
        return Layer(number, "adjust", self.area.name, group=group, gain=gain, tint=tint)


WHOLE_AREA = LightArea(
    "Everything", lambda tones: tones.whole, lambda view: view.whole, has_level=False
)

TONE_AREAS = (
    LightArea("Shadows", lambda tones: tones.shadows, lambda view: view.shadows),
    LightArea("Lit parts", lambda tones: tones.lit, lambda view: view.lit),
)


def _band_area(number: int, name: str) -> LightArea:
    return LightArea(name, lambda tones: tones.bands[number], lambda view: view.bands[number])


BAND_AREAS = tuple(_band_area(k, name) for k, name in enumerate(("Top", "Middle", "Bottom")))


def of_another_place(areas: Sequence[LightArea], max_stops: float) -> tuple[LightArea, ...]:
    """Return areas that are compared with another place, by brightness alone and up to some stops.

    Their colours there are as on other floors and ceilings.
    """
    return tuple(replace(area, has_color=False, max_stops=max_stops) for area in areas)


def spot_area(
    name: str, there: Point, here: Point, seen: float, changed: float, in_view: Point | None = None
) -> LightArea:
    """Return a soft spot. there, here: its middle (x, y) in the reference and in the part of the
    picture that is compared, from 0 to 1. seen, changed: radius that is compared, and changed, in
    longer sides. in_view: its middle in the whole picture, if that is another place.
    """
    return LightArea(
        name,
        lambda tones: tones.around(*here, seen),
        lambda view: view.around(*(in_view or here), changed),
        seen_there=lambda tones: tones.around(*there, seen),
    )


PART_AREAS = tuple(
    spot_area(name, place, place, PART_RADIUS, PART_RADIUS) for name, place in PARTS.items()
)


def part_areas(part: ViewPart) -> tuple[LightArea, ...]:
    """Return the nine parts of a reference, at the places of a view that it shows."""
    changed = PART_RADIUS * max(part.width, part.height)
    places = [(name, x, 1 - x if part.is_mirrored else x, y) for name, (x, y) in PARTS.items()]
    return tuple(
        spot_area(name, (x, y), (here, y), PART_RADIUS, changed, part.place(x, y))
        for name, x, here, y in places
    )


def changed_light(light: Floats, changes: Sequence[AreaChange], view: ViewAreas) -> Floats:
    """Return a picture (h, w, 3) linear, of a view, with changes."""
    return _changed(light, changes, [change.area.mask(view) for change in changes])


def find_changes(
    reference: Tones,
    light: Floats,
    view: ViewAreas,
    areas: Sequence[LightArea],
    *,
    part: ViewPart | None = None,
    matches_brightness: bool = False,
    keeps_brightness: bool = False,
) -> list[AreaChange]:
    """Return the changes of areas that bring a picture near a reference, without invisible ones.

    light: (h, w, 3) linear, the picture now. view: its areas. part: of the picture, that the
    reference shows; all of it by default, and of another place. matches_brightness: whether it
    becomes as bright as the reference as a whole; otherwise only differences within it count.
    keeps_brightness: whether the whole picture, the first area, is then made as bright as it was.
    """
    masks = [area.mask(view) for area in areas]
    usable = view.whole > 0
    seen = (slice(None), slice(None)) if part is None else part.slices(usable.shape)
    changes = [AreaChange(area, 0.0, np.zeros(3)) for area in areas]
    for _ in range(ROUNDS):
        for k, (area, mask) in enumerate(zip(areas, masks, strict=True)):
            if mask.mean() < MIN_AREA:
                continue
            tones = Tones(_changed(light, changes, masks)[seen], usable[seen])
            stops, tint = _difference(reference, tones, area, matches_brightness)
            changes[k] = AreaChange(
                area,
                float(np.clip(changes[k].stops + stops, -area.max_stops, area.max_stops)),
                np.clip(changes[k].tint + tint, -MAX_TINT, MAX_TINT),
            )
    if keeps_brightness and not matches_brightness:
        changes[0] = _steadied(changes, light, masks, usable)
    return [change for change in changes if change.is_visible]


def _steadied(
    changes: Sequence[AreaChange], light: Floats, masks: Sequence[Mask], usable: Bools
) -> AreaChange:
    """Return the change of the whole picture, the first, that leaves it as bright as it was.

    Areas overlap, so that brighter ones would make all of it brighter, round after round.
    """
    whole, *_ = changes
    before, after = (
        tones.tone(tones.whole)
        for tones in (Tones(x, usable) for x in (light, _changed(light, changes, masks)))
    )
    if before is None or after is None:
        return whole
    stops = float(np.clip(whole.stops + before.level - after.level, -MAX_STOPS, MAX_STOPS))
    return replace(whole, stops=stops)


def _difference(
    reference: Tones, tones: Tones, area: LightArea, matches_brightness: bool
) -> tuple[float, Doubles]:
    """Return how much brighter the reference is in an area, and its tint there, in stops."""
    there = reference.tone((area.seen_there or area.seen)(reference))
    here = tones.tone(area.seen(tones))
    if there is None or here is None:
        return 0.0, np.zeros(3)
    stops = 0.0
    if matches_brightness:
        stops = there.level - here.level
    elif area.has_level:
        whole_there, whole_here = reference.tone(reference.whole), tones.tone(tones.whole)
        assert whole_there is not None
        assert whole_here is not None
        stops = (there.level - whole_there.level) - (here.level - whole_here.level)
    return stops, there.chroma - here.chroma if area.has_color else np.zeros(3)


def _changed(light: Floats, changes: Sequence[AreaChange], masks: Sequence[Mask]) -> Floats:
    """Return a picture with these changes, as layers over it make them."""
    for change, mask in zip(changes, masks, strict=True):
        if change.stops or change.tint.any():
            layer = change.layer(1, 2)
            light = light + mask[..., None] * (adjusted(light, layer.gain, layer.tint) - light)
    return light


def open_request(
    canvases: Canvases, request: ApplyPreset | LookLike, references: ReferenceTable
) -> tuple[list[tuple[int, Region]], str]:
    """Put the layers that a request asks for on top, as an open change.

    Returns what changes, and the name of the step. Raises PaintError if it cannot be met.
    """
    if isinstance(request, ApplyPreset):
        changes = lighting_presets.open_preset(canvases, request.preset, request.subject)
        return changes, lighting_presets.PRESETS[request.preset].title
    reference = references[request.reference]
    name = f"Like {reference.name}"[:MAX_NAME_LENGTH]
    return _open_likeness(canvases, request, Tones(references.light(reference)), name)


def _open_likeness(
    canvases: Canvases, request: LookLike, reference: Tones, name: str
) -> tuple[list[tuple[int, Region]], str]:
    """Put the group of layers on top which makes a picture look like a reference of a name.

    Returns what changes, and the name of the step, which says what was found. The layers are found
    in one view. Layers of pairs apply there, others in all views.
    """
    view, part = request.view, None
    if request.areas != "pairs":
        view, part = _view_shown(canvases, request.view, reference)
    canvas = canvases[view]
    light, areas = lighting_presets.reduced_areas(
        canvas, canvas.image, reference_light.FINDING_SIDE
    )
    layers: list[Layer] = []
    found, asked = None, light
    if request.areas in ("whole", "regions") and part is None:
        found = reference_light.find_light(
            canvas, reference, light, areas, matches_brightness=request.matches_brightness
        )
        if found is not None:
            layers += found.layers
            asked = found.image
            if found.strength < 1:
                share = f", {round(100 * found.strength)} %"
                name = name[: MAX_NAME_LENGTH - len(share)] + share
    changes = _changes(canvas, request, reference, asked, areas, part, has_layers=bool(layers))
    layers += [change.layer(1, 1) for change in changes]
    if not layers:
        raise PaintError(f"{name}: the picture has that light already")
    first = canvases.next_layer
    group = first + len(layers)
    numbered = [replace(x, id=first + k, group=group) for k, x in enumerate(layers)]
    views = [view] if request.areas == "pairs" else range(len(canvases))
    masks = {k: _masks(canvases[k], found, changes) for k in views}
    return lighting_presets.open_group(
        canvases, [*numbered, Layer(group, "group", name)], masks
    ), name


def _changes(
    canvas: Canvas,
    request: LookLike,
    reference: Tones,
    light: Floats,
    areas: ViewAreas,
    part: ViewPart | None,
    *,
    has_layers: bool,
) -> list[AreaChange]:
    """Return the changes of areas that a request asks for, none that lead away from a reference.

    light: (h, w, 3) linear, with what is asked for so far, reduced. has_layers: whether that
    includes how bright it becomes.
    """
    changes = find_changes(
        reference,
        light,
        areas,
        compared_areas(request, reference, part),
        part=part,
        matches_brightness=request.matches_brightness and not has_layers,
        keeps_brightness=request.areas == "parts" or part is not None,
    )
    if part is not None or request.areas not in ("whole", "regions"):
        return changes
    tones, known = reference.light_tones, areas.whole > 0
    pictures = light, changed_light(light, changes, areas)
    before, after = (reference_light.distance_of(canvas, tones, x, known) for x in pictures)
    return changes if after <= before else []


def _view_shown(canvases: Canvases, first: int, reference: Tones) -> tuple[int, ViewPart | None]:
    """Return the view whose part a reference shows, and that part; None if it is another place.

    first: number of the view that is looked at first.
    """
    canvases[first]  # raises PaintError if there is no such view
    best: tuple[int, ViewPart | None] = first, None
    highest = SAME_PLACE
    for k in sorted(range(len(canvases)), key=lambda k: k != first):
        light, _ = lighting_presets.reduced_areas(
            canvases[k], canvases[k].image, reference_light.FINDING_SIDE
        )
        part = find_part(reference, light)
        if part.likeness >= highest:
            best, highest = (k, part), part.likeness
    return best


def _masks(
    canvas: Canvas, found: reference_light.LightLayers | None, changes: Sequence[AreaChange]
) -> list[Mask]:
    """Return the masks of the layers of a request in a view, within what is selected."""
    areas = ViewAreas.of_view(canvas.basis, canvas.image)
    masks = [] if found is None else found.masks(canvas.basis, areas)
    masks += [change.area.mask(areas) for change in changes]
    selected = lighting_presets.selected_mask(canvas)
    return [mask * selected for mask in masks]


def compared_areas(
    request: LookLike, reference: Tones, part: ViewPart | None
) -> Sequence[LightArea]:
    """Return the areas that a request compares, beside key and fill; the lowest layers first.

    part: of the view that the reference shows; None for another place. Raises PaintError for pairs
    without any.
    """
    if request.areas in ("whole", "regions"):
        has_regions = request.areas == "regions"
        if part is not None:
            return (WHOLE_AREA, *TONE_AREAS, *(part_areas(part) if has_regions else ()))
        tones = TONE_AREAS if reference_light.is_soft(reference.light_tones) else ()
        bands = BAND_AREAS if has_regions else ()
        return (
            *of_another_place(tones, TONE_STOPS),
            *of_another_place(bands, BAND_STOPS),
        )
    if request.areas == "parts":
        return (WHOLE_AREA, *(PART_AREAS if part is None else part_areas(part)))
    if not request.pairs:
        raise PaintError("no places to compare: press one in the reference, then in the picture")
    spots = [
        spot_area(f"Place {k + 1}", pair.reference, pair.picture, SEEN_RADIUS, CHANGED_RADIUS)
        for k, pair in enumerate(request.pairs)
    ]
    return [WHOLE_AREA, *spots]
