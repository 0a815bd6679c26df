"""The contact sheet of lights: a picture for each, whatever its brightness, and none beside it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lightpaint.basis.light_basis import Basis
from lightpaint.report.contact_sheet import EDGE, GROUND, MAX_LIGHTS, _grid, light_sheet


def told(sheet: np.ndarray, basis: Basis) -> list[float]:
    """Mean difference from the ground in the picture of each light that has a place."""
    grid = _grid(min(len(basis.lights), MAX_LIGHTS), basis.size)
    tiles = []
    for k in range(min(len(basis.lights), MAX_LIGHTS)):
        x, y = grid.corner(k)
        interior = sheet[y + 4 : y + grid.height - 4, x + 4 : x + grid.width - 4]
        tiles.append(float(np.abs(interior.astype(float) - GROUND).mean()))
        assert (sheet[y - 1, x - 1 : x + grid.width + 1] == EDGE).all()
    return tiles


@pytest.fixture(autouse=True)
def _as_rendered(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is tested is where things are: the denoiser takes most of the time."""
    monkeypatch.setattr("lightpaint.report.contact_sheet.denoised", lambda image, _features: image)


@pytest.mark.parametrize("n", [1, 3, 12, 64, 80])
def test_every_light_has_its_picture(make_basis: Any, n: int) -> None:
    basis = make_basis(n, size=(6, 8))
    sheet = light_sheet(basis, title="a scene")
    assert sheet.dtype == np.uint8
    assert sheet.shape[1] < 2500
    assert min(told(sheet, basis)) > 50
    foot = sheet[-20:].reshape(-1, 3) != GROUND
    assert foot.any() == (n > MAX_LIGHTS)


def test_places_do_not_meet() -> None:
    for n in range(1, MAX_LIGHTS + 1):
        for size in ((9, 16), (16, 9), (1, 100), (100, 1)):
            grid = _grid(n, size)
            assert grid.columns * (grid.rows - 1) < n <= grid.columns * grid.rows
            width, height = grid.size(has_foot=False)
            corners = [grid.corner(k) for k in range(n)]
            assert len(set(corners)) == n
            assert all(x + grid.width < width for x, _ in corners)
            assert all(y + grid.height + grid.below <= height for _, y in corners)
            # All the room of a column belongs to the light in it.
            assert {x % (grid.width + grid.gap) for x, _ in corners} == {grid.gap}


def test_how_bright_a_light_is_does_not_change_its_picture(make_basis: Any) -> None:
    basis = make_basis(3, size=(6, 8))
    # Powers of two, so that nothing is rounded; all alike, so that shares are as they were.
    brighter = replace(basis, planes=basis.images * np.float32(1024))
    sheets = [light_sheet(x, title="") for x in (basis, brighter)]
    assert np.array_equal(*sheets)


def test_what_is_off_is_shown_as_it_would_be_and_what_is_not_there_is_not(make_basis: Any) -> None:
    images = np.random.default_rng(1).random((3, 6, 8, 3), np.float32)
    images[1] = 0
    basis = make_basis(images=images, emission=[[0, 0, 0], [1, 1, 1], [2, 1, 0]])
    off_tile, nowhere, on = told(light_sheet(basis, title=""), basis)
    assert min(off_tile, on) > 50
    assert nowhere < 10


@pytest.mark.nightly
def test_names_cannot_break_it(make_basis: Any) -> None:
    names = ["a\n\x1b[2J\r", "x" * 900, "灯\u202e\ud800"]
    basis = make_basis(3, size=(6, 8), names=names)
    plain = make_basis(3, size=(6, 8))
    sheets = [light_sheet(x, title=x.names[0]) for x in (basis, plain)]
    assert sheets[0].shape == sheets[1].shape
    # Whatever they are called, pictures and what is between columns stay as they are.
    grid = _grid(3, basis.size)
    for k in range(3):
        x, y = grid.corner(k)
        assert np.array_equal(*(s[y : y + grid.height, x : x + grid.width] for s in sheets))
        assert (sheets[0][grid.head :, x - grid.gap + 1 : x - 1] == GROUND).all()


def test_an_image_is_one_picture_its_map(make_basis: Any) -> None:
    names = ["bulb", *(f"sky.x{x}.y{y}" for y in range(3) for x in range(4)), "key"]
    radiances = [[1, 1, 1], *([[0.1, 0.1, 0.1]] * 4), *([[1, 0, 0]] * 4), *([[0.1] * 3] * 4)]
    basis = make_basis(14, size=(24, 32), names=names, emission=[*radiances, [1, 1, 1]])
    lights = [
        replace(light, plugin="envmap") if light.name.startswith("sky") else light
        for light in basis.lights
    ]
    basis = replace(basis, lights=basis.lights.__class__(tuple(lights), basis.lights.requests))
    sheet = light_sheet(basis, title="")
    grid = _grid(3, basis.size)
    assert sheet.shape[1] == grid.size(has_foot=False)[0]
    x, y = grid.corner(1)
    red = sheet[y + grid.height // 2, x + grid.width // 2]
    assert red[0] > 200
    assert red[1:].max() < 60
