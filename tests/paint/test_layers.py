"""Layers come to the same target however it was reached, and a session keeps them to the bit."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from layered_sessions import SIZES, RandomEditor, identity_of, open_session, random_mask
from nightly import examples
from renderer import REPOSITORY

import lightpaint as lp
from lightpaint.errors import PaintError
from lightpaint.paint import protocol
from lightpaint.paint.layers.composed_layers import ComposedLayers, accent, accents
from lightpaint.paint.layers.composition import (
    ShownLayer,
    adjusted,
    compose,
    with_effect,
)
from lightpaint.paint.layers.layer_pixels import LayerPixels
from lightpaint.paint.layers.layer_stack import PAINTING, Gradient, Layer, LayerStack, stack_after
from lightpaint.paint.session.look_library import LookLibrary
from lightpaint.paint.session.picture_table import PictureTable
from lightpaint.paint.store.history_steps import Pixels
from lightpaint.paint.store.session_file import Store

SIZE = SIZES[0]
WHOLE = (0, SIZE[0], 0, SIZE[1])
CURRENT = np.random.default_rng(1).uniform(0.1, 2, (*SIZE, 3)).astype(np.float32)


def pixels_of(coverage: Any, colour: Any = 0.0) -> LayerPixels:
    layer = LayerPixels(SIZE)
    mask = np.broadcast_to(np.float32(coverage), SIZE).astype(np.float32)
    image = np.broadcast_to(np.asarray(colour, np.float32), (*SIZE, 3)).astype(np.float32)
    layer.put(WHOLE, Pixels(image, mask))
    return layer


def target_of(*layers: tuple[Layer, LayerPixels], region: Any = WHOLE) -> Pixels:
    shown_layers = [
        ShownLayer(layer, pixels, weight)
        for (layer, pixels), weight in zip(layers, accents(layers), strict=True)
    ]
    return compose(shown_layers, CURRENT, region)


# What each layer does


def test_an_adjustment_scales_luminance_and_its_strength_counts_in_stops() -> None:
    adjustment = Layer(1, "adjust", gain=2.0, tint=(1.2, 1.0, 0.8), strength=1.5)
    image, importance, _ = target_of((adjustment, pixels_of(1)))
    luminance = np.array([0.2126, 0.7152, 0.0722])
    np.testing.assert_allclose(image @ luminance, 2**1.5 * (CURRENT @ luminance), rtol=1e-6)
    ratio = image / CURRENT
    np.testing.assert_allclose(ratio[..., 0] / ratio[..., 1], 1.2**1.5, rtol=1e-6)
    np.testing.assert_array_equal(importance, 1)


def test_two_adjustments_multiply_and_lie_relative_to_what_is_below() -> None:
    colour = np.float32([0.3, 0.2, 0.1])
    paint = (Layer(1, "paint"), pixels_of(1, colour))
    first, other = (Layer(k, "adjust", gain=g) for k, g in ((2, 4.0), (3, 0.5)))
    image = target_of(paint, (first, pixels_of(1)), (other, pixels_of(1))).image
    np.testing.assert_allclose(image, np.broadcast_to(2 * colour, image.shape), rtol=1e-6)
    below = target_of((first, pixels_of(1)), paint).image
    np.testing.assert_allclose(below, np.broadcast_to(colour, below.shape), rtol=1e-6)


@pytest.mark.parametrize("strength", [0.25, 1.0, 2.0])
def test_paint_mixes_by_coverage_and_strength_and_is_never_negative(strength: float) -> None:
    image = target_of((Layer(1, "paint", strength=strength), pixels_of(0.5, 0.0))).image
    np.testing.assert_allclose(image, CURRENT * (1 - 0.5 * strength), rtol=1e-6, atol=1e-7)


def test_weighing_scales_importance_alone() -> None:
    weigh = Layer(2, "weigh", times=4.0)
    mask = np.zeros(SIZE)
    mask[:, :5] = 1
    mask[:, 5:8] = 0.5
    image, importance, _ = target_of(
        (Layer(1, "paint"), pixels_of(1, 1.0)), (weigh, pixels_of(mask))
    )
    np.testing.assert_array_equal(image, 1)
    np.testing.assert_allclose(importance[0], np.r_[[4] * 5, [2.5] * 3, [1] * (SIZE[1] - 8)])


def test_a_small_wish_over_a_whole_one_counts_more_in_either_order() -> None:
    mask = np.zeros(SIZE)
    mask[:4, :5] = 1
    part = 20 / (SIZE[0] * SIZE[1])
    strong, small = (
        (Layer(1, "adjust", gain=0.25), pixels_of(1)),
        (Layer(2, "paint"), pixels_of(mask)),
    )
    for layers in ((strong, small), (small, strong)):
        importance = target_of(*layers).importance
        assert importance[0, 0] == np.float32(accent(part)) > 1
        assert importance[-1, -1] == 1
    assert target_of(small).importance[0, 0] == 1


def test_what_covers_nothing_is_not_painted() -> None:
    layer = (Layer(1, "paint"), pixels_of(5e-4, 9.0))
    image, importance, _ = target_of(layer)
    np.testing.assert_array_equal(image, CURRENT)
    assert not importance.any()


def test_black_light_is_brightened_without_a_division_by_nothing() -> None:
    assert not adjusted(np.zeros((2, 3), np.float32), 4.0, (1.1, 1.0, 0.9)).any()


def test_a_group_passes_eye_strength_and_importance_on() -> None:
    group = Layer(9, "group", strength=0.5, importance=3.0)
    stack = LayerStack.of([Layer(1, "adjust", group=9, strength=0.5), group, Layer(2, "paint")])
    [_, inner, other] = stack.shown()
    assert (inner.strength, inner.importance, other.strength) == (0.25, 3.0, 1.0)
    hidden = stack.with_layers([Layer(9, "group", is_visible=False)])
    assert [layer.id for layer in hidden.shown()] == [0, 2]


def test_a_group_takes_its_layers_along() -> None:
    layers = [Layer(1, "paint", group=9), Layer(2, "paint"), Layer(9, "group"), PAINTING]
    stack = LayerStack.of(layers)
    assert stack.ids == (2, 1, 9, 0)
    assert stack.with_layers([], [0, 9, 1, 2]).ids == (0, 1, 9, 2)


@settings(max_examples=15)
@given(st.integers(0, 10**6))
def test_a_wish_stays_relative_to_what_lies_below_it(seed: int) -> None:
    """Whatever comes to lie below later: the wish multiplies the luminance of that."""
    rng = np.random.default_rng(seed)
    gain, strength = float(2 ** rng.uniform(-2, 2)), float(rng.uniform(0.1, 2))
    mask = random_mask(rng, SIZE)
    wish = (Layer(9, "adjust", gain=gain, strength=strength), pixels_of(mask))
    below = []
    for number in range(1, int(rng.integers(2, 6))):
        layer = Layer(number, ("paint", "adjust", "pixels")[rng.integers(3)], gain=1.5)
        below.append((layer, pixels_of(random_mask(rng, SIZE), rng.random((*SIZE, 3)))))
    luminance = np.array([0.2126, 0.7152, 0.0722])
    before = target_of(*below).image @ luminance
    factor = np.where(mask >= 1e-3, 1 + mask * (gain**strength - 1), 1)
    after = target_of(*below, wish).image @ luminance
    np.testing.assert_allclose(after, factor * before, rtol=2e-5, atol=1e-6)


@given(st.integers(0, 10**6))
def test_any_partition_of_the_picture_gives_the_same_bits(seed: int) -> None:
    rng = np.random.default_rng(seed)
    layers = []
    for number in range(1, 6):
        kind = ("paint", "adjust", "weigh")[rng.integers(3)]
        layer = Layer(
            number, kind, strength=rng.uniform(0.1, 2), gain=2 ** rng.uniform(-2, 2), times=3.0
        )
        layers.append((layer, pixels_of(random_mask(rng, SIZE), rng.random((*SIZE, 3)))))
    target = target_of(*layers)
    y, x = rng.integers(1, SIZE[0]), rng.integers(1, SIZE[1])
    for rows in ((0, y), (y, SIZE[0])):
        for columns in ((0, x), (x, SIZE[1])):
            region = (int(rows[0]), int(rows[1]), int(columns[0]), int(columns[1]))
            assert target_of(*layers, region=region).equals(target.part(region))


@pytest.mark.parametrize("start", [1, 4, 5])
def test_the_end_of_a_stroke_composes_importance_alone(
    start: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An accent changes no light: the same bits, without the light of all layers above."""
    rng, size = np.random.default_rng(start), (150, 140)
    whole = (0, *size[:1], 0, *size[1:])
    kinds = ("paint", "adjust", "weigh", "paint", "pixels", "adjust")
    stack = LayerStack.of(
        Layer(k, kind, gain=1.3, times=3.0) for k, kind in enumerate(kinds, start=1)
    )
    current = rng.uniform(0.1, 2, (*size, 3)).astype(np.float32)
    layers = ComposedLayers(0, current, stack, ())
    for number in range(1, 7):
        top = 0 if number in (2, 6) else int(rng.integers(0, 60))
        region = (top, size[0] if number in (2, 6) else top + 40, 0, size[1])
        shape = (region[1] - top, size[1])
        coverage = 0.2 + 0.8 * rng.random(shape, np.float32)
        layers.put(number, region, Pixels(rng.random((*shape, 3), np.float32), coverage))
    layers.show(stack, (), at_rest=True)
    before, image = layers.accent(start), layers.target.image.copy()
    stroke = (100, 130, 20, 60)
    ones = np.ones((30, 40), np.float32)
    layers.put(start, stroke, Pixels(np.repeat(ones[..., None], 3, -1), ones))
    image[100:130, 20:60] = layers.target.image[100:130, 20:60]
    monkeypatch.setattr(ComposedLayers, "_compose", None)
    change = layers.show(stack, (), at_rest=True)
    assert layers.accent(start) < before
    assert change.with_importance
    np.testing.assert_array_equal(layers.target.image, image)
    pairs = [(layer, layers.layer(layer.id)) for layer in stack.shown()]
    afresh = [ShownLayer(*pair, weight) for pair, weight in zip(pairs, accents(pairs), strict=True)]
    assert layers.target.equals(compose(afresh, current, whole))


