"""A reference of this place is found in the view, and one of another never leads away from it."""

from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from nightly import seeds

import lightpaint as lp
from lightpaint.basis.lights import Lights
from lightpaint.colour.color import luminance
from lightpaint.errors import PaintError
from lightpaint.paint.protocol import LookLike
from lightpaint.paint.references.likeness import find_part
from lightpaint.paint.references.reference_light import (
    contrast_of_light,
    distance_of,
    light_distance,
)
from lightpaint.paint.references.tones import LightTones, Tones
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.session_file import MemoryStore
from lightpaint.pipeline.job.settings import Settings

H, W = 54, 96

TRANSFORM = lp.ViewTransform()


def furniture(seed: int) -> np.ndarray:
    """Return surfaces (h, w) of a place: boxes of different greys."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:H, :W]
    grey = np.full((H, W), 0.5)
    for _ in range(40):
        top, left = rng.uniform(0, H), rng.uniform(0, W)
        height, width = rng.uniform(4, 16, 2)
        inside = (abs(y - top) < height / 2) & (abs(x - left) < width / 2)
        grey[inside] = rng.uniform(0.08, 0.8)
    return grey


def lit_place(make_basis: Any) -> lp.Basis:
    """A place under an even sky, with a patch of sun at its left and one of a spot at its right."""
    x = np.mgrid[:H, :W][1] / W
    lamps = {
        "sky": ("constant", 0.5 * np.ones((H, W))),
        "sun": ("directional", np.where(x < 0.25, 0.5, 0.005)),
        "spot": ("spot", np.where(np.abs(x - 0.85) < 0.1, 0.4, 0.004)),
    }
    images = [(furniture(1) * light)[..., None] * np.ones(3) for _, light in lamps.values()]
    basis: lp.Basis = make_basis(
        images=np.array(images), names=list(lamps), emission=[[0.3] * 3] * 3
    )
    lights = [
        replace(light, plugin=plugin)
        for light, (plugin, _) in zip(basis.lights, lamps.values(), strict=True)
    ]
    return replace(basis, lights=Lights.of(lights))


def session_in(*bases: lp.Basis) -> Session:
    looks = [basis.current_look for basis in bases]
    store = MemoryStore(Identity.of(list(bases)))
    return Session(list(bases), looks, store, settings=Settings(), transform=TRANSFORM)


def ask(session: Session, light: np.ndarray, areas: str = "regions") -> Tones:
    """Ask for the light of a picture; return it as a session has it."""
    pixels = np.round(255 * TRANSFORM.encode(light)).astype(np.uint8)
    reference = session.references.add("evening", pixels)
    session.handle(LookLike(reference.id, areas), {})  # type: ignore[arg-type]
    return Tones(session.references.light(reference))


@pytest.mark.parametrize("is_mirrored", [False, True])
@pytest.mark.parametrize(("top", "left", "share"), [(0, 0, 1), (9, 20, 2 / 3), (20, 6, 0.6)])
def test_a_part_of_a_view_is_found_under_any_light(
    top: int, left: int, share: float, is_mirrored: bool
) -> None:
    light = furniture(1)[..., None] * np.ones(3)
    gradient = np.linspace(0.2, 1, W)[:, None] * [1, 0.7, 0.4]
    rows = slice(top, top + round(share * H))
    columns = slice(left, left + round(share * W))
    shown = (light * gradient)[rows, columns]
    part = find_part(Tones(shown[:, ::-1] if is_mirrored else shown), light)
    assert part.likeness > 0.6
    assert part.is_mirrored == is_mirrored
    found = [part.top * H, part.left * W, part.height * H]
    np.testing.assert_allclose(found, [top, left, round(share * H)], atol=0.05 * W)


def test_other_places_are_not_taken_for_a_part() -> None:
    light = furniture(1)[..., None] * np.ones(3)
    for seed in range(2, 12):
        assert find_part(Tones(furniture(seed)[..., None] * np.ones(3)), light).likeness < 0.5


@pytest.mark.parametrize("areas", ["whole", "regions"])
@pytest.mark.parametrize("is_mirrored", [False, True])
def test_a_part_of_this_place_asks_all_of_it_for_its_warmth(
    make_basis: Any, areas: str, is_mirrored: bool
) -> None:
    session = session_in(lit_place(make_basis))
    current = session.views[0].current
    part = (current * [1.25, 1, 0.6])[8:46, 14:80]
    ask(session, part[:, ::-1] if is_mirrored else part, areas)
    ratio = session.views[0].image / session.views[0].current
    warmth = np.log2(ratio[..., 0] / ratio[..., 2])
    np.testing.assert_allclose(warmth, np.log2(1.25 / 0.6), atol=0.2)
    names = [layer.name for layer in session.views.layers.layers]
    assert not {"Key light", "Fill light"} & set(names)


def test_a_part_asks_for_light_where_it_shows_it(make_basis: Any) -> None:
    session = session_in(lit_place(make_basis))
    current = session.views[0].current
    x = np.mgrid[:H, :W][1] / W
    meant = current * np.where(x < 0.4, 4, 1)[..., None]
    ask(session, meant[6:48, 5:80][:, ::-1])
    stops = np.log2(luminance(session.views[0].image) / luminance(current))
    assert stops[:, 8:32].mean() > stops[:, 48:72].mean() + 0.7


def test_a_reference_of_another_view_of_the_session_is_found_there(make_basis: Any) -> None:
    first, second = (
        make_basis(images=furniture(k)[None, ..., None] * np.ones(3), emission=[[0.4] * 3])
        for k in (1, 2)
    )
    session = session_in(first, second)
    ask(session, session.views[1].current * [1.25, 1, 0.6])
    for view in session.views:
        ratio = view.image / view.current
        warmth = np.log2(ratio[..., 0] / ratio[..., 2])
        np.testing.assert_allclose(warmth, np.log2(1.25 / 0.6), atol=0.2)


def other_places() -> list[np.ndarray]:
    """Return pictures of other places under lightings of many kinds."""
    pictures = []
    for seed in range(20, 32):
        rng = np.random.default_rng(seed)
        x = np.linspace(0, 1, W)[:, None]
        edge, share = rng.uniform(0.2, 0.8), 2.0 ** rng.uniform(-5, 0)
        key, fill = (2.0 ** rng.uniform(-1.5, 0.5, 3) for _ in range(2))
        light = np.where(x < edge, key, share * fill)
        pictures.append(np.clip(furniture(seed)[..., None] * light, 0, 1))
    return pictures


@pytest.mark.parametrize("number", seeds(4, 12))
def test_what_is_asked_for_is_never_farther_from_the_light_of_a_reference(
    make_basis: Any, number: int
) -> None:
    session = session_in(lit_place(make_basis))
    view = session.views[0]
    picture = other_places()[number]
    pixels = np.round(255 * TRANSFORM.encode(picture)).astype(np.uint8)
    reference = session.references.add("evening", pixels)
    tones = Tones(session.references.light(reference)).light_tones
    with suppress(PaintError):  # refused: no part of it leads nearer
        session.handle(LookLike(reference.id), {})
    known = np.ones((H, W), bool)
    before, after = (distance_of(view, tones, x, known) for x in (view.current, view.image))
    assert after <= before + 1e-3
    if session.store.steps:
        assert after < before
        assert session.views.layers.layers[-1].name.startswith("Like evening")


def tones_of(contrast: float, lit: list[float], shadows: list[float]) -> LightTones:
    levels = np.array([-9, -contrast, -1, -0.5, 0, 0])
    return LightTones(levels, np.array(lit), np.array(shadows), (np.zeros(3), np.zeros(3)), 0.5)


def test_the_distance_of_lights_is_the_mean_of_half_the_contrast_and_both_warmths() -> None:
    reference = tones_of(3, [0.2, 0, -0.3], [0.1, 0, -0.4])
    meant = contrast_of_light(reference)
    picture = tones_of(meant, [0, 0, 0], [0, 0, 0])
    lit, shadows = (x[0] - x[2] for x in (reference.lit, reference.shadows))
    np.testing.assert_allclose(light_distance(reference, picture), (abs(lit) + abs(shadows)) / 3)
    far = tones_of(meant + 3, [0, 0, 0], [0, 0, 0])
    farther = light_distance(reference, far) - light_distance(reference, picture)
    np.testing.assert_allclose(farther, 0.5)
    same = tones_of(meant, list(reference.lit), list(reference.shadows))
    assert light_distance(reference, same) == pytest.approx(0)
