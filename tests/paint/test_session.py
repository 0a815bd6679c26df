"""Whatever is done in a session, and in whichever order, equals what is built from scratch."""

import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from itertools import count
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nightly import examples, nightly
from renderer import REPOSITORY

import lightpaint as lp
from lightpaint.basis.light_basis import Origin
from lightpaint.basis.lights import BasisLight
from lightpaint.cli.commands.paint_command import options_of
from lightpaint.colour.color import LUMINANCE, kelvin_to_rgb
from lightpaint.lighting.answer.combination import dimmed
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.fit import DEFAULT_HOLD
from lightpaint.paint import protocol
from lightpaint.paint.session.live_answer import DRIVES_S, DRIVES_SHARE, LivePace
from lightpaint.paint.session.look_library import LookLibrary
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.session.picture_table import PictureTable
from lightpaint.paint.store.history_steps import Identity, Pixels, Step
from lightpaint.paint.store.session_file import MemoryStore
from lightpaint.paint.store.session_requests import (
    ALL_LIGHTS_KEYS,
    FIT_KEYS,
    IGNORE_WISHES,
    TITLES,
    SessionRequests,
)
from lightpaint.pipeline.job.settings import Settings
from lightpaint.scene.lights.lights_file import SceneRequests

SIZE = (18, 32)


def noiseless_basis(images: Any, sensor: str = "camera") -> lp.Basis:
    """A basis without noise."""
    images = np.asarray(images, np.float32)
    names = [f"lamp {k}" for k in range(len(images))]
    return lp.Basis(
        tuple(BasisLight(name, "point", "intensity", "W/sr", (0.5, 0.5, 0.5)) for name in names),
        images,
        np.zeros_like(images),
        np.zeros(images.shape[1:3], bool),
        Origin("made", "made", sensor, 0, "separate", (0, 0), (0, 0)),
    )