def test_light_falls_off_from_place_to_place_and_counts_by_how_far_it_covers() -> None:
    places = {"start": (10.0, 6.0), "end": (50.0, 6.0)}
    albedo = np.full((*SIZE, 3), 0.5, np.float32)
    albedo[:, :5] = 0

    def target(**fields: Any) -> Pixels:
        layer = Layer(1, "gradient", gain=4.0, gradient=Gradient(**{**places, **fields}))
        shown_pair = with_effect(layer, pixels_of(1), lambda: albedo)
        return compose([ShownLayer(*shown_pair, 1.0)], CURRENT, WHOLE)

    x = np.arange(SIZE[1]) + 0.5
    t = np.clip((x - 10) / 40, 0, 1)
    fade = 1 - t * t * (3 - 2 * t)
    fade[fade < 1e-3] = 0  # uncovered
    light = np.float32([1.0, 0.5, 0.25])
    fading = target(shape="linear", light=tuple(light))
    np.testing.assert_allclose(
        fading.image, CURRENT + fade[:, None] * (light - CURRENT), rtol=2e-6, atol=1e-6
    )
    np.testing.assert_allclose(fading.importance[0], fade, atol=1e-6)
    both = target(shape="linear", light=tuple(light), end_light=(0.0, 0.0, 2.0), is_incident=True)
    expected = 0.5 * (light + (t * t * (3 - 2 * t))[:, None] * (np.float32([0, 0, 2]) - light))
    np.testing.assert_allclose(both.image[0, 5:], expected[5:], rtol=1e-5, atol=1e-6)
    np.testing.assert_array_equal(both.image[:, :5], CURRENT[:, :5])  # no diffuse reflection
    around = target(shape="radial", light=None)
    y = np.arange(SIZE[0])[:, None] + 0.5
    t = np.clip(np.hypot(x - 10, y - 6) / 40, 0, 1)
    gain = 1 + 3 * (1 - t * t * (3 - 2 * t))
    np.testing.assert_allclose(around.image, CURRENT * gain[..., None], rtol=4e-3)


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"start": (1e7, 0)}, "beyond 1e"),
        ({"end": (float("nan"), 0)}, "beyond 1e"),
        ({"light": (-1, 0, 0)}, "expected 0 to"),
        ({"end_light": (1, 0, 0)}, "at its end alone"),
    ],
)
def test_what_no_gradient_can_be_is_refused(fields: Any, text: str) -> None:
    with pytest.raises(ValueError, match=text):
        Gradient("linear", **{"start": (0, 0), "end": (1, 1), **fields})
    with pytest.raises(ValueError, match="its gradient is None"):
        Layer(1, "gradient")


