"""What a stroke leaves on the canvas, against closed forms."""

import math
from typing import Any

import numpy as np
import pytest
from nightly import nightly

H, W = 64, 80


def run_brush(page: Any, script: str, *, light: float = 0, objects: Any = None) -> Any:
    """Image (H, W, 3) and importance (H, W) after a script that has `canvas` and the modules."""
    image, importance = page.evaluate(
        f"""async ([H, W, light, objects]) => {{
            const brush = await import("/engine/brush.js");
            const hand = await import("/engine/stroke.js");
            const canvas = bench.plain(H, W, light, objects);
            {script}
            return [Array.from(canvas.image), Array.from(canvas.importance)];
        }}""",
        [H, W, light, None if objects is None else np.ravel(objects).tolist()],
    )
    return np.reshape(image, (H, W, 3)), np.reshape(importance, (H, W))


def stroke_script(use: str, begin: str, *moves: str) -> str:
    moves_script = "".join(f"stroke.move([{move}]);" for move in moves)
    return f"""
        const use = {{ ...hand.DEFAULT_TOOL, size: 20, hardness: 1, flow: 1, {use} }};
        const stroke = new hand.Stroke(canvas, use, {begin}, 1);
        stroke.begin(); {moves_script}
        if (use.end !== false) canvas.end();
    """


def place_script(x: float, y: float, pressure: float = 1.0) -> str:
    return f"{{ x: {x}, y: {y}, pressure: {pressure} }}"


@pytest.mark.nightly
@pytest.mark.parametrize("hardness", [0, 0.5, 1])
def test_one_stamp_has_the_energy_of_its_profile(page: Any, hardness: float):
    image, importance = run_brush(
        page,
        stroke_script(
            f"size: 40, hardness: {hardness}, rgb: [2, 1, 0.5]", place_script(40.3, 31.8)
        ),
    )
    inner, outer = hardness * 19.5, 20 + 0.5 * hardness
    r = np.linspace(0, outer, 200_001)
    t = np.clip((r - inner) / (outer - inner), 0, 1)
    profile = 0.5 + 0.5 * np.cos(math.pi * t)
    area = np.trapezoid(2 * math.pi * r * profile, r)
    # A sum over pixels instead of an integral.
    np.testing.assert_allclose(importance.sum(), area, rtol=2e-3)
    np.testing.assert_allclose(image.sum((0, 1)), area * np.array([2, 1, 0.5]), rtol=2e-3)
    if hardness == 0:
        assert area == pytest.approx(20**2 * (math.pi / 2 * 2 / 2 - 2 / math.pi), rel=1e-6)


def test_stamps_flow_together(page: Any):
    def at_middle(flow: float, pressure: float) -> float:
        spot = place_script(40.5, 32.5, pressure)
        script = (
            stroke_script(f"flow: {flow}", spot)
            + f"""
            canvas.begin();
            brush.stamp(canvas, {spot}, use); brush.stamp(canvas, {spot}, use);
            const effect = {{ kind: "paint", rgb: [1, 1, 1], paintMode: "colour" }};
            canvas.apply(canvas.wholeRegion, effect);
        """
        )
        return float(run_brush(page, script)[0][32, 40, 0])

    # Once by the stroke, twice by the second one: what is not covered gets less.
    assert at_middle(0.3, 1) == pytest.approx(1 - 0.7**3, abs=1e-6)
    assert at_middle(0.6, 0.5) == pytest.approx(1 - 0.7**3, abs=1e-6)


def test_a_path_is_the_same_whatever_points_it_goes_through(page: Any):
    ends = place_script(15, 20), place_script(60, 44)
    whole_path, _ = run_brush(page, stroke_script("flow: 0.4", ends[0], ends[1]))
    parts = [place_script(15 + 45 * t, 20 + 24 * t) for t in (0.1, 0.13, 0.5, 0.9, 1)]
    split_path, _ = run_brush(page, stroke_script("flow: 0.4", ends[0], *parts))
    np.testing.assert_allclose(split_path, whole_path, atol=1e-5)  # float64 places, float32 light


def test_a_line_covers_a_capsule(page: Any):
    lines = stroke_script(
        'tool: "line"', place_script(20, 30), place_script(70, 10), place_script(60, 30)
    )
    image, importance = run_brush(page, lines)
    # Only the last end counts: a rectangle and two half circles.
    area = 40 * 20 + math.pi * 10**2
    np.testing.assert_allclose(importance.sum(), area, rtol=5e-3)  # stamps leave a wavy edge
    np.testing.assert_array_equal(image[..., 0], importance)
    assert importance[12, 65] == 0


