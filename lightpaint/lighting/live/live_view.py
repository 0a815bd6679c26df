"""A view of a live painting, with sums that follow the brush, and its difference from the paint."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lightpaint.arrays import RGB, Doubles, Floats, Slices
from lightpaint.basis import Basis
from lightpaint.colour import ViewTransform
from lightpaint.lighting.analysis.appearance.delivery import ViewPictures, have_wishes_come
from lightpaint.lighting.analysis.appearance.display_difference import PaintComparison
from lightpaint.lighting.constraints.light_constraints import held_at_start
from lightpaint.lighting.live import live_sums
from lightpaint.lighting.loss.painting import affected_region, dark_threshold, find_glow_paint
from lightpaint.lighting.unknowns.lamps_in_view import GlowPaint
from lightpaint.target import Target

#: Pixels of a part of a row over which importance is summed.
SEGMENT_PIXELS = 64

#: Approximate number of blocks that are compared with the paint.
COMPARED_BLOCKS = 2**10


class LiveView:
    """A view whose painting changes under a brush, updated in place.

    image: (h, w, 3) linear; importance: (h, w). Painters write to these arrays, and then call
    `update`. layers: returns the wishes of its layers; by default, it has none. at_least: returns
    where brighter than the painting is as good, (h, w, 3); None for nowhere.
    """

    def __init__(
        self,
        basis: Basis,
        image: Floats,
        importance: Floats,
        layers: live_sums.LayerWishes = lambda _side: (),
        at_least: live_sums.AtLeast = lambda: None,
    ) -> None:
        self._own_basis, self._start = basis, dict[str, RGB]()
        self.basis, self._image, self._importance = basis, image, importance
        self.layers, self._at_least = layers, at_least
        self._counted = importance.copy()
        self._dark = dark_threshold(basis.current_look, basis.emitters_seen)
        self._transform: ViewTransform | None = None
        self._read((slice(0, len(importance)), slice(0, importance.shape[1])))
        self._sums = np.zeros((len(importance), -(-importance.shape[1] // SEGMENT_PIXELS), 2))
        self._count((slice(0, len(importance)), slice(0, importance.shape[1])))
        self._light: live_sums.PaintedTiles | None = None
        self._display: live_sums.SmallFilm | None = None

    @property
    def counts(self) -> Doubles:
        """The total importance of the paint, and the weight of the rest, (2,)."""
        return np.asarray(self._sums.sum(axis=(0, 1)))

    @property
    def is_painted(self) -> bool:
        """True if anything is painted."""
        return bool(self._sums[..., 0].any())

    @property
    def has_marks(self) -> bool:
        """True if brighter than the painting is as good anywhere: then no sums suffice."""
        at_least = self._at_least()
        return at_least is not None and bool(at_least.any())

    @property
    def paint(self) -> GlowPaint:
        """The painting, its importance, and where brighter is as good."""
        return self._image, self._counted, self._at_least()

    @property
    def pixels(self) -> int:
        """The number of pixels."""
        return self._importance.size

    def update(self, region: Slices, *, with_importance: bool = True) -> None:
        """Update the sums of a painted rectangle. with_importance: whether its importance changed,
        too.
        """
        region, is_other = self._read(region)
        with_importance = with_importance or is_other
        if with_importance:
            self._count(region)
        if self._light is not None:
            self._light.update(region, with_importance=with_importance)
        if self._display is not None:
            self._display.update(region)

    def replace_planes(self, basis: Basis, lights: Collection[int]) -> None:
        """Continue with a basis in which the planes of some lights, by number, are others."""
        self._own_basis, self._light = basis, None
        self.basis = held_at_start(basis, self._start)
        if self._start:  # whose look has the planes
            self._display = None
        if self._display is not None:
            self._display.replace_planes(basis, lights)

    def set_start(self, start: Mapping[str, RGB]) -> None:
        """Set the lighting to start from, emissions by name: its look holds what is unpainted."""
        if dict(start) != self._start:
            self._start = dict(start)
            self.basis = held_at_start(self._own_basis, self._start)
            self._light, self._display = None, None

    def tiles(self) -> live_sums.PaintedTiles:
        """Return the sums in linear light."""
        if self._light is None:
            self._light = live_sums.PaintedTiles(self.basis, self._image, self._counted)
        return self._light

    @property
    def has_film(self) -> bool:
        """True once `film` has averaged the picture."""
        return self._display is not None

    def film(
        self, transform: ViewTransform | None, max_pixels: int = live_sums.MAX_FILM_PIXELS
    ) -> live_sums.SmallFilm:
        """Return the picture in display space, of `max_pixels` at most."""
        if self._display is None:
            self._display = live_sums.SmallFilm(
                self.basis, self._image, self._counted, max_pixels, self._at_least
            )
            self._display.set_transform(transform)
        return self._display

    def small_picture(self, weights: Doubles) -> Floats:
        """Return the picture of a lighting averaged to the film's size, linear. weights: (n, 3)."""
        return self.film(self._transform).mix(weights)

    def draft(self, weights: Doubles) -> Floats:
        """Return the same picture but for round-off, sooner if few lights have changed since the
        last.
        """
        return self.film(self._transform).draft(weights)

    def averaged(self, image: Floats) -> Floats:
        """Return a picture (h, w, 3) averaged to the film's size."""
        return self.film(self._transform).average(image)

    def lights_at(self, row: int, column: int) -> Floats:
        """Return the light of each lamp at unit emission, averaged around a pixel, (n, 3)."""
        return self.film(self._transform).lights_at(row, column)

    def set_transform(self, transform: ViewTransform | None) -> None:
        """Set the view transform of the comparison."""
        if transform != self._transform:
            self._transform = transform
            self.update((slice(0, len(self._counted)), slice(0, self._counted.shape[1])))
        if self._display is not None:
            self._display.set_transform(transform)

    def _read(self, region: Slices) -> tuple[Slices, bool]:
        """Read the paint of a rectangle; return where it has an effect, and whether importance
        changed.

        Emitters in view whose paint wants no less light do not count.
        """
        wide = affected_region(region, self._counted.shape)
        seen = self.basis.emitters_seen[wide]
        if not seen.any():
            self._counted[region] = self._importance[region]
            return region, False
        # The surroundings of the emitters in this rectangle lie in a wider one.
        affected = affected_region(wide, self._counted.shape)
        importance = self._importance[affected]
        glows = find_glow_paint(
            self._image[affected],
            importance,
            self.basis.current_look[affected],
            self.basis.emitters_seen[affected],
            self._transform,
            dark=self._dark,
        )
        inner = tuple(
            slice(part.start - outer.start, part.stop - outer.start)
            for part, outer in zip(wide, affected, strict=True)
        )
        counted = np.where(glows, np.float32(0), importance)[inner]
        is_other = not np.array_equal(self._counted[wide], counted)
        self._counted[wide] = counted
        return wide, is_other

    def _count(self, region: Slices) -> None:
        """Sum importance anew over parts of rows.

        A sum of such sums has the same bits in whatever order strokes came.
        """
        rows, columns = region
        first, last = columns.start // SEGMENT_PIXELS, -(-columns.stop // SEGMENT_PIXELS)
        segment = rows, slice(first * SEGMENT_PIXELS, last * SEGMENT_PIXELS)
        a = self._counted[segment].astype(np.float64)
        unpainted = np.where(self.basis.emitters_seen[segment], 0, np.maximum(1 - a, 0))
        starts = np.arange(0, a.shape[1], SEGMENT_PIXELS)
        for k, values in enumerate((a, unpainted)):
            if a.size:
                self._sums[rows, first:last, k] = np.add.reduceat(values, starts, axis=1)


