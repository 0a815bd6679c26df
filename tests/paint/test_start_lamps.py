"""Lamps that somebody has set by hand become what the solve starts from, and stays near."""

import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from studio_client import StudioClient

import lightpaint as lp
from lightpaint.basis.denoised_mixes import denoise_mix
from lightpaint.cli.commands.paint_command import options_of
from lightpaint.cli.options.job_options import constraints_of
from lightpaint.cli.options.parser import command_parser
from lightpaint.paint import protocol
from lightpaint.paint.layers.layer_stack import Layer
from lightpaint.paint.store.session_requests import DEFAULT_NEAR, SessionRequests

SIZE = (18, 32)

LOCKS: dict[str, Any] = {"light 0": {"lock": [0.9, 0.6, 0.3]}, "light 1": {"lock": [0.1, 0.1, 0.2]}}

pytestmark = pytest.mark.usefixtures("without_reasons")


@pytest.fixture
def client(make_basis: Any, tmp_path: Path) -> Iterator[StudioClient]:
    """A studio of three lamps."""
    rng = np.random.default_rng(2)
    basis: lp.Basis = make_basis(
        images=rng.random((3, *SIZE, 3)) ** 2, emission=[[0.5, 0.5, 0.5]] * 3
    )
    new_client = StudioClient(tmp_path, basis)
    yield new_client
    new_client.studio.close()
    new_client.studio.wait()


def _set_by_hand(client: StudioClient) -> np.ndarray:
    """Lock two lamps, and start from what is lit then."""
    studio = client.studio
    studio.handle(protocol.ConstrainLights({"light 0": {"limits": {"max": 5}}}), {})
    studio.handle(protocol.ConstrainLights(LOCKS), {})
    weights = studio.session.weights.copy()
    studio.handle(protocol.StartFromLamps(), {})
    return weights


def test_lamps_stay_and_are_free_again(client: StudioClient):
    session = client.studio.session
    weights = _set_by_hand(client)
    np.testing.assert_allclose(session.weights, weights, rtol=1e-6)
    assert session.requests.lights == {"light 0": {"limits": {"max": 5}}}
    assert session.edit_state["is_started"]
    for name, emission in zip(session.basis.names, weights, strict=True):
        assert session.requests.start[name] == pytest.approx(emission)
    client.studio.handle(protocol.Undo(), {})  # one step
    assert session.requests.lights == LOCKS
    assert not session.edit_state["is_started"]


def test_the_exact_answer_starts_from_them(client: StudioClient):
    """As `solve` does with the options that the session gives."""
    session = client.studio.session
    weights = _set_by_hand(client)
    client.paint(1, 0.8)
    client.exact()
    snapshot = session.snapshot()
    options = command_parser().parse_args(
        ["solve", "a.xml", "b.png", *shlex.split(" ".join(options_of(session.requests)))]
    )
    constraints = constraints_of(options)
    assert constraints.near == DEFAULT_NEAR
    solution = lp.solve(
        list(snapshot.bases), list(snapshot.painted_targets), constraints=constraints
    )
    expected = lp.correct_noise(solution) if session.basis.knows_noise else solution
    np.testing.assert_allclose(session.weights, expected.weights, rtol=1e-6, atol=1e-9)
    assert (session.weights != weights).any()


def test_how_near_is_a_setting_and_the_scene_comes_back(client: StudioClient):
    studio, session = client.studio, client.studio.session
    weights = _set_by_hand(client)
    client.paint(1, 0.8)
    distances = []
    for near in (0.01, 1.0, 100.0):
        studio.handle(protocol.ChangeSettings({"near": near}), {})
        client.exact()
        distances.append(float(np.abs(session.weights - weights).max()))
    assert distances[0] > distances[1] > distances[2]
    studio.handle(protocol.StartFromLamps(is_on=False), {})
    assert session.requests == SessionRequests({"light 0": {"limits": {"max": 5}}})


def test_the_session_file_remembers_it(client: StudioClient):
    _set_by_hand(client)
    requests = client.studio.session.requests
    assert SessionRequests.of(requests.as_json()) == requests


def test_what_is_switched_off_stays_off(client: StudioClient):
    studio, session = client.studio, client.studio.session
    studio.handle(protocol.ConstrainLights({"light 2": {"off": True}, **LOCKS}), {})
    studio.handle(protocol.StartFromLamps(), {})
    assert session.requests.lights == {"light 2": {"off": True}}
    assert not session.weights[2].any()


def test_their_look_lies_under_the_painting(client: StudioClient):
    """A page gets the whole state with new pictures; undo brings the look of the scene back."""
    studio, session = client.studio, client.studio.session
    scene_look = session.views[0].current.copy()
    studio.handle(protocol.ConstrainLights(LOCKS), {})
    before = studio.state().resources  # type: ignore[union-attr]
    weights = session.weights.copy()
    [state] = studio.handle(protocol.StartFromLamps(), {})
    assert isinstance(state, protocol.SessionState)
    for name in ("present", "ground", "look"):
        assert state.resources[name] > before[name]
    expected = denoise_mix(session.basis, weights)
    np.testing.assert_allclose(studio.resource("ground"), expected, rtol=1e-6)
    np.testing.assert_array_equal(session.views[0].image, studio.resource("ground"))
    client.paint(1, 0.8)
    [state] = studio.handle(protocol.GoToStep(0), {})
    assert isinstance(state, protocol.SessionState)
    np.testing.assert_array_equal(studio.resource("ground"), scene_look)


