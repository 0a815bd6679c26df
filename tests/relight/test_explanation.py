"""What is said in words about noise and about what is missed."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lightpaint.relight.explanation import (
    halving_spp,
    how_sure,
    spoken_bound,
    spoken_difference,
    spoken_percent,
    spoken_place,
    what_is_missed,
)
from lightpaint.relight.report_diagnosis import missed_section, sure_section
from lightpaint.solve.diagnosis import Bound, Place, diagnose
from lightpaint.solve.solve import solve
from lightpaint.solve.uncertainty import error_bars
from lightpaint.target.target import Target

SIZE = (12, 12)


def _solved(make_basis: Any, **options: Any) -> Any:
    noise = np.random.default_rng(5).normal(0, 0.05, (3, *SIZE, 3))
    basis = make_basis(3, SIZE, half_differences=noise, **options)
    image = np.random.default_rng(1).random((*SIZE, 3)).astype(np.float32)
    target = Target("t", image, np.ones(SIZE, np.float32), everything=False)
    solution = solve(basis, target)
    return basis, solution, error_bars(basis, solution), diagnose(basis, target, solution)


@pytest.mark.parametrize(
    ("painted", "reached", "words"),
    [
        ((2, 2, 2), (1, 1, 1), "brighter"),
        ((1, 1, 1), (2, 2, 2), "darker"),
        ((0.5, 0.5, 1.5), (0.5, 0.5, 0.5), "bluer"),
        ((1, 1, 0.2), (1, 1, 1), "yellower"),
        ((0.2, 0.1, 0.1), (0.01, 0.02, 0.02), "brighter and redder"),
        ((1, 1, 1), (0, 0, 0), "brighter"),
        ((0, 0, 0), (1, 1, 1), "darker"),
        ((1.01, 1, 1), (1, 1, 1), "a little brighter"),
    ],
)
def test_difference_of_colours(painted: Any, reached: Any, words: str):
    assert spoken_difference(painted, reached) == words


@pytest.mark.parametrize(
    ("region", "where"),
    [
        ((0, 0), "is top left"),
        ((0, 1), "is at the top"),
        ((1, 1), "is in the middle"),
        ((1, 2), "is on the right"),
        ((2, 2), "is bottom right"),
    ],
)
def test_places(region: tuple[int, int], where: str):
    place = Place(region, 0.38, (0, 0, 1, 1), (1, 1, 4), (1, 1, 1))
    assert where in spoken_place(place)
    assert "(38 %): painted brighter and bluer than any mix of the lights" in spoken_place(place)


def test_bounds_and_percents():
    assert spoken_bound((1, 2, 3)) == "off"
    assert spoken_bound((0, 0, 3)) == "off in blue"
    assert [spoken_percent(x) for x in (0, 0.004, 0.07, 0.62)] == ["0 %", "0.4 %", "7 %", "62 %"]


def test_scatter_takes_four_times_the_samples_and_bias_twice(make_basis: Any):
    basis, _, found, _ = _solved(make_basis)
    scatter = replace(found, bias=np.zeros((3, 3)))
    bias = replace(found, scatter=np.zeros((3, 3)), bias=np.ones((3, 3)))
    assert halving_spp(basis, scatter, 0) == 4 * basis.origin.spp
    assert halving_spp(basis, bias, 0) == 2 * basis.origin.spp
    assert 128 <= halving_spp(basis, found, 0) <= 256


def test_the_light_that_matters_is_named(make_basis: Any):
    basis, solution, found, _ = _solved(make_basis)
    text = how_sure(basis, solution, found)
    assert "More samples would change light" in text
    assert "halves that" in text
    quiet = replace(found, scatter=0 * found.scatter, bias=0 * found.bias)
    assert "no noise" in how_sure(basis, solution, quiet)


def test_the_most_useful_comes_first(make_basis: Any):
    *_, found = _solved(make_basis)
    first, *rest = what_is_missed(found)
    assert first.startswith("Of what is missed (in energy), ")
    assert "no mix of the lights can reach" in first
    assert len(rest) <= 2
    met = replace(found, total=1e-9)
    assert what_is_missed(met) == ["The lights can do what is painted."]
    held = replace(found, bounds=(Bound("key", False, 0.5 * found.total, (0, 1, 1)),))
    assert "Light key is off in green and blue and still too much" in what_is_missed(held)[-1]
    kept = replace(found, bounds=(Bound("rest", True, 0.5 * found.total, (1, 1, 1)),))
    assert "Light rest is kept as it is" in what_is_missed(kept)[-1]


def test_names_are_escaped(make_basis: Any):
    names = ["<b>1", "<b>2", "<b>3"]
    basis, solution, found, diagnosis = _solved(make_basis, names=names)
    bound = Bound("<b>2", False, 0.5 * diagnosis.total, (1, 1, 1))
    diagnosis = replace(diagnosis, bounds=(bound,))
    current = basis.mix(basis.present_weights)
    page = sure_section(basis, solution, found)
    page += missed_section(solution, diagnosis, current, stops=0.0)
    assert "<b>" not in page
    assert "&lt;b&gt;2" in page
