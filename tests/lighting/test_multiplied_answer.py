"""Light groups of a renderer that multiplies in other primaries than Rec.709.

The renderer here is the file itself: its channels, as stored, are multiplied and added up.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from light_groups import interleaved

import lightpaint as lp
from lightpaint.basis import LightGroups
from lightpaint.colour import ACESCG, REC2020, from_rec709, primaries_in, to_rec709

SIZE = (12, 16)

#: Rounds end at a difference of 5e-5; lights of similar pictures are told apart less well.
ROUNDS, FOUND = 1e-4, 5e-3

#: ΔE of pictures that differ by as much.
NOTHING = 0.02


def coloured_room(folder: Path, primaries: tuple[float, ...]) -> tuple[LightGroups, Any]:
    """Three lights on walls of colours that Rec.709 has, and the layers as stored, (n, h, w, 3)."""
    rng = np.random.default_rng(4)
    walls = rng.uniform(0.05, 0.9, (*SIZE, 3))
    walls[:5], walls[5:8] = (0.8, 0.05, 0.03), (0.04, 0.7, 0.1)
    lamps = np.array([[1.0, 0.8, 0.5], [0.7, 0.9, 1.0], [1.0, 1.0, 1.0]])
    shade = rng.exponential(1, (3, *SIZE, 1))
    own = (shade * (walls @ from_rec709(primaries).T) * lamps[:, None, None]).astype(np.float32)
    layers = {f"RGBA_{name}": image for name, image in zip("abc", own, strict=True)}
    layers["RGBA"] = own.sum(axis=0)
    path = interleaved(folder / "room.exr", layers, header={"chromaticities": primaries})
    return lp.read_light_groups(path), own


def rendered(own: Any, primaries: tuple[float, ...], weights: Any) -> Any:
    """The picture of these multipliers of white lights, in Rec.709."""
    multipliers = np.asarray(weights) @ from_rec709(primaries).T
    return np.einsum("nhwc,nc,dc->hwd", own, multipliers, to_rec709(primaries)).astype(np.float32)


WEIGHTS = [[2.0, 0.5, 0.2], [0.3, 1.0, 1.5], [0.5, 0.4, 0.6]]


@pytest.mark.parametrize("primaries", [ACESCG, REC2020, primaries_in("P3-D65")])
def test_the_picture_is_what_the_renderer_shows(
    tmp_path: Path, primaries: tuple[float, ...]
) -> None:
    groups, own = coloured_room(tmp_path, primaries)
    shown = rendered(own, primaries, WEIGHTS)
    weights = [*WEIGHTS, [1, 1, 1]]
    np.testing.assert_allclose(groups.basis.mix(weights), shown, rtol=1e-5, atol=1e-5)
    apart = groups.basis.planes.mix(np.array(weights)) - shown
    assert np.sqrt(np.square(apart).mean() / np.square(shown).mean()) > 0.02


@pytest.mark.parametrize("primaries", [ACESCG, REC2020])
def test_light_is_found_in_the_primaries_of_the_renderer(
    tmp_path: Path, primaries: tuple[float, ...]
) -> None:
    groups, own = coloured_room(tmp_path, primaries)
    painting = rendered(own, primaries, WEIGHTS)
    solution = lp.solve(groups.basis, lp.Target.of(painting))
    np.testing.assert_allclose(solution.weights[:3], WEIGHTS, rtol=FOUND)
    [analysis] = lp.analyse(solution)
    assert analysis.appearance.delta_e < NOTHING
    # What was painted over stays what it was.
    now = rendered(own, primaries, np.ones((3, 3)))
    np.testing.assert_allclose(solution.basis.current_look, now, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("name", ["srgb", "filmic", "agx"])
def test_light_is_found_as_a_display_shows_it(tmp_path: Path, name: str) -> None:
    groups, own = coloured_room(tmp_path, ACESCG)
    painting = rendered(own, ACESCG, WEIGHTS)
    transform = lp.ViewTransform(name, -3.0)
    target = lp.Target.of(painting)
    solution = lp.solve(groups.basis, target, transform=transform, space="display", colors="free")
    shown = rendered(own, ACESCG, solution.weights[:3])
    predicted = solution.basis.predict(solution.weights).image
    error = np.sqrt(np.square(predicted - shown).mean() / np.square(shown).mean())
    assert error < ROUNDS
    assert lp.compare_appearance(solution).delta_e < NOTHING


def test_a_painting_out_of_reach_comes_closer_than_in_rec709(tmp_path: Path) -> None:
    groups, own = coloured_room(tmp_path, ACESCG)
    noise = np.random.default_rng(1).lognormal(0, 0.3, (*SIZE, 3))
    painting = (rendered(own, ACESCG, WEIGHTS) * noise).astype(np.float32)
    plain = replace(groups.basis, origin=replace(groups.basis.origin, primaries=()))
    missed, in_rec709 = (
        float(np.square(rendered(own, ACESCG, x.weights[:3]) - painting).sum())
        for x in (lp.solve(basis, lp.Target.of(painting)) for basis in (groups.basis, plain))
    )
    assert missed < in_rec709


def test_several_views_share_an_answer(tmp_path: Path) -> None:
    groups, own = coloured_room(tmp_path, ACESCG)
    bases = [groups.basis, groups.basis]
    painting = rendered(own, ACESCG, WEIGHTS)
    solution = lp.solve(bases, [lp.Target.of(painting)] * 2)
    np.testing.assert_allclose(solution.weights[:3], WEIGHTS, rtol=FOUND)


def test_a_basis_file_keeps_the_primaries(tmp_path: Path) -> None:
    groups, _ = coloured_room(tmp_path, ACESCG)
    lp.write_basis(tmp_path / "a.basis.exr", groups.basis)
    again = lp.read_basis(tmp_path / "a.basis.exr")
    assert again.origin == groups.basis.origin
    np.testing.assert_array_equal(again.mix(np.ones((4, 3))), groups.basis.mix(np.ones((4, 3))))
