"""The lights of a part of the picture: which one lights it alone, and what else is lit."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lightpaint.images.object_map import Objects
from lightpaint.lighting.analysis.appearance.answer_appearance import compare_appearance
from lightpaint.lighting.analysis.appearance.area_lights import AreaLights, lights_of_area
from lightpaint.lighting.default_solve import solve
from lightpaint.target.painted_target import Target

SIZE = (24, 48)

#: The left half is a wall, the right one the floor, with a box on it.
ALL, WALL, FLOOR, BOX = np.s_[:, :], np.s_[:, :24], np.s_[:, 24:], np.s_[12:, 36:]


def _room(make_basis: Any, *lights: list[tuple[Any, float]], **options: Any) -> Any:
    """Lights by what they light, and how much."""
    images = np.zeros((len(lights), *SIZE, 3), np.float32)
    for image, light in zip(images, lights, strict=True):
        for place, brightness in light:
            image[place] = brightness
    basis = make_basis(images=images, **{"emission": [[0.2] * 3] * len(lights), **options})
    index = np.zeros(SIZE, np.int32)
    index[FLOOR], index[BOX] = 1, 2
    return replace(basis, objects=Objects(index, ("back_wall", "floor", "big_box")))


def _area(place: Any) -> Any:
    area = np.zeros(SIZE, np.float32)
    area[place] = 1
    return area


def test_a_light_of_its_own_is_named_with_what_else_it_lights(make_basis: Any):
    """Not the brighter one, which lights all."""
    lights = [(WALL, 1.0), (BOX, 0.3)], [(ALL, 3.0)]
    for strength in (0.002, 0.2):
        emission = [[strength] * 3, [0.2] * 3]
        basis = _room(make_basis, *lights, names=["spot", "sky"], emission=emission)
        found = lights_of_area(basis, _area(WALL))
        assert found == AreaLights(("spot",), is_alone=True, name="back_wall", also="big_box")


def test_where_all_lights_light_the_rest_none_is_alone(make_basis: Any):
    sky = [(ALL, 1.0), (BOX, 2.0)]
    basis = _room(make_basis, sky, [(ALL, 0.1)], names=["sky", "lamp"])
    found = lights_of_area(basis, _area(WALL))
    assert found == AreaLights(("sky",), is_alone=False, name="back_wall", also="big_box")


@pytest.mark.parametrize(("count", "is_alone"), [(1, False), (2, False), (8, True)])
def test_lights_that_cover_a_part_together_light_it_alone(
    make_basis: Any, count: int, is_alone: bool
):
    """Each of them lights an eighth of the wall."""
    spots = [[(np.s_[:, 3 * k : 3 * k + 3], 1.0)] for k in range(count)]
    basis = _room(make_basis, *spots, [(ALL, 1.0)])
    found = lights_of_area(basis, _area(WALL))
    assert found is not None
    assert found.is_alone == is_alone


def test_without_light_or_rest_there_is_nothing_to_say(make_basis: Any):
    basis = _room(make_basis, [(FLOOR, 1.0)])
    assert lights_of_area(basis, _area(WALL)) is None
    assert lights_of_area(basis, np.ones(SIZE, np.float32)) is None
    assert lights_of_area(basis, np.zeros(SIZE, np.float32)) is None
    # Without a map of objects, none is named.
    nameless = replace(basis, objects=None)
    found = lights_of_area(nameless, _area(FLOOR))
    assert found == AreaLights((basis.names[0],), is_alone=True)


def test_an_answer_knows_the_lights_of_its_paint(make_basis: Any):
    """A wall that is to be much brighter, under one light for all."""
    basis = _room(make_basis, [(ALL, 1.0)], names=["sky"])
    look = basis.mix(basis.current_weights)
    image = look.copy()
    image[WALL] *= 3
    target = replace(Target.of(image, _area(WALL), name="t"), over_look=True)
    appearance = compare_appearance(solve(basis, target))
    assert appearance.lacks_light_of_its_own
    assert appearance.area_lights is not None
    assert appearance.area_lights.name == "back_wall"
