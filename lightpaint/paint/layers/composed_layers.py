"""The layers of one view with their pixels, and the target that they come to. Updated in place.

The composition below a layer that is being painted or changed is kept until that changes. With it a
stroke costs the same however many layers lie below. It is computed in cells of the picture, when a
stroke first comes there.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Floats
from lightpaint.errors import PaintError
from lightpaint.images import block_sums
from lightpaint.paint.layers import layer_pixels
from lightpaint.paint.layers.composition import (
    AlbedoSource,
    GradientPixels,
    ShownLayer,
    compose,
    compose_importance,
    compose_over,
    with_effect,
)
from lightpaint.paint.layers.layer_stack import Layer, LayerStack
from lightpaint.paint.store.history_steps import Patch, Pixels, Region, Step, slices
from lightpaint.paint.store.session_file import StoredComposition
from lightpaint.target import Wish, separate

#: Importance of the rest of a fully painted picture relative to one layer, and the largest accent,
#: which compensates for a layer over a fortieth of the picture.
REST_SHARE, MAX_ACCENT = 4.0, 10.0


class LowerLayers:
    """The composition of some lower layers of a view.

    current: (h, w, 3) float32 linear, the look on which they lie.
    """

    def __init__(self, current: Floats) -> None:
        self.current = current
        self._layers: list[tuple[ShownLayer, int]] = []
        self._pixels = Pixels.unpainted(current)
        self._is_known = np.zeros((0, 0), bool)  # by cell

    def part(self, layers: Sequence[ShownLayer], region: Region) -> Pixels:
        """Return a copy of the composition of these layers, the lowest first, in a region."""
        if not layers:
            return Pixels.unpainted(np.array(self.current[slices(region)], np.float32))
        self._follow(layers, region)
        return self._pixels.part(region).copy()

    def importance(
        self, layers: Sequence[ShownLayer], region: Region
    ) -> npt.NDArray[np.float32] | None:
        """Return a copy of the importance of the same; None below the lowest layer."""
        if not layers:
            return None
        self._follow(layers, region)
        return self._pixels.importance[slices(region)].copy()

    def _follow(self, layers: Sequence[ShownLayer], region: Region) -> None:
        """Keep the composition of these layers, at least in a region."""
        revised = [(shown, shown.pixels.revision) for shown in layers]
        if revised != self._layers:
            height, width = self.current.shape[:2]
            self._layers, self._pixels = revised, Pixels.unpainted(self.current.copy())
            self._is_known = np.zeros(
                (-(-height // layer_pixels.TILE_SIDE), -(-width // layer_pixels.TILE_SIDE)), bool
            )
        self._complete(layers, region)

    def _complete(self, layers: Sequence[ShownLayer], region: Region) -> None:
        """Compose the cells of a region that are not known yet."""
        top, bottom, left, right = region
        height, width = self.current.shape[:2]
        rows = slice(top // layer_pixels.TILE_SIDE, -(-bottom // layer_pixels.TILE_SIDE))
        columns = slice(left // layer_pixels.TILE_SIDE, -(-right // layer_pixels.TILE_SIDE))
        unknown = ~self._is_known[rows, columns]
        if not unknown.any():
            return
        # A stroke comes to new cells side by side: the smallest block that has them all.
        ys, xs = (np.flatnonzero(unknown.any(axis=k)) for k in (1, 0))
        above, below = rows.start + int(ys[0]), rows.start + int(ys[-1]) + 1
        start, end = columns.start + int(xs[0]), columns.start + int(xs[-1]) + 1
        block = (
            *(above * layer_pixels.TILE_SIDE, min(below * layer_pixels.TILE_SIDE, height)),
            *(start * layer_pixels.TILE_SIDE, min(end * layer_pixels.TILE_SIDE, width)),
        )
        area = slices(block)
        on_look = Pixels.unpainted(np.array(self.current[area], np.float32))
        image, importance, at_least = compose_over(layers, on_look, block)
        self._pixels.image[area], self._pixels.importance[area] = image, importance
        if at_least is not None:
            if self._pixels.at_least is None:
                marks = np.zeros(self._pixels.image.shape, bool)
                self._pixels = self._pixels._replace(at_least=marks)
            assert self._pixels.at_least is not None
            self._pixels.at_least[area] = at_least
        self._is_known[above:below, start:end] = True


class Change(NamedTuple):
    """A change of a target. region: where it was composed again. with_importance: whether its
    importance changed there.
    """

    region: Region
    with_importance: bool = False


class ComposedLayers:
    """The layers of one view, and the target composed of them.

    Args:
        view: Index of the view.
        current: (h, w, 3) linear, the current look, on which they lie.
        layers: Those after `steps`.
        stored: Their composition on this current look, if it is known: then pixels of layers are
            read when they are needed.
        albedo: The albedo of the view, for gradients of light on surfaces.

    Attributes:
        target: Light and importance; `at_least` is None while no pixel is marked.
        albedo: Returns the albedo of the view.
    """

    def __init__(
        self,
        view: int,
        current: Floats,
        layers: LayerStack,
        steps: Sequence[Step],
        stored: StoredComposition | None = None,
        albedo: AlbedoSource = lambda: None,
    ) -> None:
        self._view, self._is_doubtful = view, False
        self._stack, self.albedo = layers, albedo
        self.current = np.asarray(current, np.float32)
        height, width = self.current.shape[:2]
        self.size = height, width
        known: Mapping[int, layer_pixels.LayerSummary] = {}
        if stored is not None:
            known = {
                number: layer_pixels.LayerSummary(*values)
                for number, values in stored.layers.items()
            }
        patches = _patches_by_layer(steps, view)
        self._pixels = {
            number: layer_pixels.LayerPixels.stored(
                self.size, patches.get(number, ()), known[number], self._doubt
            )
            if number in known
            else layer_pixels.LayerPixels.replayed(self.size, patches.get(number, ()))
            for number in layers.ids
        }
        self._shown = self._with_accents(layers)
        self._lower = LowerLayers(self.current)
        self._coverages: dict[tuple[int, int], tuple[tuple[ShownLayer, int], Floats]] = {}
        self.target = (
            compose(self._shown, self.current, self.full_region)
            if stored is None
            else stored.pixels.copy()
        )

    @property
    def full_region(self) -> Region:
        """Region of the whole view."""
        return (0, self.size[0], 0, self.size[1])

    def layer(self, number: int) -> layer_pixels.LayerPixels:
        """Return the pixels of a layer. Raises PaintError if there is none."""
        if number not in self._pixels:
            raise PaintError(f"there is no layer {number}")
        return self._pixels[number]

    def accent(self, number: int) -> float:
        """Return the accent of a layer, by which its paint counts more; 1 for a hidden one."""
        return next((shown.accent for shown in self._shown if shown.layer.id == number), 1.0)

    def loaded_wishes(self, side: int) -> tuple[Wish, ...]:
        """Return the wishes under the brush; none while the pixels of a layer were not read yet.

        side: as for `wishes`.
        """
        is_loaded = all(self._pixels[x.layer.id].is_loaded for x in self._shown)
        return self.wishes(side) if is_loaded else ()

    def wishes(self, side: int = 1) -> tuple[Wish, ...]:
        """Return what each visible layer covers and no layer above it, the lowest first.

        side: of the blocks of pixels that areas are averaged over.
        """
        shown = [x for x in self._shown if x.layer.kind != "weigh"]
        areas = [self._coverage(x, side) for x in shown]
        return tuple(
            Wish(
                self._stack[x.layer.id].name,
                area,
                layer=x.layer.id,
                group=self._group_name(x.layer.id),
                has_strokes=x.layer.kind in ("pixels", "paint"),
                is_exact=x.layer.kind == "adjust",
            )
            for x, area in zip(shown, separate(areas), strict=True)
            if area.any()
        )

    def _coverage(self, shown: ShownLayer, side: int) -> Floats:
        """Return how much of each block of pixels a layer covers, (h', w') from 0 to 1."""
        key, revision = (shown.layer.id, side), shown.pixels.revision
        if side > 1 and key in self._coverages and self._coverages[key][0] == (shown, revision):
            return self._coverages[key][1]
        coverage = np.zeros(self.size, np.float32)
        if not layer_pixels.is_empty(bounds := shown.pixels.bounds):
            coverage[slices(bounds)] = np.minimum(shown.pixels.coverage(bounds), 1)
        if side > 1:
            pixels = block_sums(np.ones(self.size, np.float32), side)
            coverage = np.asarray(block_sums(coverage, side) / pixels, np.float32)
            self._coverages[key] = (shown, revision), coverage
        return coverage

    def _group_name(self, number: int) -> str:
        """Return the name of the group of a layer; "" for one without."""
        group = self._stack[number].group
        return "" if group is None else self._stack[group].name

    def composition(self) -> StoredComposition:
        """Return a copy of the target, and what is known of the layers without their pixels."""
        layers = {number: pixels.summary for number, pixels in self._pixels.items()}
        return StoredComposition(layers, self.target.copy())

    def replace_current(self, current: Floats, albedo: AlbedoSource) -> None:
        """Compose the layers on another current look."""
        self.current = np.asarray(current, np.float32)
        self.albedo = albedo
        self._shown = self._with_accents(self._stack, self._shown)
        self._lower = LowerLayers(self.current)
        self.target = compose(self._shown, self.current, self.full_region)

    def put(self, number: int, region: Region, pixels: Pixels) -> Change:
        """Put pixels into a layer, and compose the layers there, unless it is hidden."""
        self.layer(number).put(region, pixels)
        numbers = [shown.layer.id for shown in self._shown]
        if number not in numbers:
            return Change((0, 0, 0, 0))
        return self._compose(region, numbers.index(number))

    def show(self, layers: LayerStack, steps: Sequence[Step], *, at_rest: bool) -> Change:
        """Show other layers, or layers with other properties, and compose where that is seen.

        steps, at_rest: as for `Canvas.show`.
        """
        missing = set(layers.ids) - set(self._pixels)
        patches = _patches_by_layer(steps, self._view) if missing and steps else {}
        for number in missing:
            self._pixels[number] = layer_pixels.LayerPixels.replayed(
                self.size, patches.get(number, ())
            )
        before = self._shown
        self._stack = layers
        self._shown = self._with_accents(layers, None if at_rest else before)
        same_below = _equal_count(before, self._shown)
        same_above = _equal_count(before[same_below:][::-1], self._shown[same_below:][::-1])
        changed = [
            *before[same_below : len(before) - same_above],
            *self._shown[same_below : len(self._shown) - same_above],
        ]
        self._pixels = {number: self._pixels[number] for number in layers.ids}
        if _without_accents(before) == _without_accents(self._shown):
            bands = [band for shown in changed for band in shown.pixels.bands]
            return self._compose_importance(bands, same_below)
        return self._compose(
            layer_pixels.enclosing([shown.pixels.bounds for shown in changed]), same_below
        )

    def _with_accents(
        self, layers: LayerStack, before: Sequence[ShownLayer] | None = None
    ) -> list[ShownLayer]:
        """Return the layers that show. before: those whose accents are kept."""
        pairs = [
            with_effect(layer, self._pixels[layer.id], self.albedo) for layer in layers.shown()
        ]
        kept = {} if before is None else {shown.layer.id: shown.accent for shown in before}
        return [
            ShownLayer(layer, pixels, kept.get(layer.id, now))
            for (layer, pixels), now in zip(pairs, accents(pairs), strict=True)
        ]

    def _compose(self, region: Region, start: int) -> Change:
        """Compose the layers again in a region.

        start: number of visible layers, the lowest ones, that have not changed.
        """
        if layer_pixels.is_empty(region):
            return Change(region)
        below = self._lower.part(self._shown[:start], region)
        image, importance, at_least = compose_over(self._shown[start:], below, region)
        if self._is_doubtful:
            region = self._load_all()
            image, importance, at_least = compose(self._shown, self.current, region)
        area, target = slices(region), self.target
        with_importance = not np.array_equal(target.importance[area], importance)
        target.image[area], target.importance[area] = image, importance
        if at_least is not None and target.at_least is None:
            self.target = target = target._replace(at_least=np.zeros(target.image.shape, bool))
        if target.at_least is not None:
            target.at_least[area] = False if at_least is None else at_least
        return Change(region, with_importance)

    def _compose_importance(self, bands: Sequence[Region], start: int) -> Change:
        """Compose importance alone again in some bands, after a change of accents alone.

        start: as for `_compose`.
        """
        changed_regions = []
        for top in {band[0] for band in bands}:
            region = layer_pixels.enclosing([band for band in bands if band[0] == top])
            below = self._lower.importance(self._shown[:start], region)
            importance = compose_importance(self._shown[start:], below, region)
            if self._is_doubtful:
                return self._compose(self.full_region, 0)
            target = self.target.importance[slices(region)]
            changed_regions.append(_bounds_of(importance != target, region))
            target[...] = importance
        region = layer_pixels.enclosing(changed_regions)
        return Change(region, with_importance=not layer_pixels.is_empty(region))

    def _doubt(self) -> None:
        """Note that a layer was not as its stored composition had it."""
        self._is_doubtful = True

    def _load_all(self) -> Region:
        """Read all layers, whose stored composition was wrong; return the whole region."""
        for pixels in self._pixels.values():
            pixels.load()
        pairs = [(shown.layer, shown.pixels) for shown in self._shown]
        self._shown = [
            ShownLayer(layer, pixels, accent)
            for (layer, pixels), accent in zip(pairs, accents(pairs), strict=True)
        ]
        self._is_doubtful = False
        return self.full_region


def accent(part: float) -> float:
    """Return the factor by which a layer over that part of a fully painted picture counts more."""
    if part <= 0:
        return MAX_ACCENT
    return min(MAX_ACCENT, max(1.0, (1 - part) / (REST_SHARE * part)))


def accents(
    layers: Sequence[tuple[Layer, layer_pixels.LayerPixels | GradientPixels]],
) -> list[float]:
    """Return the accent, by which its paint counts more, of each visible layer in one view.

    It depends on their coverage alone, and not on when they were made.
    """
    covering = [layer.id for layer, pixels in layers if pixels.covers_all]
    return [
        accent(pixels.mean_coverage) if set(covering) - {layer.id} else 1.0
        for layer, pixels in layers
    ]


def _patches_by_layer(steps: Sequence[Step], view: int) -> dict[int, list[Patch]]:
    """Return the patches of a view, in order, by the layer that they change."""
    patches: dict[int, list[Patch]] = {}
    for patch in (patch for step in steps for patch in step.patches):
        if patch.view == view:
            patches.setdefault(patch.layer, []).append(patch)
    return patches


def _without_accents(shown: Sequence[ShownLayer]) -> list[tuple[object, object]]:
    return [(layer, pixels) for layer, pixels, _ in shown]


def _bounds_of(changed: Bools, region: Region) -> Region:
    """Return the smallest region of changed pixels. changed: (rows, columns) of a region."""
    rows, columns = (np.flatnonzero(changed.any(axis=k)) for k in (1, 0))
    top, _, left, _ = region
    if not len(rows):
        return top, top, left, left
    return (
        top + int(rows[0]),
        top + int(rows[-1]) + 1,
        left + int(columns[0]),
        left + int(columns[-1]) + 1,
    )


def _equal_count(first: Sequence[ShownLayer], second: Sequence[ShownLayer]) -> int:
    """Return how many of the first layers are the same."""
    pairs = enumerate(zip(first, second, strict=False))
    return next((k for k, (one, other) in pairs if one != other), min(len(first), len(second)))