@dataclass(frozen=True)
class LiveDifference:
    """The paint of live views as they are now, with which pictures of their films are compared.

    layers: the wishes of each. display: the view transform of the display. compared: of the fit;
    None in linear light.
    """

    films: Sequence[live_sums.SmallFilm]
    layers: Sequence[live_sums.LayerWishes]
    display: ViewTransform
    compared: ViewTransform | None

    @cached_property
    def _look(self) -> PaintComparison:
        painted, weight, marks = (
            np.concatenate(parts, axis=-1)
            for parts in zip(*(film.paint for film in self.films), strict=True)
        )
        painted, weight, marks = (x[..., self._chosen].T[None] for x in (painted, weight, marks))
        return PaintComparison(painted, marks, weight, 1, self.display, self.compared)

    @cached_property
    def _chosen(self) -> slice:
        """The blocks that are compared: painted ones are among them unless few are painted."""
        weight = np.concatenate([film.paint[1] for film in self.films])
        step = max(int((weight > 0).sum()) // COMPARED_BLOCKS, 1)
        return slice(None, None, step if weight[::step].any() else 1)

    @cached_property
    def now(self) -> float:
        """The mean ΔE of the current lights."""
        return self.of(np.concatenate([film.look for film in self.films], axis=1))

    def of(self, picture: Doubles) -> float:
        """Return the mean ΔE of a picture (3, p) of all films."""
        look = self._look
        return look.mean(look.difference(look.pixels(picture[:, self._chosen].T[None])))

    def have_wishes_come(self, picture: Doubles) -> bool:
        """Return whether three quarters came of each wish, in a picture (3, p) of all films."""
        views, first = [], 0
        for film, layers in zip(self.films, self.layers, strict=True):
            last = first + film.look.shape[1]
            views.append(_painted_view(film, layers, picture[:, first:last]))
            first = last
        return have_wishes_come(views, self.display)


def _painted_view(
    film: live_sums.SmallFilm, layers: live_sums.LayerWishes, picture: Doubles
) -> ViewPictures:
    """Return a film as a view with a painting. picture: (3, p), of the answer."""
    size = film.size
    painted, weight, marks = film.paint

    def image(x: Doubles) -> Floats:
        return np.ascontiguousarray(x.T.reshape(*size, 3), np.float32)

    target = Target(
        "painting",
        image(painted),
        weight.reshape(size).astype(np.float32),
        everything=False,
        at_least=marks.T.reshape(*size, 3) if marks.any() else None,
        through_view=True,
        over_look=True,
        wishes=tuple(layers(film.side)),
    )
    return ViewPictures(target, film.has_emitters_alone, image(film.look), image(picture))
