"""Frozen paths of all views together, with their pixels concatenated."""

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.images import Features
from lightpaint.placement.free_space import (
    CLEARANCE,
    FreeSpace,
    free_space,
    is_clear,
    seen_by_camera,
)
from lightpaint.placement.paths.frozen_paths import FrozenPaths
from lightpaint.placement.paths.panel_lights import PanelSite, SightLines
from lightpaint.scene import Scene, Stream, loaded_features, pass_seed
from lightpaint.scene.properties.site import Site
from lightpaint.scene.runtime.render_lock import tracing

#: First hits per pixel, and continued paths, to rank and compare candidates on small films.
COARSE_SAMPLES = ((1, 0), (16, 16))

#: Approximate number of first hits on a larger film, in each of two halves, to refine and judge
#: candidates and to measure the spread of places; the smallest and largest side of their grid in a
#: pixel; and the share of them that continue as paths.
FINE_HITS, FINE_SIDES, CONTINUED_SHARE = 2**17, (3, 6), 1

#: Side of the grid of first hits in pixels that would otherwise be nothing but noise, and in those
#: this near to them, where a small move of the light makes noise as well.
NOISY_SIDE, NOISY_AROUND = 32, 2

#: Largest number of vertices after first hits that take the light of a place.
SHARED = 2**13, 2**13

#: Number of independent sets of paths per view.
SETS = 10


class ViewPaths:
    """Frozen paths of views, each on its small film.

    other_half: as many independent paths, which give the noise of both.
    """

    def __init__(
        self, parts: Sequence[FrozenPaths], other_half: Sequence[FrozenPaths] = ()
    ) -> None:
        self.parts, self._other_half = tuple(parts), tuple(other_half)

    def with_more_hits(self, noisy: Bools) -> "ViewPaths":
        """Return the paths with many more first hits around some of all pixels, (p,)."""
        edges = np.cumsum([math.prod(part.size) for part in self.parts])[:-1]
        pixels = [
            np.flatnonzero(_around(its.reshape(part.size)))
            for its, part in zip(np.split(noisy, edges), self.parts, strict=True)
        ]
        halves = [
            [
                part.with_more_hits(its, NOISY_SIDE) if len(its) else part
                for part, its in zip(half, pixels, strict=False)
            ]
            for half in (self.parts, self._other_half)
        ]
        return ViewPaths(*halves)

    def columns(self, sites: Sequence[Site]) -> Floats:
        """Return the images of lights at unit emission, (k, p, 3), p being all pixels.

        With two halves (k, 2 p, 3): their means, followed by half their differences. With a panel
        among them (…, 4): the share of each pixel that it hides, in both parts.
        """
        halves = [
            np.concatenate(
                [part.columns(sites).reshape(len(sites), math.prod(part.size), 3) for part in half],
                axis=1,
            )
            for half in (self.parts, self._other_half)
            if half
        ]
        if len(halves) == 1:
            [columns] = halves
        else:
            one, other = halves
            columns = np.concatenate([(one + other) / 2, (one - other) / 2], axis=1)
        if not any(isinstance(site, PanelSite) for site in sites):
            return columns
        hidden = [np.concatenate([part.hidden(site) for part in self.parts]) for site in sites]
        hidden_shares = np.tile(np.stack(hidden), len(halves))
        return np.concatenate([columns, hidden_shares[:, :, None]], axis=2)

    def indices(self) -> Indices:
        """Return the index among all pixels of the pixel of each first hit, (v,)."""
        starts = np.cumsum([0, *(part.size[0] * part.size[1] for part in self.parts)])
        pixels = [
            part.direct.pixels + start for part, start in zip(self.parts, starts, strict=False)
        ]
        return np.concatenate(pixels)

    @cached_property
    def points(self) -> Floats:
        """The first hits, (v, 3)."""
        return np.concatenate([part.points(part.direct) for part in self.parts])

    def contributions(self, sites: Sequence[Site]) -> Floats:
        """Return contributions at each first hit, (k, v, 3), as if lights shone all around."""
        parts = [part.contributions(part.direct, sites) for part in self.parts]
        return np.concatenate(parts, axis=1)

    @cached_property
    def eyes(self) -> list[Doubles]:
        """The places of the cameras that see panels, (3,) each."""
        origins = [its.origins[0] for its in self.sight_lines()]
        return [rows.mean(axis=0, dtype=float) for rows in origins if len(rows)]

    def lit_place(self, site: Site) -> Doubles | None:
        """Return the place, (3,), that a spot points at; None if nothing is there."""
        import mitsuba as mi

        origin, axis = (np.array(its or (0.0, 0.0, 1.0)) for its in (site.position, site.direction))
        ray = mi.Ray3f(mi.Point3f(*origin.tolist()), mi.Vector3f(*axis.tolist()))
        with tracing():
            hit = self.parts[0].loaded.ray_intersect_preliminary(ray)
            distance = float(np.array(hit.t).ravel()[0])
        return np.asarray(origin + distance * axis) if math.isfinite(distance) else None

    def sight_lines(self) -> list[SightLines]:
        """Return the lines of sight of each view that shows panels, with indices of all pixels."""
        starts = np.cumsum([0, *(math.prod(part.size) for part in self.parts)])
        return [
            replace(part.sight_lines, pixels=part.sight_lines.pixels + start)
            for part, start in zip(self.parts, starts, strict=False)
            if not part.hides_panels
        ]


