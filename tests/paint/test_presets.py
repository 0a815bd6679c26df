"""Presets are layers that fit any scene: they ask for what they say, in one step."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from layered_sessions import RandomEditor

import lightpaint as lp
from lightpaint.colour.color import luminance
from lightpaint.errors import PaintError
from lightpaint.images.denoiser import Features
from lightpaint.images.object_map import Objects
from lightpaint.paint import protocol
from lightpaint.paint.presets.presets import PRESETS, warmer
from lightpaint.paint.presets.view_areas import ViewAreas
from lightpaint.paint.session.session import Session
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.store import MemoryStore
from lightpaint.pipeline.job.settings import Settings

H, W = 36, 64


def room(make_basis: Any) -> lp.Basis:
    """A wall lit from the left, with a vase in its middle."""
    light = np.linspace(2, 0.1, W)[None, :, None] * np.ones((H, W, 3))
    index = np.zeros((H, W), np.int32)
    index[14:24, 29:36] = 1
    basis: lp.Basis = make_basis(
        images=np.array([light, light[:, ::-1]]), emission=[[0.5] * 3, [0.1] * 3]
    )
    return replace(basis, objects=Objects(index, ("wall", "vase")))


def session_in(basis: lp.Basis) -> Session:
    store = MemoryStore(Identity.of([basis]))
    look = basis.current_look
    return Session([basis], [look], store, settings=Settings(), transform=lp.ViewTransform())


def asked_stops(session: Session) -> np.ndarray:
    view = session.views[0]
    return np.log2(luminance(view.image) / luminance(view.current))


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_is_one_step_that_undo_takes_back(make_basis: Any, name: str) -> None:
    session = session_in(room(make_basis))
    session.handle(protocol.ApplyPreset(name), {})
    layers = session.views.layers
    assert [step.label for step in session.store.steps] == [PRESETS[name].title]
    assert layers.layers[-1].name == PRESETS[name].title
    assert session.is_painted
    assert np.abs(asked_stops(session)).max() > 0.2
    asked = session.views[0].image.copy()
    session.handle(protocol.Undo(), {})
    assert not session.is_painted
    session.handle(protocol.Redo(), {})
    np.testing.assert_array_equal(session.views[0].image, asked)


def test_only_this_object_leaves_it_and_darkens_all_else(make_basis: Any) -> None:
    session = session_in(room(make_basis))
    session.handle(protocol.ApplyPreset("only_object", "vase"), {})
    stops, vase = asked_stops(session), session.basis.objects.mask("vase")
    np.testing.assert_allclose(stops[vase], 0.3, atol=1e-4)
    np.testing.assert_allclose(stops[~vase], -3, atol=1e-4)
    assert session.views.layers.layers[-1].name == "Only this object: vase"


def test_without_a_chosen_object_it_is_about_the_most_central_one(make_basis: Any) -> None:
    session = session_in(room(make_basis))
    session.handle(protocol.ApplyPreset("shop_window"), {})
    vase = session.basis.objects.mask("vase")
    assert asked_stops(session)[vase].min() > 1
    assert asked_stops(session)[~vase].max() < -0.9


def test_the_strength_of_its_group_leads_from_day_to_night(make_basis: Any) -> None:
    session = session_in(room(make_basis))
    session.handle(protocol.ApplyPreset("night"), {})
    group = session.views.layers.layers[-1]
    levels = []
    for strength in (0.0, 0.5, 1.0):
        change = protocol.ChangeLayers(layers=(replace(group, strength=strength),))
        session.handle(change, {})
        levels.append(float(np.mean(luminance(session.views[0].image))))
    assert levels[0] > 1.3 * levels[1] > 1.3**2 * levels[2]


def test_a_preset_keeps_to_what_is_selected(make_basis: Any) -> None:
    session = session_in(room(make_basis))
    mask = np.full((H, 10), 255, np.uint8)
    session.handle(protocol.Select((0, H, 0, 10)), {"mask": mask})
    session.handle(protocol.ApplyPreset("moonlight"), {})
    counts = session.views[0].importance
    assert counts[:, :10].all()
    assert not counts[:, 10:].any()


def test_shadows_are_of_the_light_and_not_of_dark_surfaces() -> None:
    light = np.where(np.arange(W) < W // 2, 1.0, 0.25)[None, :, None] * np.ones((H, W, 3))
    albedo = np.where(np.arange(H) % 2, 0.8, 0.1)[:, None, None] * np.ones((H, W, 3))
    features = Features(albedo.astype(np.float32), np.zeros((H, W, 3), np.float32))
    seen = np.zeros((H, W), bool)
    areas = ViewAreas((light * albedo).astype(np.float32), seen, features)
    shadows = areas.shadows
    assert np.ptp(shadows, axis=0).max() < 0.05
    assert shadows[:, -8:].mean() > shadows[:, :8].mean() + 0.3
    assert (areas.lit * shadows).max() == 0


def test_emitters_in_view_belong_to_no_area() -> None:
    seen = np.zeros((H, W), bool)
    seen[:4, :4] = True
    areas = ViewAreas(np.ones((H, W, 3), np.float32), seen)
    masks = [areas.whole, areas.shadows, areas.lit, areas.subject, areas.rest, areas.exhibits]
    assert not any(mask[seen].any() for mask in masks)


def test_what_no_preset_can_be_about_is_refused_and_nothing_changes() -> None:
    editor = RandomEditor(2)
    state = editor.state()
    for request, text in (
        (protocol.ApplyPreset("disco"), "there is no preset 'disco': expected moonlight, golden"),
        (protocol.ApplyPreset("noir", "nobody"), "no view sees an object called 'nobody'"),
    ):
        with pytest.raises(PaintError, match=text):
            editor.session.handle(request, {})
    assert (editor.state(), len(editor.session.store.steps)) == (state, 0)


def test_warmer_light_keeps_its_luminance() -> None:
    for mired in (-300, -50, 0, 80, 900):
        gains = np.array(warmer(mired))
        np.testing.assert_allclose(luminance(gains), 1, rtol=1e-9)
        assert (gains > 0).all()
        assert np.sign(gains[0] - gains[2]) == np.sign(mired)