# A session


@settings(max_examples=examples(4, 12))
@given(seed=st.integers(0, 10**6))
def test_whatever_the_hand_did_the_target_is_that_of_the_layers_built_afresh(seed: int) -> None:
    hand = RandomEditor(seed)
    for _ in range(14):
        hand.act()
    session = hand.session
    for view in session.views:
        pairs = [(layer, LayerPixels(view.size)) for layer in session.views.layers.shown()]
        for layer, pixels in pairs:
            pixels.put(view.full_region, view.layer(layer.id).part(view.full_region))
        shown_pairs = [with_effect(*pair, lambda view=view: view.albedo) for pair in pairs]
        shown_layers = [
            ShownLayer(*pair, weight)
            for pair, weight in zip(shown_pairs, accents(shown_pairs), strict=True)
        ]
        assert view.painting.equals(compose(shown_layers, view.current, view.full_region))
    # Opened again it is the same, and undo and redo lead through all of it.
    reopened = open_session(session.store)
    assert reopened.views.layers == session.views.layers
    assert hand.state(reopened) == hand.state()
    for position in range(session.store.position - 1, -1, -1):
        session.handle(protocol.Undo(), {})
        assert hand.state() == hand.states[position]
    for state in hand.states[1:]:
        session.handle(protocol.Redo(), {})
        assert hand.state() == state