class SearchPaths:
    """All paths of a search, made on first use.

    It uses two films. Places all over the scene are compared on a small one. That loses highlights
    on metal and edges of shadows, so the last steps and the judgement use a larger one.

    Args:
        small, large: The scenes on small and on larger films, which differ in the sensor alone.
        loaded: The larger ones, loaded.
        seed: Of the paths.
    """

    def __init__(
        self, small: Sequence[Scene], large: Sequence[Scene], loaded: Any, *, seed: int
    ) -> None:
        self._small, self._large, self.loaded, self._seed = small, large, loaded, seed
        self._noisy: Bools | None = None
        self._features = [loaded_features(view, loaded, seed) for view in large]
        self.space = FreeSpace.of_views([free_space(view, loaded, seed=seed) for view in large])

    @cached_property
    def rank(self) -> ViewPaths:
        """Few first hits, for direct light."""
        return self._coarse(0)

    @cached_property
    def compare(self) -> ViewPaths:
        """Paths for trials."""
        return self._coarse(1)

    @cached_property
    def refine(self) -> ViewPaths:
        """Paths on the larger films, for the last steps."""
        return self._fine(2)

    @cached_property
    def judge(self) -> ViewPaths:
        """Independent paths in equal number, for the judgement."""
        return self._fine(3)

    @cached_property
    def spread(self) -> ViewPaths:
        """Further independent paths in equal number, for the spread of places."""
        return self._fine(4)

    def with_more_hits(self, noisy: Bools) -> "SearchPaths":
        """Return the paths with many more first hits in some pixels, (p,), of the larger films."""
        paths = copy(self)
        paths.refine, paths.judge = (its.with_more_hits(noisy) for its in (self.refine, self.judge))
        paths._noisy = noisy
        return paths

    def in_view(self, places: Floats) -> Bools:
        """Return which places any camera sees, (k,)."""
        seen = [seen_by_camera(view, self.loaded, places) for view in self._large]
        return np.asarray(np.any(seen, axis=0))

    def clear(self, places: Floats) -> Bools:
        """Return which places, (k,), are clear of surfaces."""
        return is_clear(self.loaded, places, CLEARANCE * self.space.spread)

    def usable(self, places: Floats, clear: float | None = None) -> Bools:
        """Return which places, (k,), are clear of surfaces and see something of the picture."""
        return self.space.usable(self.loaded, places, clear)

    def _coarse(self, k: int) -> ViewPaths:
        features = [
            view_features.reduced(view_features.size[0] // view.size[0])
            for view_features, view in zip(self._features, self._small, strict=True)
        ]
        return ViewPaths(self._made(k, self._small, features, COARSE_SAMPLES[k]))

    def _fine(self, k: int) -> ViewPaths:
        pixels = sum(math.prod(view.size) for view in self._large)
        side = round(float(np.clip(math.sqrt(FINE_HITS / pixels), *FINE_SIDES)))
        samples = side**2, max(1, round(CONTINUED_SHARE * side**2))
        halves = [self._made(2 * k + j, self._large, self._features, samples) for j in range(2)]
        paths = ViewPaths(*halves)
        return paths if self._noisy is None else paths.with_more_hits(self._noisy)

    def _made(
        self, k: int, views: Sequence[Scene], features: Sequence[Features], samples: tuple[int, int]
    ) -> list[FrozenPaths]:
        view_paths = []
        for j, (view, view_features) in enumerate(zip(views, features, strict=True)):
            paths = FrozenPaths(
                view,
                self.loaded,
                first_hits=samples[0],
                bounces=samples[1],
                shared=SHARED[views is self._large],
                seed=pass_seed(self._seed, Stream.FROZEN_PATHS, k + SETS * j),
            )
            view_paths.append(paths.filtered_along(view_features))
        return view_paths


def _around(chosen: Bools) -> Bools:
    """Return the pixels, (h, w), at most `NOISY_AROUND` from chosen ones."""
    height, width = chosen.shape
    wide = np.pad(chosen, NOISY_AROUND)
    side = range(2 * NOISY_AROUND + 1)
    return np.asarray(
        np.any([wide[y : y + height, x : x + width] for y in side for x in side], axis=0)
    )
