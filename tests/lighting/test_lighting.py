"""A lighting as a mapping of names, and what `combine` takes for one."""

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import lightpaint as lp
from lightpaint.batch.manifest.keys import shift, with_emission
from lightpaint.errors import LightingError, UnknownLightError
from lightpaint.lighting.answer.combination import dimmed

SIZE = (6, 5)


@pytest.fixture
def basis(make_basis: Any) -> lp.Basis:
    basis = make_basis(
        3, SIZE, names=("key", "lamp", "rest"), half_differences=np.ones((3, 6, 5, 3))
    )
    return _add_kept_light(basis)


def _add_kept_light(basis: lp.Basis) -> lp.Basis:
    *others, rest = basis.lights
    return replace(basis, lights=(*others, replace(rest, emission=(1.0,) * 3, is_fixed=True)))


@pytest.fixture
def lighting(basis: lp.Basis) -> lp.Lighting:
    return lp.Lighting.current(basis)


def test_a_lighting_is_a_mapping_of_names(basis: lp.Basis, lighting: lp.Lighting):
    assert lighting["lamp"] is lighting.lights[1]
    assert list(lighting) == list(basis.names)
    assert dict(lighting) == {light.name: light for light in lighting.lights}
    assert len(lighting) == 3
    assert "lamp" in lighting
    assert "lmap" not in lighting
    assert 3 not in lighting
    assert lighting.get("lmap") is None
    assert lighting == lp.Lighting.current(basis)
    assert hash(lighting) == hash(lp.Lighting.current(basis))
    assert pickle.loads(pickle.dumps(lighting)) == lighting


def test_an_unknown_name_is_one_line_and_a_key_error(lighting: lp.Lighting):
    with pytest.raises(KeyError) as error:
        lighting["lmap"]
    assert isinstance(error.value, UnknownLightError)
    assert isinstance(error.value, LightingError)
    assert str(error.value) == "no light 'lmap' in the lighting: it has key, lamp, rest"
    with pytest.raises(LightingError, match="no light 'lmap'"):
        lighting.with_emission("lmap", (1, 1, 1))


@pytest.mark.parametrize(
    ("weights_argument", "weights"),
    [
        ({"lamp": 2}, [[0] * 3, [2] * 3, [1] * 3]),
        ({"lamp": 2, "key": [1, 0.5, 0]}, [[1, 0.5, 0], [2] * 3, [1] * 3]),
        ({"rest": 1}, [[0] * 3, [0] * 3, [1] * 3]),
        ([0, 0, 1], [[0] * 3, [0] * 3, [1] * 3]),
        ([3, 2, 1], [[3] * 3, [2] * 3, [1] * 3]),
        (np.array([3, 2, 1], np.int8), [[3] * 3, [2] * 3, [1] * 3]),
        ([[1, 2, 3], [4, 5, 6], [1, 1, 1]], [[1, 2, 3], [4, 5, 6], [1] * 3]),
    ],
)
def test_combine_takes_weights(basis: lp.Basis, weights_argument: Any, weights: Any):
    expected = np.einsum("nhwc,nc->hwc", basis.images, weights)
    combined = lp.combine(basis, weights_argument)
    np.testing.assert_allclose(combined.image, expected, rtol=1e-5)
    np.testing.assert_allclose(
        combined.half_difference,
        np.broadcast_to(np.sum(weights, axis=0), combined.image.shape),
        rtol=1e-5,
    )


@pytest.mark.parametrize(
    ("invalid_weights", "words"),
    [
        ({}, "names no light: give the weight of one at least, like {'key': 1}, or an array of 3"),
        ({"lmap": 2}, "no light lmap in the basis: it has key, lamp, rest"),
        ({3: 2}, "no light 3 in the basis"),
        (
            {"lamp": [1, 2]},
            r"weights of the shape \(2,\): expected one number or \(3,\)",
        ),
        ({"lamp": "bright"}, "light 'lamp': weights of the type str"),
        ({"lamp": None}, "light 'lamp': .*expected"),
        ({"lamp": -1}, "light 'lamp': a weight of -1: expected finite numbers >= 0"),
        ({"lamp": np.inf}, "light 'lamp': a weight of inf"),
        ({"rest": 2}, "light 'rest' is fixed: its weight is 1"),
        (
            [1, 1],
            r"3 lights: weights of the shape \(2,\): expected \(3,\) or \(3, 3\)",
        ),
        (np.ones((3, 4)), r"weights of the shape \(3, 4\)"),
        (1.0, r"weights of the shape \(\)"),
        ([1, 2, 3], "light 'rest' is fixed"),
        ([np.nan, 1, 1], "a weight of nan"),
        ("evening", "a lighting of 3 lights: weights of the type str"),
        (None, "a lighting of 3 lights"),
    ],
)
def test_what_are_no_weights_is_refused_in_one_line(
    basis: lp.Basis, invalid_weights: Any, words: str
):
    with pytest.raises(LightingError, match=words) as refusal:
        lp.combine(basis, invalid_weights)
    assert "\n" not in str(refusal.value)


def test_no_claim_of_a_solve_outlives_its_emission(lighting: lp.Lighting):
    """Dimmed, shifted, mixed or chosen: what the basis cannot tell stays, unless it is chosen."""
    old = replace(
        lighting["key"],
        constraint="locked",
        is_active=True,
        standard_error=(0.1, 0.1, None),
        interval=((0.0, 1.0), (0.0, 1.0), None),
        reached=(True, True, False),
        untold=True,
    )
    solved = replace(lighting, lights=(old, *lighting.lights[1:]))
    whole = replace(old, reached=(True, True, True))
    shifted = shift(replace(lighting, lights=(whole, *lighting.lights[1:])), 60.0)
    results = {
        "dimmed": dimmed(solved, 0.5)["key"],
        "shifted": shifted["key"],
        "mixed": with_emission(old, (0.5, 0.25, 0.1)),
        "chosen": solved.with_emission("key", (0.5, 0.25, 0.1))["key"],
    }
    for name, light in results.items():
        claims = light.constraint, light.is_active, light.standard_error, light.interval
        assert claims == ("", False, None, None), name
        assert light.emission == light.weight != old.emission, name
        assert light.untold == (name != "chosen"), name
        assert light.reached == (old.reached if name in ("dimmed", "mixed") else (True,) * 3), name