def test_it_lies_there_again_when_the_session_opens(client: StudioClient, tmp_path: Path):
    _set_by_hand(client)
    client.paint(1, 0.8)
    client.exact()
    image, basis = client.studio.session.views[0].image.copy(), client.studio.session.basis
    client.studio.close()
    client.studio.wait()
    reopened = StudioClient(tmp_path, basis)
    np.testing.assert_allclose(reopened.studio.session.views[0].image, image, rtol=1e-6)
    assert reopened.studio.session.edit_state["is_started"]
    assert reopened.paint(2, 0.7).kind == "answer"  # the pictures are known
    reopened.studio.close()
    reopened.studio.wait()


def adjust(client: StudioClient, number: int, gain: float) -> None:
    """Make the whole picture brighter, in a new layer."""
    layer = Layer(number, "adjust", f"layer {number}", gain=gain)
    whole = 0, SIZE[0], 0, SIZE[1]
    request = protocol.Paint(number, whole, True, layer=number, properties=layer)
    client.studio.handle(request, {"importance": np.ones(SIZE, np.float32)})


def visible(client: StudioClient) -> dict[int, bool]:
    return {x.id: x.is_visible for x in client.studio.session.views.layers}


def test_adjustments_are_not_applied_twice(client: StudioClient) -> None:
    """The lamps that answer them are the start; a new one changes these lamps."""
    session = client.studio.session
    adjust(client, 1, 0.5)
    client.exact()
    weights = session.weights.copy()
    np.testing.assert_allclose(weights, 0.25, rtol=0.1)  # light beyond white counts less
    client.studio.handle(protocol.StartFromLamps(), {})
    assert visible(client) == {0: True, 1: False}
    client.exact()
    np.testing.assert_allclose(session.weights, weights, rtol=1e-6)
    adjust(client, 2, 0.5)
    client.exact()
    # As near the start as `near` holds it.
    assert 0.45 < session.weights.mean() / weights.mean() < 0.65
    client.studio.handle(protocol.StartFromLamps(is_on=False), {})
    assert visible(client) == {0: True, 1: True, 2: True}
    client.studio.handle(protocol.Undo(), {})
    client.studio.handle(protocol.Undo(), {})
    client.studio.handle(protocol.Undo(), {})
    assert visible(client) == {0: True, 1: True}
    assert not session.requests.start


def test_an_adjustment_of_paint_stays_on_this_paint(client: StudioClient) -> None:
    session = client.studio.session
    client.paint(1, 0.8, (0, 6, 0, SIZE[1]))
    adjust(client, 2, 0.5)
    client.exact()
    view = session.views[0]
    painted = view.image[:6].copy()
    client.studio.handle(protocol.StartFromLamps(), {})
    np.testing.assert_allclose(view.image[:6], painted, rtol=1e-6)
    assert (view.importance[:6] > 0).all()
    assert not view.importance[6:].any()
    [hidden, copy] = session.requests.spent[0]
    assert (hidden, visible(client)[2]) == (2, False)
    assert copy is not None
    assert visible(client)[copy]
    client.studio.handle(protocol.StartFromLamps(is_on=False), {})
    assert visible(client) == {0: True, 2: True}


def test_a_group_of_adjustments_is_hidden_as_one(client: StudioClient) -> None:
    studio = client.studio
    studio.handle(protocol.ApplyPreset("moonlight"), {})
    before = visible(client)
    [group] = [x.id for x in studio.session.views.layers if x.kind == "group"]
    client.exact()
    studio.handle(protocol.StartFromLamps(), {})
    assert visible(client) == {**before, group: False}
    assert studio.session.requests.spent == ((group, None),)
    studio.handle(protocol.Undo(), {})
    assert visible(client) == before


def test_adjustments_of_a_look_come_back(client: StudioClient) -> None:
    """A loaded look has its layers under new ids."""
    studio = client.studio
    client.paint(1, 0.8, (0, 6, 0, SIZE[1]))
    adjust(client, 2, 0.5)
    client.exact()
    studio.handle(protocol.StartFromLamps(), {})
    before = list(visible(client).values())
    studio.handle(protocol.SaveLook("dim"), {})
    [look] = studio.session.store.looks()
    studio.handle(protocol.ClearPainting(), {})
    studio.handle(protocol.LoadLook(look.id), {})
    assert list(visible(client).values()) == before == [True, False, True]
    studio.handle(protocol.StartFromLamps(is_on=False), {})
    assert list(visible(client).values()) == [True, True]
    studio.handle(protocol.Undo(), {})
    studio.handle(protocol.ClearPainting(), {})
    assert not studio.session.requests.spent