def overlapping_lights() -> lp.Basis:
    """Three soft lights of different colours."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] / SIZE[0]
    colors = np.random.default_rng(5).uniform(0.3, 1, (3, 3))
    places = zip((0.2, 0.6, 0.4), (0.3, 0.8, 1.4), colors, strict=True)
    return noiseless_basis(
        [
            np.exp(-((y - cy) ** 2 + (x - cx) ** 2) / 0.3)[..., None] * color + 0.02
            for cy, cx, color in places
        ]
    )


def two_views() -> list[lp.Basis]:
    """The same lights, seen from another place, too: smaller, and each otherwise."""
    first = overlapping_lights()
    colors = np.random.default_rng(6).uniform(0.3, 1, (3, 1, 1, 3))
    return [first, noiseless_basis(colors * first.images[[1, 2, 0], 3:13, 4:18], "side")]


@pytest.fixture
def basis() -> lp.Basis:
    """Three soft lights of different colours."""
    return overlapping_lights()


def session_of(basis: lp.Basis, store: MemoryStore | None = None, **options: Any) -> Session:
    """A session as the command line makes it."""
    return session_of_views([basis], store, **options)


def session_of_views(
    bases: list[lp.Basis], store: MemoryStore | None = None, **options: Any
) -> Session:
    """The same, of several views."""
    return Session(
        bases,
        [basis.current_look for basis in bases],
        store or MemoryStore(Identity.of(bases)),
        settings=Settings(**options),
        transform=lp.ViewTransform(),
    )


def paint(
    stroke: int,
    region: tuple[int, int, int, int],
    light: float,
    *,
    is_final: bool = True,
    view: int = 0,
) -> tuple[protocol.Paint, dict[str, Any]]:
    """A message as the page sends it."""
    top, bottom, left, right = region
    shape = bottom - top, right - left
    image = np.full((*shape, 3), light, np.float32)
    return protocol.Paint(stroke, region, is_final, view=view), {
        "image": image,
        "importance": np.ones(shape, np.float32),
    }


def test_lamps_of_emitters_show_their_drives(basis: lp.Basis):
    emitters = [
        {"name": name, "xy": xy, "Y": 1.0}
        for name, xy in (("red", [0.7, 0.299]), ("green", [0.17, 0.7]), ("blue", [0.135, 0.055]))
    ]
    keys = {"light": {basis.names[1]: {"emitters": emitters}}}
    session = session_of(basis.with_requests(SceneRequests(keys, "hall.lights.toml")))
    assert [len(session.live_answer.lamps[k].emitters) for k in session.live_answer.lamps] == [3]
    session.handle(*paint(1, (2, 9, 3, 12), 0.9))
    lights = session.findings.lights
    assert lights is not None
    assert [light.drives is None for light in lights] == [True, False, True]
    drives = np.array(lights[1].drives)
    assert ((drives >= 0) & (drives <= 1)).all()
    lamp = session.live_answer.lamps[1]
    np.testing.assert_allclose(lamp.mix(drives), session.weights[1], atol=1e-5)


def test_a_colour_wheel_says_its_slot_and_how_far_it_is_off(basis: lp.Basis):
    slots = [
        {"name": name, "xy": xy, "Y": level}
        for name, xy, level in (("open", [0.31, 0.33], 4.0), ("red", [0.69, 0.3], 0.6))
    ]
    keys = {"light": {basis.names[1]: {"emitters": slots, "wheel": True}}}
    session = session_of(basis.with_requests(SceneRequests(keys, "hall.lights.toml")))
    session.handle(*paint(1, (2, 9, 3, 12), 0.9))
    light = _light(session, 1)
    asked, lamp = np.array(session.live_answer.mixed_emissions[1]), session.live_answer.lamps[1]
    assert sorted(light.drives)[0] == 0 < sorted(light.drives)[1]
    slot = int(np.argmax(light.drives))
    assert light.slot_delta_e == pytest.approx(lamp.distances(asked)[slot])
    assert light.slot_delta_e == pytest.approx(lamp.distances(asked).min())
    # The exact answer says it of its own colour.
    snapshot = session.snapshot()
    solution = snapshot.solution()
    assert solution is not None
    session.accept_solution(snapshot, solution)
    assert session.live_answer.mixed_emissions == solution.problem.reduction.mixed_emissions
    assert _light(session, 1).slot_delta_e == solution.lighting[basis.names[1]].slot_delta_e


def _light(session: Any, k: int) -> Any:
    lights = session.findings.lights
    assert lights is not None
    return lights[k]


def test_drives_come_during_a_stroke_and_cost_little_of_its_time(basis: lp.Basis):
    emitters = [{"name": "red", "xy": [0.7, 0.299], "Y": 1.0}, {"name": "w", "rgb": [1, 1, 1]}]
    keys = {"light": {basis.names[1]: {"emitters": emitters}}}
    session = session_of(basis.with_requests(SceneRequests(keys, "hall.lights.toml")))
    [first] = session.handle(*paint(1, (2, 9, 3, 12), 0.9, is_final=False))
    assert isinstance(first, protocol.AnswerUpdate)
    assert first.drives is not None
    lamp = session.live_answer.lamps[1]
    assert first.drives == (None, tuple(lamp.drives_for(session.weights[1])), None)
    # An exact answer has them with all that is known of its lights.
    [last] = session.handle(*paint(1, (2, 9, 3, 12), 0.9))
    assert isinstance(last, protocol.AnswerUpdate)
    assert last.drives is None
    # Each reading of this clock takes 20 ms: that is what drives cost.
    now = count(0.0, 0.02)
    pace = LivePace(DRIVES_SHARE, DRIVES_S, lambda: next(now))
    taken = [pace.take(session.live_answer.drives) is not None for _ in range(100)]
    assert taken[0]
    # 20 ms of every 420 at most, and of readings between them each is 20 ms.
    assert 1 < sum(taken) <= 100 * 0.02 / 0.4 + 1
    [without_lamps] = session_of(basis).handle(*paint(1, (2, 9, 3, 12), 0.9, is_final=False))
    assert isinstance(without_lamps, protocol.AnswerUpdate)
    assert without_lamps.drives is None


def test_an_answer_is_that_of_solve(basis: lp.Basis):
    session = session_of(basis)
    session.handle(*paint(1, (2, 9, 3, 12), 0.9))
    session.handle(protocol.ConstrainLight(2, {"lock": "80%"}), {})
    snapshot = session.snapshot()
    solution = snapshot.solution()
    assert solution is not None
    [target] = snapshot.targets
    assert target is not None
    constraints = Constraints.of({basis.names[2]: {"lock": "80%"}})
    expected = lp.solve(basis, target, constraints=constraints)
    np.testing.assert_array_equal(solution.weights, expected.weights)
    assert solution.space == "display"
    assert solution.problem.fit.hold == DEFAULT_HOLD
    message = session.accept_solution(snapshot, solution)
    assert message is not None
    assert message.fields["exact"]
    np.testing.assert_array_equal(message.arrays["weights"], expected.weights)


@pytest.mark.parametrize("space", ["linear", "display"])
def test_under_the_brush_it_is_near_the_exact_answer(basis: lp.Basis, space: Any):
    session = session_of(basis, space=space)
    answer = None
    for k in range(6):
        [answer] = session.handle(*paint(1, (2, 9, 3, 4 + 2 * k), 0.7, is_final=k == 5))
    assert answer is not None
    assert not answer.fields["exact"]
    solution = session.snapshot().solution()
    assert solution is not None
    size = np.sqrt(basis.power) * solution.weights
    error = np.sqrt(basis.power) * np.abs(answer.arrays["weights"] - solution.weights)
    # In linear light the sums are those of the exact answer; a film of few pixels and two rounds
    # are as near as their averages.
    assert error.max() < (1e-6 if space == "linear" else 2e-2) * size.max()


@pytest.mark.parametrize("space", [nightly("linear"), "display"])
def test_what_is_asked_is_kept_to_at_once(basis: lp.Basis, space: Any):
    """Though what was before, which is not allowed any more, looks more like the painting."""
    session = session_of(basis, space=space)
    session.handle(*paint(1, (0, 18, 0, 32), 0.9))
    rng = np.random.default_rng(3)
    for share in rng.uniform(0, 0.9, 8):
        # A slider that moves, and two lights that the painting wants brighter.
        before = session.weights[:, 1]
        session.handle(protocol.ConstrainLight(0, {"lock": [share] * 3}, is_final=False), {})
        np.testing.assert_array_equal(session.weights[0], share)
        session.handle(protocol.ConstrainLight(1, {"limits": {"max": share * before[1]}}), {})
        assert session.weights[1] @ LUMINANCE <= share * before[1] * (1 + 1e-12)
        session.handle(protocol.ConstrainLight(2, {"color": "3200K"}), {})
        colour = session.weights[2] / (session.weights[2] @ LUMINANCE)
        np.testing.assert_allclose(colour, kelvin_to_rgb(3200), rtol=1e-9)
        session.handle(protocol.ConstrainLight(2, {"off": True}), {})
        assert not session.weights[2].any()
        for light in (1, 2):
            session.handle(protocol.ConstrainLight(light, {}), {})


@pytest.mark.parametrize("space", ["linear", "display"])
def test_several_views_have_one_answer_that_of_solve(space: Any):
    bases = two_views()
    session = session_of_views(bases, space=space)
    session.handle(*paint(1, (2, 9, 3, 12), 0.9))
    single_solution = session.snapshot().solution()
    assert single_solution is not None
    # A view counts as soon as something is painted in it.
    first = session.snapshot().targets[0]
    assert first is not None
    expected = lp.solve(bases[0], first, space=space)
    np.testing.assert_array_equal(single_solution.weights, expected.weights)
    answer = None
    for k in range(4):
        [answer] = session.handle(*paint(2, (1, 6, 2, 4 + 2 * k), 0.3, is_final=k == 3, view=1))
    assert answer is not None
    snapshot = session.snapshot()
    solution = snapshot.solution()
    assert solution is not None
    targets = [target for target in snapshot.targets if target is not None]
    assert [target.name for target in targets] == ["painting camera", "painting side"]
    joint_progress = lp.solve(bases, targets, space=space)
    np.testing.assert_array_equal(solution.weights, joint_progress.weights)
    size = np.sqrt(bases[0].power + bases[1].power)
    error = size * np.abs(answer.arrays["weights"] - joint_progress.weights)
    # As of one view: sums are exact, and a film of few pixels is as near as its averages.
    limit = 1e-6 if space == "linear" else 2e-2
    assert error.max() < limit * (size * joint_progress.weights).max()
    assert np.abs(size * (joint_progress.weights - single_solution.weights)).max() > 4 * error.max()


def test_undo_goes_through_views_in_order():
    session = session_of_views(two_views())
    session.handle(*paint(1, (2, 9, 3, 12), 0.9))
    session.handle(*paint(2, (1, 6, 2, 9), 0.3, view=1))
    [patch] = session.handle(protocol.Undo(), {})
    assert (patch.fields["view"], patch.fields["views"]) == (1, [1])
    assert patch.arrays["image"].shape == (5, 7, 3)
    assert [view.is_painted for view in session.views] == [True, False]
    [patch] = session.handle(protocol.Undo(), {})
    assert (patch.fields["view"], patch.fields["region"]) == (0, [2, 9, 3, 12])
    assert not session.is_painted
    paintings = {
        view.view: Pixels(np.full((*view.size, 3), 0.5), np.ones(view.size))
        for view in session.views
    }
    pictures = session.load(paintings, session.requests, "look")
    assert [message.fields["view"] for message in pictures] == [0, 1]
    assert len(session.store.steps) == 1
    session.handle(protocol.Undo(), {})
    assert not session.is_painted
    with pytest.raises(lp.LightpaintError, match="no view 2: there are 2"):
        session.handle(*paint(3, (1, 6, 2, 9), 0.3, view=2))


def test_nothing_painted_leaves_lights_as_they_are(basis: lp.Basis):
    session = session_of(basis)
    np.testing.assert_allclose(session.weights, basis.current_weights)
    [answer] = session.handle(protocol.ConstrainLight(0, {"lock": 2.0}), {})
    weights = answer.arrays["weights"]
    np.testing.assert_allclose(weights[0], [2.0, 2.0, 2.0])
    np.testing.assert_allclose(weights[1:], basis.current_weights[1:])


REGION = st.tuples(
    st.integers(0, SIZE[0]),
    st.integers(0, SIZE[0]),
    st.integers(0, SIZE[1]),
    st.integers(0, SIZE[1]),
).map(lambda r: (min(r[:2]), max(r[:2]), min(r[2:]), max(r[2:])))
DONE = st.one_of(
    st.tuples(
        st.just("paint"), REGION, st.floats(0, 2, width=16), st.booleans(), st.integers(0, 1)
    ),
    st.tuples(
        st.just("ask"), st.integers(0, 2), st.sampled_from([{}, {"lock": True}, {"off": True}])
    ),
    st.tuples(st.just("slide"), st.integers(0, 2), st.floats(-1, 2, width=16), st.booleans()),
    st.tuples(st.just("load"), st.floats(0, 2, width=16), st.sampled_from([{}, {"off": True}])),
    st.tuples(st.just("leave"), st.booleans()),
    st.tuples(st.just("set"), st.sampled_from(["free", "white", "own", None])),
    st.tuples(st.sampled_from(["undo", "redo", "drop"])),
)


@settings(max_examples=examples(20, 60), deadline=None)
@given(actions=st.lists(DONE, max_size=14))
def test_any_sequence_equals_a_rebuild(actions: list[Any]):
    bases = two_views()
    store = MemoryStore(Identity.of(bases))
    session, stroke = session_of_views(bases, store), 0
    for action, *values in actions:
        try:
            match action:
                case "paint":
                    stroke += 1
                    message, arrays = paint(
                        stroke, values[0], values[1], is_final=values[2], view=values[3]
                    )
                    session.handle(message, arrays)
                case "ask":
                    session.handle(protocol.ConstrainLight(values[0], values[1]), {})
                case "slide":
                    session.handle(
                        protocol.ConstrainLight(values[0], {"lock": values[1]}, is_final=values[2]),
                        {},
                    )
                case "load":
                    pixels = Pixels(np.full((*SIZE, 3), values[0]), np.ones(SIZE))
                    session.load(
                        {0: pixels},
                        SessionRequests({"lamp 0": values[1]} if values[1] else {}),
                        "look",
                    )
                case "leave":
                    session.client_left(with_stroke=values[0])
                case "set":
                    session.handle(protocol.ChangeSettings({"colors": values[0]}), {})
                case "undo":
                    session.handle(protocol.Undo(), {})
                case "redo":
                    session.handle(protocol.Redo(), {})
                case "drop":
                    session.handle(protocol.DropStroke(stroke), {})
        except lp.LightpaintError:
            pass
    session.handle(protocol.DropStroke(stroke), {})
    rebuilt = session_of_views(bases, store)
    for session_view, other, basis in zip(session.views, rebuilt.views, bases, strict=True):
        np.testing.assert_array_equal(session_view.image, other.image)
        np.testing.assert_array_equal(session_view.importance, other.importance)
        unpainted = session_view.importance == 0
        assert (session_view.image[unpainted] == basis.current_look[unpainted]).all()
    assert session.requests == rebuilt.requests
    assert session.snapshot().constraints == rebuilt.snapshot().constraints
    assert session.snapshot().settings == rebuilt.snapshot().settings
    assert session.is_painted == rebuilt.is_painted
    # All the way back is the beginning.
    while store.position:
        session.handle(protocol.Undo(), {})
    for view, basis in zip(session.views, bases, strict=True):
        np.testing.assert_array_equal(view.image, basis.current_look)
        assert not view.importance.any()
    np.testing.assert_allclose(session.weights, bases[0].current_weights, rtol=1e-9)


@pytest.mark.parametrize(
    ("message", "arrays", "message_text"),
    [
        (paint(1, (0, 99, 0, 4), 1)[0], paint(1, (0, 9, 0, 4), 1)[1], "the picture is 32x18"),
        (paint(1, (0, 9, 0, 4), 1)[0], {}, "without its image"),
        (paint(1, (0, 9, 0, 4), 1)[0], paint(1, (0, 9, 0, 5), 1)[1], "paint of"),
        (*paint(1, (0, 9, 0, 4), -1), "light beyond"),
        (*paint(1, (0, 9, 0, 4), float("nan")), "NaN"),
        (protocol.ConstrainLight(7, {}), {}, "no light 7"),
        (protocol.ConstrainLight(0, {"lok": True}), {}, "lok"),
        (protocol.ConstrainLight(0, {"limits": {"min": 3, "max": 1}}), {}, "above its max"),
        (protocol.TieLights((("lamp 0", "nobody"),)), {}, "nobody"),
        (protocol.ChangeSettings({"hold": "much"}), {}, "hold"),
        (protocol.ChangeSettings({"fast": True}), {}, "fast"),
        (protocol.Undo(), {}, "nothing to undo"),
    ],
)
def test_what_cannot_be_is_said_and_changes_nothing(
    basis: lp.Basis, message: Any, arrays: Any, message_text: str
):
    session = session_of(basis)
    before = session.views[0].image.copy(), session.requests, session.version
    with pytest.raises(lp.LightpaintError, match=message_text):
        session.handle(message, arrays)
    np.testing.assert_array_equal(session.views[0].image, before[0])
    assert (session.requests, session.version) == before[1:]
    session.handle(*paint(1, (2, 9, 3, 12), 0.9))


SLIDING = protocol.ConstrainLight(0, {"lock": [2.0, 2.0, 2.0]}, is_final=False)
OTHERS: list[tuple[str, Callable[[Session], object]]] = [
    ("set", lambda session: session.handle(protocol.ChangeSettings({"colors": "free"}), {})),
    ("tie", lambda session: session.handle(protocol.TieLights((("lamp 0", "lamp 1"),)), {})),
    ("load", lambda session: session.load({}, SessionRequests({"lamp 1": {"off": True}}), "look")),
    ("undo", lambda session: session.handle(protocol.Undo(), {})),
    ("drop", lambda session: session.handle(protocol.DropStroke(), {})),
    (
        "refused",
        lambda session: session.handle(protocol.ConstrainLight(0, {"limits": {"min": -1}}), {}),
    ),
    ("paint", lambda session: session.handle(*paint(1, (2, 9, 3, 12), 0.8))),
]


def what(step: Step) -> dict[str, Any]:
    """Return the fields of a step, except for its time."""
    return {key: value for key, value in step.fields.items() if key != "stamp"}


@pytest.mark.parametrize("other", [act for _, act in OTHERS], ids=[name for name, _ in OTHERS])
def test_a_slider_that_is_being_moved_is_in_nothing_else(
    basis: lp.Basis, other: Callable[[Session], object]
):
    sessions = session_of(basis), session_of(basis)
    sessions[0].handle(SLIDING, {})
    for session in sessions:
        with suppress(lp.LightpaintError):
            other(session)
    slid, still = sessions
    assert not slid.is_open
    assert slid.requests == still.requests
    assert [what(step) for step in slid.store.steps] == [what(step) for step in still.store.steps]
    np.testing.assert_allclose(slid.weights, still.weights, rtol=1e-9)
    # What is there is there after the next stroke, too.
    for session in sessions:
        session.handle(*paint(2, (4, 9, 3, 9), 0.5))
    assert slid.requests == still.requests


def test_several_lights_are_asked_in_one_step(basis: lp.Basis):
    session = session_of(basis)
    for light in (0, 1):
        session.handle(protocol.ConstrainLight(light, {"lock": True}), {})
    requests_before = session.requests
    session.handle(
        protocol.ConstrainLights({"lamp 0": {}, "lamp 1": {"limits": {"max": "150%"}}}), {}
    )
    assert session.requests.lights == {"lamp 1": {"limits": {"max": "150%"}}}
    session.handle(protocol.Undo(), {})
    assert session.requests == requests_before
    with pytest.raises(lp.LightpaintError, match="nobody"):
        session.handle(protocol.ConstrainLights({"nobody": {}}), {})
    assert session.requests == requests_before


def test_a_slider_over_several_lights_is_one_step_with_its_own_label(basis: lp.Basis):
    session = session_of(basis)
    session.handle(*paint(1, (2, 9, 3, 12), 0.9))
    lights = {f"lamp {k}": {"lock": [0.2, 0.2, 0.2]} for k in (0, 1)}
    for is_final in (False, False, True):
        session.handle(protocol.ConstrainLights(lights, is_final, "dim 2 lights, \u22121.3 st"), {})
        np.testing.assert_allclose(session.weights[:2], 0.2, rtol=1e-9)
        assert session.is_open is not is_final
    assert [step.label for step in session.store.steps][1:] == ["dim 2 lights, \u22121.3 st"]
    session.handle(protocol.Undo(), {})
    assert session.requests.lights == {}


def test_the_master_dims_what_is_shown_and_nothing_that_is_asked(basis: lp.Basis):
    store = MemoryStore(Identity.of([basis]))
    session = session_of(basis, store)
    session.handle(*paint(1, (2, 9, 3, 12), 0.9))
    answer, snapshot = session.weights.copy(), session.snapshot()
    looks = LookLibrary(session, PictureTable())
    session.handle(protocol.SetMaster(0.7), {})
    np.testing.assert_array_equal(session.weights, answer)
    solutions = [one.solution() for one in (snapshot, session.snapshot())]
    np.testing.assert_array_equal(*(one.weights for one in solutions if one))
    assert session.edit_state["master"] == 0.7
    assert session.edit_state["history"].undo[-1] == "master 70 %"
    looks.handle(protocol.SaveLook("dimmed"))
    [look] = looks.infos()
    np.testing.assert_allclose(look.weights, 0.7 * answer)
    # It stays in the file, a look brings it back, and other changes keep it.
    assert session_of(basis, store).requests.master == 0.7
    session.handle(protocol.Undo(), {})
    assert session.requests.master == 1
    looks.load(protocol.LoadLook(look.id))
    session.handle(protocol.ConstrainLight(0, {"lock": True}), {})
    assert session.requests.master == 0.7
    # What shone is locked where two looks are mixed.
    looks.handle(protocol.MixLooks(look.id, look.id, 0.5, "mixed"))
    mixed = looks.infos()[-1]
    np.testing.assert_allclose(mixed.weights, 0.7 * answer)
    looks.load(protocol.LoadLook(mixed.id))
    assert session.requests.master == 1
    for level in (-0.1, 2.1, float("nan")):
        with pytest.raises(lp.LightpaintError, match="from 0 to 2"):
            session.handle(protocol.SetMaster(level), {})


def test_a_dimmed_lighting_keeps_fixed_lights_and_no_error_bars(basis: lp.Basis):
    fixed = replace(basis.lights[0], is_fixed=True, emission=(1.0, 1.0, 1.0))
    lights = replace(basis, lights=(fixed, *basis.lights[1:]))
    lighting = lp.Lighting.of_weights(lights, np.ones((3, 3)))
    half = dimmed(lighting, 0.5)
    assert [light.emission for light in half.lights] == [(1, 1, 1), *2 * [(0.5, 0.5, 0.5)]]
    assert dimmed(lighting, 1) is lighting


@pytest.mark.parametrize("space", ["linear", "display"])
def test_a_hand_on_one_of_tied_lights_moves_all_of_them(basis: lp.Basis, space: Any):
    """One holds them at a time, and undo gives it back to the one before."""
    session = session_of(basis, space=space)
    zero, emission = (np.array(light.emission) for light in basis.lights[:2])
    session.handle(*paint(1, (2, 9, 3, 12), 0.9))
    ask, tie = protocol.ConstrainLight, protocol.TieLights((("lamp 0", "lamp 1"),))
    session.handle(ask(1, {"lock": (3 * emission).tolist()}), {})
    session.handle(ask(0, {"off": True}), {})
    session.handle(tie, {})  # of both the first stands
    assert not session.weights[:2].any()
    session.handle(ask(0, {"lock": (2 * zero).tolist()}, is_final=False), {})
    np.testing.assert_allclose(session.weights[:2], [2 * zero, 2 * emission], rtol=1e-9)
    session.handle(ask(0, {"lock": (2 * zero).tolist()}), {})
    session.handle(ask(1, {"lock": (4 * emission).tolist()}), {})
    np.testing.assert_allclose(session.weights[:2], [4 * zero, 4 * emission], rtol=1e-9)
    assert list(session.requests.lights) == ["lamp 1"]
    session.handle(protocol.Undo(), {})
    np.testing.assert_allclose(session.weights[:2], [2 * zero, 2 * emission], rtol=1e-9)
    session.handle(ask(0, {}), {})
    assert session.requests.lights == {}
    share = session.weights[:2] / [zero, emission]
    np.testing.assert_allclose(share, share[0, 0], rtol=1e-9)  # they still go together


def test_what_is_held_is_let_go_of_by_zero(basis: lp.Basis):
    session = session_of(basis)
    usual = session.edit_state["effective_settings"].hold
    assert usual > 0
    session.handle(protocol.ChangeSettings({"hold": 0}), {})
    assert session.edit_state["effective_settings"].hold == session.snapshot().settings.hold == 0
    assert options_of(session.requests) == ["--hold 0"]
    assert session.edit_state["history"].undo == ("Unpainted parts",)
    session.handle(protocol.ChangeSettings({"hold": None}), {})
    assert session.edit_state["effective_settings"].hold == usual
    session.handle(protocol.Undo(), {})
    assert session.edit_state["settings"] == {"hold": 0}


def test_a_setting_is_undone_by_the_name_that_the_page_has_for_it():
    page = REPOSITORY / "lightpaint" / "paint" / "page"
    panel = (page / "ui" / "settings_panel.js").read_text("utf-8")
    titles = re.findall(r"<\$\{Row\} title=\$\{t\('([^']+)'\)\}", panel)
    # These are beside the lights and the planes that they are about.
    beside = ("lamps/start_lamps.js", "planes/planes_panel.js")
    others = "".join((page / "ui" / file).read_text("utf-8") for file in beside)
    in_panel = [title for title in TITLES.values() if f"t('{title}')" not in others]
    assert len(in_panel) == len(TITLES) - 2
    assert in_panel == titles[: len(in_panel)]
    # These are of the page, not of the solve.
    assert titles[len(in_panel) :] == ["Theme", "Panels", "Tour", "Language"]
    assert set(TITLES) == {*FIT_KEYS, *ALL_LIGHTS_KEYS, IGNORE_WISHES}


def test_who_leaves_in_the_middle_leaves_a_stroke_and_no_slider(basis: lp.Basis):
    session = session_of(basis)
    session.handle(*paint(1, (2, 9, 3, 12), 0.8, is_final=False))
    session.client_left(with_stroke=False)  # the same page will send it again
    assert session.is_open
    session.handle(*paint(1, (2, 9, 3, 12), 0.8))
    assert len(session.store.steps) == 1
    session.handle(protocol.ConstrainLight(0, {"lock": True}, is_final=False), {})
    session.handle(*paint(2, (9, 12, 3, 12), 0.8, is_final=False))
    session.client_left(with_stroke=True)
    assert not session.is_open
    assert not session.requests.lights
    assert len(session.store.steps) == 2
    session.handle(*paint(2, (9, 12, 3, 12), 0.8))  # what comes again is there already
    assert len(session.store.steps) == 2