def test_paint_as_light_is_on_the_albedo(page: Any):
    script = "canvas.albedo = new Uint16Array(3 * H * W).fill(0x3400);"  # a quarter
    image, _ = run_brush(
        page, script + stroke_script('paintMode: "light", rgb: [4, 2, 1]', place_script(40, 32))
    )
    np.testing.assert_allclose(image[32, 40], [1, 0.5, 0.25])


def test_fill_is_one_object(page: Any):
    objects = np.full((H, W), -1)
    objects[10:30, 20:70], objects[15:20, 30:40] = 2, 5
    image, importance = run_brush(
        page,
        stroke_script('tool: "fill", rgb: [0.5, 0.25, 1]', place_script(22.5, 12.5)),
        objects=objects,
    )
    np.testing.assert_array_equal(importance, objects == 2)
    np.testing.assert_array_equal(image[objects == 2], np.tile([0.5, 0.25, 1], (950, 1)))


def test_the_eraser_brings_the_present_look_back(page: Any):
    spot = stroke_script("size: 50, rgb: [3, 3, 3]", place_script(40, 32))
    eraser_script = "{" + stroke_script("tool: 'eraser', size: 30", place_script(40, 32)) + "}"
    image, importance = run_brush(page, "{" + spot + "}" + eraser_script, light=0.25)
    assert importance[32, 40] == 0
    np.testing.assert_array_equal(image[32, 40], 0.25)
    np.testing.assert_array_equal(image[32, 20], 3)
    np.testing.assert_array_equal(image[importance == 0], 0.25)


@pytest.mark.parametrize("mired", [nightly(0), 60])
def test_on_a_whole_that_was_asked_for_the_eraser_brings_that_back(page: Any, mired: int):
    """And no daylight into a night."""
    all_ = f"hand.adjustArea(canvas, {{ stops: -2, mired: {mired}, object: null }});"
    path = stroke_script("rgb: [3, 1, 1], size: 16", place_script(30, 30), place_script(50, 30))
    erase = stroke_script("tool: 'eraser', size: 30", place_script(30, 30), place_script(60, 30))
    fill_alone, counts = run_brush(page, all_, light=0.5)
    image, importance = run_brush(page, all_ + "{" + path + "}{" + erase + "}", light=0.5)
    np.testing.assert_allclose(image[25:35, 25:60], fill_alone[25:35, 25:60], rtol=2e-3)  # halves
    np.testing.assert_array_equal(importance[25:35, 25:60], 1)
    assert counts.min() == 1


@pytest.mark.nightly
def test_a_whole_stays_one_though_some_of_it_counts_less(page: Any):
    all_ = "hand.adjustArea(canvas, { stops: -2, mired: 0, object: null });"
    weight_script = "{" + stroke_script("tool: 'weight', importance: 0.5", place_script(5, 5)) + "}"
    erase = "{" + stroke_script("tool: 'eraser', size: 20", place_script(60, 40)) + "}"
    accent = "{" + stroke_script("rgb: [1, 1, 1], size: 8", place_script(30, 30)) + "}"
    image, importance = run_brush(page, all_ + weight_script + erase + accent, light=0.5)
    assert importance[5, 5] == 0.5
    np.testing.assert_allclose(image[40, 60], 0.125, rtol=2e-3)  # halves
    assert (importance[40, 60], importance[30, 30]) == (1, 10)


