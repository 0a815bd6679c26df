"""Presets are layers that fit any scene: they ask for what they say, in one step."""

from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from layered_sessions import RandomEditor

import lightpaint as lp
from lightpaint.basis.lights import Lights
from lightpaint.colour.color import delta_e, kelvin_to_rgb, luminance
from lightpaint.errors import PaintError
from lightpaint.images.denoiser import Features
from lightpaint.images.object_map import Objects
from lightpaint.paint import protocol
from lightpaint.paint.presets.lighting_presets import PRESETS
from lightpaint.paint.presets.view_areas import ViewAreas
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.session_file import MemoryStore
from lightpaint.pipeline.job.settings import Settings

H, W = 36, 64

#: The lamps of `room`: their plugins, and their emission.
LAMPS = {
    "sky": ("constant", (0.5, 0.5, 0.5)),
    "sun": ("directional", (0.3, 0.3, 0.3)),
    "spot": ("spot", (0.2, 0.2, 0.2)),
}


def room(make_basis: Any) -> lp.Basis:
    """A wall with a vase in its middle, under a sky, a sun at the left and a spot on the vase."""
    y, x = np.mgrid[:H, :W]
    pools = [
        np.ones((H, W)),
        np.where(x < W // 4, 2.0, 0.02),
        0.02 + 3 * np.exp(-(((y - 19) / 5) ** 2) - ((x - 32) / 6) ** 2),
    ]
    images = np.array([pool[..., None] * np.ones(3) for pool in pools])
    index = np.zeros((H, W), np.int32)
    index[14:24, 29:36] = 1
    basis: lp.Basis = make_basis(
        images=images, names=list(LAMPS), emission=[x for _, x in LAMPS.values()]
    )
    lights = [
        replace(light, plugin=plugin)
        for light, (plugin, _) in zip(basis.lights, LAMPS.values(), strict=True)
    ]
    return replace(basis, lights=Lights.of(lights), objects=Objects(index, ("wall", "vase")))


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


def test_only_this_object_darkens_what_the_lamp_on_it_does_not_light(make_basis: Any) -> None:
    session = session_in(room(make_basis))
    session.handle(protocol.ApplyPreset("only_object", "vase"), {})
    assert session.basis.objects is not None
    stops, vase = asked_stops(session), session.basis.objects.mask("vase")
    assert stops[:, :8].max() < -4
    assert stops[vase].min() - stops[:, :8].max() > 3
    assert session.views.layers.layers[-1].name == "Only this object: vase"


def test_without_a_chosen_object_it_is_about_the_most_central_one(make_basis: Any) -> None:
    session = session_in(room(make_basis))
    session.handle(protocol.ApplyPreset("shop_window"), {})
    chosen = session_in(room(make_basis))
    chosen.handle(protocol.ApplyPreset("shop_window", "vase"), {})
    np.testing.assert_array_equal(session.views[0].image, chosen.views[0].image)


def test_golden_hour_gives_warm_light_to_the_sun_and_cool_light_to_the_rest(
    make_basis: Any,
) -> None:
    session = session_in(room(make_basis))
    session.handle(protocol.ApplyPreset("golden_hour"), {})
    view = session.views[0]
    ratio = view.image / view.current
    warmth = np.log2(ratio[..., 0] / ratio[..., 2])
    assert warmth[:, :12].min() > 1
    assert warmth[:, -12:].max() < 0.1
    stops = asked_stops(session)
    assert stops[:, :12].mean() - stops[:, -12:].mean() > 1.5


def test_a_preset_asks_for_what_lamps_of_one_colour_can_bring(make_basis: Any) -> None:
    """The gains of the layers, given to the lamps themselves, are the painting."""
    session = session_in(room(make_basis))
    session.handle(protocol.ApplyPreset("only_object"), {})
    rest, subject, _ = session.views.layers.layers[-3:]
    gains = rest.gain * np.array([1, 1, subject.gain])
    meant = session.basis.mix(session.basis.current_weights * gains[:, None])
    np.testing.assert_allclose(session.views[0].image, meant, rtol=0.06, atol=2e-3)


def test_a_white_is_asked_for_whatever_colour_the_lamps_have_now(make_basis: Any) -> None:
    basis = room(make_basis)
    warm = tuple(0.5 * kelvin_to_rgb(2700))
    lights = [replace(light, emission=warm) for light in basis.lights]
    basis = replace(basis, lights=Lights.of(lights))
    session = session_in(basis)
    session.handle(protocol.ApplyPreset("overcast"), {})
    corner = session.views[0].image[-1, -1]
    np.testing.assert_allclose(corner / luminance(corner), kelvin_to_rgb(7000), rtol=0.02)


def test_presets_of_a_subject_cannot_be_taken_for_each_other(make_basis: Any) -> None:
    """By mean ΔE of what they ask of a white room, as many times what is just noticeable."""
    names = "gallery", "shop_window", "three_point", "only_object"
    sessions = {name: session_in(room(make_basis)) for name in names}
    for name, session in sessions.items():
        session.handle(protocol.ApplyPreset(name), {})
    for a, b in combinations(names, 2):
        different = delta_e(sessions[a].views[0].image, sessions[b].views[0].image).mean()
        assert different > 17, (a, b)


def test_ratio_and_colour_of_presets_of_a_subject(make_basis: Any) -> None:
    """Of the vase to the corner at the right, which the spot on it does not light."""

    def asked(name: str) -> tuple[float, list[float]]:
        """The ratio in stops, and the stops by which red gains on blue."""
        session = session_in(room(make_basis))
        session.handle(protocol.ApplyPreset(name), {})
        view = session.views[0]
        vase, corner = view.image[19, 32], view.image[-1, -1]
        ratio = float(np.log2(luminance(vase) / luminance(corner)))
        # The lamps are white.
        return ratio, [float(np.log2(x[0] / x[2])) for x in (vase, corner)]

    ratio, warmth = asked("gallery")  # readable walls, white light
    assert 1 < ratio < 4
    assert np.abs(warmth).max() < 0.5
    ratio, warmth = asked("shop_window")  # white on amber
    assert ratio > 2
    assert warmth[1] > warmth[0] + 2
    ratio, warmth = asked("three_point")  # a warm key, a cool fill by the sky
    assert ratio > 2
    assert warmth[0] > 1
    assert warmth[1] < -0.5
    ratio, warmth = asked("only_object")  # black around light of the lamps' own colours
    assert ratio > 6
    assert np.abs(warmth).max() < 0.01


def test_noir_leaves_a_pool_of_light_and_darkness(make_basis: Any) -> None:
    session = session_in(room(make_basis))
    session.handle(protocol.ApplyPreset("noir"), {})
    light = luminance(session.views[0].image)
    assert light[19, 32] > 12 * np.median(light)


def test_a_scene_of_one_lamp_has_presets_too(make_basis: Any) -> None:
    light = np.linspace(2, 0.1, W)[None, :, None] * np.ones((H, W, 3))
    session = session_in(make_basis(images=light[None], emission=[[0.5] * 3]))
    for name in PRESETS:
        session.handle(protocol.ApplyPreset(name), {})
    session.handle(protocol.ApplyPreset("noir"), {})
    assert np.isfinite(session.views[0].image).all()


def test_exhibits_are_objects_that_stand_free_and_are_more_than_lines(make_basis: Any) -> None:
    index = np.zeros((H, W), np.int32)
    index[14:24, 29:36] = 1
    index[8:20, 50] = 2
    index[:10, :6] = 3
    index[25:30:2, 10:20:2] = 4
    names = ("wall", "vase", "skirting", "curtain", "twigs")
    seen = np.zeros((H, W), bool)
    areas = ViewAreas(np.ones((H, W, 3), np.float32), seen, objects=Objects(index, names))
    assert areas.exhibit_names == ("vase",)


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
    masks = [areas.whole, areas.shadows, areas.lit, areas.subject]
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