@settings(max_examples=6)
@given(seed=st.integers(0, 10**6))
def test_the_exported_painting_solves_to_the_same_lamps(seed: int) -> None:
    hand = RandomEditor(seed, views=1)
    for _ in range(6):
        hand.act()
    snapshot = hand.session.snapshot()
    [target] = snapshot.targets
    if target is None:
        return
    solution = snapshot.solution()
    assert solution is not None
    expected = lp.solve(hand.session.basis, target)
    np.testing.assert_array_equal(solution.weights, expected.weights)


def test_a_look_keeps_its_layers_and_undo_leads_back() -> None:
    hand = RandomEditor(4)
    for _ in range(10):
        hand.act()
    session = hand.session
    looks = LookLibrary(session, PictureTable())
    state = hand.state()
    looks.handle(protocol.SaveLook("one"))
    layers = [layer.kind for layer in session.views.layers]
    for _ in range(5):
        hand.act()
    before = hand.state()
    looks.load(protocol.LoadLook(1))
    assert hand.pixels() == state[1]
    assert [layer.kind for layer in session.views.layers] == layers
    assert hand.state(open_session(session.store)) == hand.state()
    session.handle(protocol.Undo(), {})
    assert hand.state() == before


def test_what_no_layer_can_be_is_refused_and_nothing_changes() -> None:
    hand = RandomEditor(0)
    hand.add("paint")
    hand.add("adjust")
    state, steps = hand.state(), len(hand.session.store.steps)
    for request, text in (
        (protocol.ChangeLayers(order=(0, 1, 77)), "no layer 77"),
        (protocol.ChangeLayers(layers=(Layer(1, "adjust"),)), "is of kind paint"),
        (protocol.ChangeLayers(layers=(Layer(1, "paint", group=2),)), "which is none"),
        (protocol.ChangeLayers(layers=(Layer(3, "paint"),), copies={"3": 2}), "not a copy of"),
    ):
        with pytest.raises(PaintError, match=text):
            hand.session.handle(request, {})
    hand.session.handle(protocol.ChangeLayers(order=(0, 1)), {})
    with pytest.raises(PaintError, match="layer 2 was another one"):
        hand.session.handle(protocol.ChangeLayers(layers=(Layer(2, "adjust"),)), {})
    hand.session.handle(protocol.Undo(), {})
    assert (hand.state(), len(hand.session.store.steps)) == (state, steps + 1)


@pytest.mark.nightly
def test_killed_at_any_moment_the_layers_of_all_acknowledged_steps_are_there(
    tmp_path: Path,
) -> None:
    """Another process does what a hand of that seed does, and says each step that is answered."""
    for delay in (3, 9):
        path = tmp_path / f"{delay}.db"
        program = REPOSITORY / "tests" / "layered_sessions.py"
        command = [sys.executable, str(program), str(path)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            lines = [process.stdout.readline() for _ in range(delay)]
            process.kill()
        acknowledged = int(lines[-1])
        with Store.open(path, identity_of()) as store:
            assert store.position >= acknowledged
            reopened = open_session(store)
            hand = RandomEditor(7)
            while hand.session.store.position < store.position:
                hand.act(with_undo=False)
            assert hand.state(reopened) == hand.state()
            assert stack_after(store.steps) == hand.session.views.layers