@pytest.mark.nightly
def test_on_a_patchwork_the_eraser_brings_the_present_look_back(page: Any):
    """All is painted, but not alike: nothing lies below it."""
    objects = np.tile(np.arange(W) // 10, (H, 1))
    fills = "".join(
        "{" + stroke_script(f"tool: 'fill', rgb: [{k}, 1, 1]", place_script(10 * k + 0.5, 1)) + "}"
        for k in range(8)
    )
    erase = stroke_script("tool: 'eraser', size: 30", place_script(30, 30), place_script(60, 30))
    image, importance = run_brush(page, fills + "{" + erase + "}", light=0.5, objects=objects)
    np.testing.assert_array_equal(image[30, 30:50], 0.5)
    np.testing.assert_array_equal(importance[30, 30:50], 0)


def test_the_importance_brush_leaves_light_alone(page: Any):
    fill = stroke_script("tool: 'fill', rgb: [3, 2, 1]", place_script(1, 1))
    second_stroke = (
        "{" + stroke_script("tool: 'weight', importance: 0.25", place_script(40, 32)) + "}"
    )
    image, importance = run_brush(page, "{" + fill + "}" + second_stroke)
    assert (importance[32, 40], importance[0, 0]) == (0.25, 1)
    np.testing.assert_array_equal(image, np.tile([3.0, 2, 1], (H, W, 1)))


def test_the_importance_brush_goes_by_what_counts_already(page: Any):
    """Accents on a picture of which all is painted count 10: more of that is more."""
    path = stroke_script("rgb: [1, 1, 1], size: 8", place_script(30, 30), place_script(50, 30))
    heavier = stroke_script("tool: 'weight', importance: 4, size: 8", place_script(40, 30))
    all_ = "hand.adjustArea(canvas, { stops: -1, mired: 0, object: null });"
    _, importance = run_brush(
        page, all_ + "{" + path + "}{" + heavier + "}{" + heavier + "}", light=0.5
    )
    assert importance[30, 40] == 160
    assert importance[30, 31] == 10
    # What is not painted is kept as it is, as a stroke would be; and never is anything forgotten.
    _, importance = run_brush(page, heavier, light=0.5)
    assert importance[30, 40] == 4
    lighter = heavier.replace("importance: 4", "importance: 0.1")
    image, importance = run_brush(page, "{" + path + "}" + f"{{{lighter}}}" * 5, light=0.5)
    assert 0 < importance[30, 40] < 0.1
    assert image[30, 40, 0] == 1


@pytest.mark.nightly
def test_what_counts_less_is_never_more(page: Any):
    """Not at the soft end of a stroke either, of which hardly anything is left."""
    soft = stroke_script("rgb: [1, 1, 1], size: 40, hardness: 0, flow: 0.02", place_script(40, 32))
    lighter = stroke_script("tool: 'weight', importance: 0.1, size: 60", place_script(40, 32))
    _, before = run_brush(page, "{" + soft + "}")
    _, after = run_brush(page, "{" + soft + "}{" + lighter + "}")
    is_there = before > 0
    assert (before[is_there] < 0.01).any()
    assert (after[is_there] <= before[is_there]).all()


def test_how_much_something_counts_has_an_end(page: Any):
    """Also where it becomes an accent on all that is asked for: what is more, a session refuses."""
    dot = f"canvas.importance[{10 * W + 10}] = 1000;"
    all_ = "hand.adjustArea(canvas, { stops: -1, mired: 0, object: null });"
    _, importance = run_brush(page, dot + all_, light=0.5)
    assert importance[10, 10] == 1000
    assert importance[40, 40] == 1


def test_a_drag_asks_for_stops_and_keeps_luminance(page: Any):
    # Up by 80 pixels is a stop. In the middle of a soft spot all of it.
    image, importance = run_brush(
        page,
        stroke_script('tool: "adjust"', place_script(40.5, 40.5), place_script(40.5, -39.5)),
        light=0.25,
    )
    np.testing.assert_allclose(image[40, 40], 0.5, rtol=1e-6)
    np.testing.assert_allclose(image[..., 1], 0.25 * (1 + importance), rtol=1e-6)
    # To the right is warmer, as bright as before.
    image, importance = run_brush(
        page,
        stroke_script('tool: "adjust"', place_script(40.5, 40.5), place_script(140.5, 40.5)),
        light=0.25,
    )
    r, g, b = image[40, 40]
    assert r > g > b
    luminance = image @ [0.2126, 0.7152, 0.0722]
    np.testing.assert_allclose(luminance, 0.25, rtol=1e-5)
    left, _ = run_brush(
        page,
        stroke_script('tool: "adjust"', place_script(40.5, 40.5), place_script(-20, 40.5)),
        light=0.25,
    )
    assert left[40, 40, 0] < left[40, 40, 2]


@pytest.mark.nightly
def test_asking_by_numbers_is_exact_in_an_object(page: Any):
    objects = np.zeros((H, W), int)
    objects[:, 40:] = 1
    image, importance = run_brush(
        page,
        "hand.adjustArea(canvas, { stops: -1.5, mired: 0, object: 1 });",
        light=0.5,
        objects=objects,
    )
    np.testing.assert_array_equal(importance, objects)
    np.testing.assert_allclose(image[:, 40:], 0.5 * 2**-1.5, rtol=1e-6)
    np.testing.assert_array_equal(image[:, :40], 0.5)


def test_strokes_over_what_was_asked_of_all_count_more_than_it(page: Any):
    """As they do beside what is not painted, which is held by four times as much."""
    objects = np.zeros((H, W), int)
    objects[:, : W // 10] = 1
    all_ = "hand.adjustArea(canvas, {{ stops: {}, mired: 0, object: null }});".format
    path = stroke_script(
        "rgb: [1, 1, 1], size: 8, hardness: 1, flow: 1", place_script(30, 30), place_script(50, 30)
    )
    image, importance = run_brush(page, all_(-1) + "{" + path + "}" + all_(-1), light=0.5)
    np.testing.assert_allclose([image[30, 40, 0], image[5, 70, 0]], [0.5, 0.125], rtol=1e-6)
    assert importance[30, 40] == 10
    assert importance[5, 70] == 1
    script = all_(-1) + "hand.adjustArea(canvas, { stops: 1, mired: 0, object: 1 });"
    _, importance = run_brush(page, script, light=0.5, objects=objects)
    unpainted, painted = importance[objects == 0], importance[objects == 1]
    np.testing.assert_allclose(unpainted.sum() / painted.sum(), 4, rtol=1e-6)
    # Where something is not painted, that is held, and paint counts as it is.
    assert run_brush(page, path, light=0.5)[1].max() == 1


@pytest.mark.nightly
def test_strokes_before_all_is_asked_stay_accents(page: Any):
    """The rest had counted three times what they did, as it was held; so it does now."""
    path = stroke_script("rgb: [1, 1, 1], size: 16", place_script(30, 30), place_script(50, 30))
    all_ = "hand.adjustArea(canvas, { stops: -1, mired: 0, object: null });"
    before = run_brush(page, path, light=0.5)[1]
    image, importance = run_brush(page, "{" + path + "}" + all_, light=0.5)
    accent = before == 1
    np.testing.assert_allclose([image[30, 40, 0], image[5, 70, 0]], [0.5, 0.25], rtol=1e-6)
    assert importance[5, 70] == 1
    expected = (1 - before.mean()) / (4 * before.mean())
    assert 1 < expected < 10
    np.testing.assert_allclose(importance[accent], expected, rtol=1e-6)
    # Once: what is asked of all again changes no importance.
    repeated_fill = run_brush(page, "{" + path + "}" + all_ + all_, light=0.5)[1]
    np.testing.assert_array_equal(repeated_fill, importance)


@pytest.mark.nightly
@pytest.mark.parametrize("tool", ["brush", "eraser", "weight", "fill", "line", "adjust"])
def test_a_dropped_stroke_has_never_been(page: Any, tool: str):
    first = (
        "{"
        + stroke_script("rgb: [1, 2, 3], hardness: 0", place_script(30, 30), place_script(60, 50))
        + "}"
    )
    before = run_brush(page, first, light=0.5)
    second = stroke_script(
        f"tool: '{tool}', end: false, importance: 0.5",
        place_script(35, 25),
        place_script(50, 60),
        place_script(20, 20),
    )
    after = run_brush(page, first + second + "canvas.drop();", light=0.5)
    for old, other in zip(before, after, strict=True):
        np.testing.assert_array_equal(old, other)


def test_at_the_border_nothing_is_written_elsewhere(page: Any):
    image, importance = run_brush(
        page,
        stroke_script(
            "size: 30, rgb: [1, 1, 1]",
            place_script(-5, 32),
            place_script(-50, -50),
            place_script(200, 90),
        ),
    )
    assert importance[32, 5] > 0.5
    assert importance[32, 20] == 0
    np.testing.assert_array_equal(image[importance == 0], 0)


def test_a_stroke_may_leave_the_picture_on_any_side(page: Any):
    """Or begin beside it: what it touches lies within, also where that is nothing."""
    for way in ((-60, 0), (60, 0), (0, -60), (0, 60), (70, 70), (-70, -70)):
        inner, outside = place_script(40, 32), place_script(40 + 2 * way[0], 32 + 2 * way[1])
        for begin, end in ((inner, outside), (outside, inner), (outside, outside)):
            regions = page.evaluate(
                f"""async ([H, W]) => {{
                    const hand = await import("/engine/stroke.js");
                    const canvas = bench.plain(H, W, 0, null);
                    const use = {{ ...hand.DEFAULT_TOOL, size: 20 }};
                    const stroke = new hand.Stroke(canvas, use, {begin}, 1);
                    return [...stroke.begin(), ...stroke.move([{end}]), canvas.end()];
                }}""",
                [H, W],
            )
            for top, bottom, left, right in regions:
                assert 0 <= top <= bottom <= H
                assert 0 <= left <= right <= W
