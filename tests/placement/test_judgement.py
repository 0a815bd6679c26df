"""Which changes are worth it, on images in place of paths."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from nightly import nightly

import lightpaint as lp
from lightpaint.arrays import Floats
from lightpaint.lighting.unknowns.knobs import Knob
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.placement.freedom import FreeLight
from lightpaint.placement.lights_to_place import Arrangement, Movable
from lightpaint.placement.look_goals import LookGoal
from lightpaint.placement.placement_fit import PlacementFit
from lightpaint.placement.search.judgement import FEW_FITS, NOTHING, WORTH, PlacementJudge
from lightpaint.placement.search.pose_steps import PoseSteps
from lightpaint.scene.properties.pose import Site

PIXELS = 4000
RNG = np.random.default_rng(5)
IMAGES = RNG.random((3, PIXELS, 3)) + 0.2


class Paths:
    """Images of lights, by their x coordinate, with noise of these paths alone."""

    def __init__(self, seed: int, noise: float) -> None:
        rng = np.random.default_rng(seed)
        halves = IMAGES + np.sqrt(2) * noise * rng.normal(size=(2, *IMAGES.shape))
        parts = [halves.mean(axis=0), (halves[0] - halves[1]) / 2]
        self._columns = np.concatenate(parts, axis=1).astype(np.float32)

    def columns(self, sites: Sequence[Site]) -> Floats:
        return np.asarray(self._columns[[int((site.position or (0, 0, 0))[0]) for site in sites]])


def found(levels: Sequence[float], noise: float = 0.01) -> Any:
    """Return which of three new lights the judge keeps, for a painting lit by all at `levels`."""
    goal = np.einsum("n,npc->pc", levels, IMAGES)
    knobs = tuple(Knob.of_any_colour(k) for k in range(3))
    reduction = Reduction(np.zeros((3, 3)), ("a", "b", "c"), knobs)
    look = LookGoal(goal, np.ones_like(goal), reduction, None, np.zeros_like(goal))
    fit = PlacementFit(np.zeros((3, 2 * PIXELS, 3), np.float32), [look])
    paths = [Paths(seed, noise) for seed in (1, 2)]
    steps = PoseSteps(fit, 1.0, lambda *_: True)
    judge = PlacementJudge(fit, steps, SimpleNamespace(refine=paths[0], judge=paths[1]))  # type: ignore[arg-type]
    sites = tuple(Site((float(k), 0.0, 0.0)) for k in range(3))
    group = lp.NewLights("point")
    movables = [
        Movable(FreeLight(f"new_{k}", site, lp.Freedom()), (k,), None, group)
        for k, site in enumerate(sites)
    ]
    nothing = Arrangement((), (), steps.fitted((), (), paths[0]))
    best = Arrangement(tuple(movables), sites, steps.fitted(movables, sites, paths[0]))
    return judge.worthwhile(nothing, best)


def test_a_dim_light_beside_a_bright_one_is_worth_it() -> None:
    """It removes nearly all that is missed without it, but little of what was missed at first."""
    its = found((1.0, 0.05, 0.0))
    assert [x.light.name for x in its.arrangement.movables] == ["new_0", "new_1"]
    assert NOTHING < its.gains[1] < WORTH
    assert its.after < 0.01 * its.gains[1]


def test_lights_that_fit_noise_alone_are_not_worth_it() -> None:
    its = found((1.0, 0.0, 0.0), noise=0.2)
    assert [x.light.name for x in its.arrangement.movables] == ["new_0"]


def test_a_negligible_light_is_not_worth_it() -> None:
    """However surely it is seen."""
    its = found((1.0, 0.005, 0.0), noise=1e-4)
    assert [x.light.name for x in its.arrangement.movables] == ["new_0"]


#: Pixels along a line, and the deviation of the noise of the light that stays.
LINE, NOISE = np.linspace(-3, 3, 100), 0.02


class LinePaths:
    """A pool of light around the x coordinate of a light, without noise."""

    def columns(self, sites: Sequence[Site]) -> Floats:
        pools = [np.exp(-((LINE - (x.position or (0, 0, 0))[0]) ** 2)) for x in sites]
        images = np.array(pools)[..., None] * np.ones(3)
        return np.concatenate([images, 0 * images], axis=1).astype(np.float32)


@pytest.mark.nightly
def test_errors_of_poses_and_levels_know_the_noise_of_lights_that_stay() -> None:
    """The scatter of a pose over bases, and what it adds to that of the level."""
    lamp = np.exp(-2 * np.square(LINE - 1))[:, None] * np.ones(3)
    goal = lamp + LinePaths().columns([Site((0.0, 0.0, 0.0))])[0, : LINE.size]
    knobs = tuple(Knob.of_any_colour(k) for k in range(2))
    reduction = Reduction(np.zeros((2, 3)), ("lamp", "pool"), knobs)
    look = LookGoal(goal, np.ones_like(goal), reduction, None, np.zeros_like(goal))
    start = Site((0.0, 0.0, 0.0))
    freedom = lp.Freedom(box=((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)))
    movables = (Movable(FreeLight("pool", start, freedom), (1,), None, None),)
    line: Any = LinePaths()
    paths: Any = SimpleNamespace(refine=line, judge=line, spread=line)
    seeds, rows = 30, []
    for seed in range(seeds):
        a, b = lamp + NOISE * np.random.default_rng(seed).normal(size=(2, LINE.size, 1))
        columns = np.zeros((2, 2 * LINE.size, 3), np.float32)
        columns[0] = np.concatenate([(a + b) / 2, (a - b) / 2])
        fit = PlacementFit(columns, [look])
        steps = PoseSteps(fit, 1.0, lambda *_: True)
        before = steps.fitted(movables, (start,), line)
        best = steps.descend(Arrangement(movables, (start,), before), line, 3)
        errors = PlacementJudge(fit, steps, paths).errors(best)
        level, there = best.fitted.weights[1, 0], before.weights[1, 0]
        place = (best.sites[0].position or (0, 0, 0))[0]
        rows.append((place, errors.poses[0].place, level, there, errors.levels[1, 0] * level))
    places, place_errors, levels, there, level_errors = np.array(rows).T
    # At the true pose the same bases give other levels: the difference is what the pose does.
    by_poses = np.var(levels - there, ddof=1)
    # Both variances are of `seeds` numbers, each with a relative standard error of √(2 / n).
    tolerance = 4 * np.sqrt(2 * 2 / seeds)
    for stated, true in ((place_errors, np.var(places, ddof=1)), (level_errors, by_poses)):
        ratio = np.mean(np.square(stated / FEW_FITS)) / true
        assert abs(np.log(ratio)) < tolerance


#: A film of few pixels, and the deviation of the noise of a painting relative to its light.
FILM, GRAIN = (24, 36), 0.1


class FilmPaths:
    """A narrow pool of light around the x and y of a light, without noise."""

    def columns(self, sites: Sequence[Site]) -> Floats:
        y, x = np.mgrid[-1 : 1 : FILM[0] * 1j, -1.5 : 1.5 : FILM[1] * 1j]
        places = [site.position or (0, 0, 0) for site in sites]
        pools = [np.exp(-8 * ((x - at) ** 2 + (y - up) ** 2)).ravel() for at, up, _ in places]
        images = 0.02 + np.array(pools)[..., None] * np.ones(3)
        return np.concatenate([images, 0 * images], axis=1).astype(np.float32)


@pytest.mark.parametrize("share", [1.0, nightly(0.1)])
def test_errors_of_poses_know_the_noise_of_the_painting(share: float) -> None:
    """As that of a render, which is strongest in the pool that tells where the light is."""
    start, film = Site((0.0, 0.0, 0.0)), FilmPaths()
    line: Any = film
    paths: Any = SimpleNamespace(refine=film, judge=film, spread=film)
    pixels = FILM[0] * FILM[1]
    goal = film.columns([start])[0, :pixels].astype(float)
    reduction = Reduction(np.zeros((1, 3)), ("pool",), (Knob.of_any_colour(0),))
    freedom = lp.Freedom(box=((-1.0, -1.0, 0.0), (1.0, 1.0, 0.0)))
    movables = (Movable(FreeLight("pool", start, freedom), (0,), None, None),)
    seeds, rows = 12, []
    for seed in range(seeds):
        noise = np.random.default_rng(seed).normal(size=(pixels, 1))
        look = LookGoal(
            goal * (1 + share * GRAIN * noise), np.ones_like(goal), reduction, None, 0 * goal
        )
        fit = PlacementFit(np.zeros((1, 2 * pixels, 3), np.float32), [look], [FILM])
        steps = PoseSteps(fit, 1.0, lambda *_: True)
        before = Arrangement(movables, (start,), steps.fitted(movables, (start,), line))
        best = steps.descend(before, line, 4)
        errors = PlacementJudge(fit, steps, paths).errors(best)
        x, y, _ = best.sites[0].position or (0, 0, 0)
        rows.append((x, y, errors.poses[0].place))
    x, y, place_errors = np.array(rows).T
    scatter = np.var(x, ddof=1) + np.var(y, ddof=1)
    # `seeds` numbers for each of two coordinates, and as many error bars of ten pixels or so.
    tolerance = 4 * np.sqrt(2 / (2 * seeds) + 2 / (10 * seeds))
    assert abs(np.log(np.mean(np.square(place_errors)) / scatter)) < tolerance
