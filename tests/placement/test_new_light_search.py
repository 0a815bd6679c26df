"""New lights are tried again at other places, those first that do least."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import lightpaint as lp
from lightpaint.lighting.unknowns.knobs import Knob
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.placement.freedom import FreeLight
from lightpaint.placement.lights_to_place import Arrangement, Movable
from lightpaint.placement.look_goals import LookGoal
from lightpaint.placement.placement_fit import PlacementFit
from lightpaint.placement.search.new_light_search import NewLightSearch
from lightpaint.scene.properties.site import Site

PIXELS = 60

#: What is painted needs each column at these weights, and some more that no column has.
LEVELS = (1.0, 0.05, 0.3)


class Search(NewLightSearch):
    """A search whose steps change nothing."""

    def _together(self, arrangement: Arrangement) -> Arrangement:
        return arrangement


@pytest.mark.parametrize(
    ("small_film", "large_film", "chosen"),
    [
        ((0.5, 0.4), (0.3, 0.6), 0),  # the larger film tells
        ((0.5, 0.6), (0.6, 0.3), 1),
        ((0.1, 0.05), (0.6, 0.3), 0),  # little is left: no other search
    ],
)
def test_the_better_of_two_searches_is_kept(
    small_film: tuple[float, ...], large_film: tuple[float, ...], chosen: int
) -> None:
    start: Any = SimpleNamespace(missed=1.0)
    found = [SimpleNamespace(missed=x) for x in small_film]
    errors = dict(zip(map(id, found), large_film, strict=True))
    stub: Any = SimpleNamespace(
        fit=SimpleNamespace(norm2=1.0), steps=None, paths=None, is_enough=lambda: False
    )
    judge: Any = SimpleNamespace(missed=lambda arrangement: errors[id(arrangement)])
    ends = iter(found)

    class Ends(NewLightSearch):
        def _grown(self, *_: Any) -> Any:
            return next(ends)

    assert Ends(stub, [], judge).run(start, lambda: None) is found[chosen]


@pytest.mark.parametrize(
    ("helps", "expected"),
    [
        ((), [1, 2]),  # the one that does most stays where it is
        ((1,), [1, 1, 2]),  # once something moves, again from the one that does least
        ((2,), [1, 2, 1]),
    ],
)
def test_lights_that_do_least_are_tried_first(helps: tuple[int, ...], expected: list[int]) -> None:
    rng = np.random.default_rng(3)
    columns = rng.random((3, PIXELS, 3)).astype(np.float32)
    goal = np.einsum("n,npc->pc", LEVELS, columns) + 0.3 * rng.random((PIXELS, 3))
    knobs = tuple(Knob.of_any_colour(k) for k in range(3))
    reduction = Reduction(np.zeros((3, 3)), ("a", "b", "c"), knobs)
    look = LookGoal(goal, np.ones_like(goal), reduction, None, np.zeros_like(goal))
    fit = PlacementFit(columns, [look])
    tried: list[int] = []

    def better(arrangement: Arrangement, k: int) -> Arrangement:
        tried.append(k)
        if k not in helps or tried.count(k) > 1:
            return arrangement
        return replace(
            arrangement, fitted=replace(arrangement.fitted, missed=arrangement.missed / 2)
        )

    group = lp.NewLights("point")
    sites = tuple(Site((float(k), 0.0, 0.0)) for k in range(3))
    movables = tuple(
        Movable(FreeLight(f"new_{k}", site, lp.Freedom()), (k,), None, group)
        for k, site in enumerate(sites)
    )
    stub: Any = SimpleNamespace(
        fit=fit, steps=None, paths=None, tried=better, is_enough=lambda: False
    )
    search = Search(stub, [], stub)
    search._tried_again(Arrangement(movables, sites, fit.fitted(columns)))
    assert tried == expected
