"""A light that somebody has moved keeps its level until it is released."""

from typing import Any

import numpy as np
import pytest
from moving import MovingStudio, exact_answer, stroke

from lightpaint.basis.lights import BasisLight, Lights
from lightpaint.paint import protocol
from lightpaint.paint.session.live_answer import keep_moved_lights
from lightpaint.paint.store.session_requests import SessionRequests

MOVED: dict[str, Any] = {"a": {"position": [0.0, 1.0, 0.0]}}


def _lights(**fields: Any) -> Lights:
    emission = (1.0, 1.0, 1.0) if fields.get("is_fixed") else (4.0, 2.0, 1.0)
    a = BasisLight("a", "spot", "intensity", "W/sr", emission, "1 m²", **fields)
    b = BasisLight("b", "spot", "intensity", "W/sr", (1.0, 1.0, 1.0), "1 m²")
    return Lights((a, b))


def _kept(requests: SessionRequests, weights: Any, lights: Lights | None = None) -> Any:
    return keep_moved_lights(requests, lights or _lights(), MOVED, np.array(weights))


def test_it_is_locked_at_its_level_in_the_answer():
    kept = _kept(SessionRequests(), [[0.3, 0.2, 0.1], [1, 1, 1]])
    assert kept.lights == {"a": {"lock": [0.3, 0.2, 0.1]}}
    assert kept.kept == ("a",)
    # Later moves leave it at this level.
    assert _kept(kept, [[9, 9, 9], [1, 1, 1]]) == kept


def test_one_that_the_answer_needs_no_more_is_lit_as_in_the_scene():
    assert _kept(SessionRequests(), np.zeros((2, 3))).lights == {"a": {"lock": [4.0, 2.0, 1.0]}}


@pytest.mark.parametrize("held", [{"lock": True}, {"off": True}, {"lock": 0}])
def test_what_somebody_has_set_stays(held: Any):
    requests = SessionRequests({"a": held})
    assert _kept(requests, np.ones((2, 3))) == requests
    tied = SessionRequests({"b": held}, ties=(("a", "b"),))
    assert _kept(tied, np.ones((2, 3))) == tied


def test_released_or_put_back_it_has_its_earlier_constraints():
    limits = {"limits": {"max": 2}}
    kept = _kept(SessionRequests({"a": limits}), np.ones((2, 3)))
    assert kept.earlier == {"a": limits}
    back = keep_moved_lights(kept, _lights(), {"a": {}}, np.ones((2, 3)))
    for released in (back, kept.with_light("a", limits)):
        assert released == SessionRequests({"a": limits})
    # What is locked by hand is no longer kept by the move alone.
    assert kept.with_light("a", {"lock": [2, 2, 2]}).kept == ()


def test_a_light_with_one_number_is_locked_at_it_and_a_fixed_one_not():
    scalar = _kept(SessionRequests(), np.full((2, 3), 0.5), _lights(is_scalar=True))
    assert scalar.lights == {"a": {"lock": 0.5}}
    fixed = _kept(SessionRequests(), np.ones((2, 3)), _lights(is_fixed=True))
    assert fixed == SessionRequests()


def test_a_session_file_remembers_it():
    kept = _kept(SessionRequests(), np.ones((2, 3)))
    assert SessionRequests.of(kept.as_json()) == kept
    assert SessionRequests.of({"lights": {}}).kept == ()


@pytest.mark.nightly
@pytest.mark.usefixtures("without_reasons")
def test_a_moved_lamp_stays_on_until_a_click_releases_it(moving: MovingStudio):
    """One step of undo takes back its place and its level."""
    stroke(moving)
    exact_answer(moving)
    session, light = moving.studio.session, moving.light("bulb")
    before = session.weights[light].copy()
    assert before.any()
    for is_final in (False, True):
        moving.send(protocol.MoveLights({"bulb": {"position": [0.4, 1.2, 0.1]}}, is_final))
        np.testing.assert_array_equal(session.weights[light], before)
    assert session.edit_state["kept"] == ("bulb",)
    exact_answer(moving)
    np.testing.assert_array_equal(session.weights[light], before)
    moving.send(protocol.ConstrainLight(light, {}))  # the lock on its row
    assert session.edit_state["kept"] == ()
    assert (session.weights[light] != before).any()
    for _ in range(2):
        moving.send(protocol.Undo())
    assert session.requests == SessionRequests()
