"""Any state of a session can be gone back to, and the list of its steps tells which it was."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from layered_sessions import RandomEditor, identity_of, open_session

from lightpaint.errors import PaintError
from lightpaint.paint import protocol
from lightpaint.paint.layers.layer_stack import LayerStack
from lightpaint.paint.session import history
from lightpaint.paint.session.history import find_milestones
from lightpaint.paint.store.history_steps import Step
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.store.stored_arrays import StepAnswer


def listed(session: Any, count: int = 100) -> protocol.StepList:
    steps = session.history.list_steps(count)
    assert isinstance(steps, protocol.StepList)
    return steps


@pytest.mark.nightly
@given(st.integers(0, 2**32 - 1))
def test_any_step_is_reached_in_one_jump_to_the_bit(seed: int) -> None:
    editor = RandomEditor(seed)
    for _ in range(int(editor.rng.integers(3, 12))):
        editor.act()
    session = editor.session
    ids = [0, *session.store.step_ids]
    for _ in range(4):
        position = int(editor.rng.integers(len(ids)))
        session.handle(protocol.GoToStep(ids[position]), {})
        assert session.store.position == position
        assert editor.state() == editor.states[position]
        assert listed(session).done == ids[position]
    assert editor.state(open_session(session.store)) == editor.state()


def test_what_was_undone_stays_until_something_new_is_done() -> None:
    editor = RandomEditor(3)
    while editor.session.store.position < 6:
        editor.act(with_undo=False)
    session = editor.session
    last = session.store.last_id
    session.handle(protocol.GoToStep(session.store.step_ids[2]), {})
    assert [step.id for step in listed(session).steps][-1] == last
    editor.select()
    assert last not in [step.id for step in listed(session).steps]
    state = editor.state()
    with pytest.raises(PaintError, match=f"there is no step {last}"):
        session.handle(protocol.GoToStep(last), {})
    assert editor.state() == state


def test_a_list_has_the_last_steps_with_their_times_and_says_how_many_are_before() -> None:
    editor = RandomEditor(5)
    while editor.session.store.position < 5:
        editor.act(with_undo=False)
    steps = listed(editor.session, 3)
    assert steps.earlier == 2
    assert [step.id for step in steps.steps] == list(editor.session.store.step_ids[2:])
    stamps = [step.stamp for step in steps.steps]
    assert None not in stamps
    assert stamps == sorted(stamps)


def test_the_picture_of_a_step_shows_its_answer_and_is_there_after_reopening(
    tmp_path: Path,
) -> None:
    path = tmp_path / "session.db"
    with Store.open(path, identity_of()) as store:
        session = RandomEditor(1, store).session
        beginning = session.history.picture(0)
        session.handle(protocol.ConstrainLights({"a": {"off": True}, "b": {"off": True}}), {})
        dark = session.history.picture(store.last_id)
        session.handle(protocol.Undo(), {})
    assert beginning.any()
    assert not dark.any()
    assert dark.shape == beginning.shape
    with Store.open(path, identity_of()) as store:
        reopened = open_session(store)
        np.testing.assert_array_equal(reopened.history.picture(0), beginning)
        np.testing.assert_array_equal(reopened.history.picture(store.step_ids[0]), dark)
        # A new step in its place must not show the picture of the other.
        reopened.handle(protocol.SetMaster(0.5), {})
        assert not np.array_equal(reopened.history.picture(store.last_id), dark)


def test_the_answer_before_the_last_step_is_known_unless_lights_have_moved(tmp_path: Path) -> None:
    path = tmp_path / "session.db"
    with Store.open(path, identity_of()) as store:
        session = RandomEditor(1, store).session
        with pytest.raises(PaintError, match="no step before"):
            session.history.previous_weights()
        before = session.weights.copy()
        session.handle(protocol.ConstrainLights({"a": {"lock": 2.0}}), {})
        locked = session.weights.copy()
        np.testing.assert_array_equal(session.history.previous_weights(), before)
        session.handle(protocol.SetMaster(0.5), {})
        session.handle(protocol.ConstrainLights({"a": {"off": True}}), {})
    with Store.open(path, identity_of()) as store:
        session = open_session(store)
        np.testing.assert_allclose(session.history.previous_weights(), 0.5 * locked, rtol=1e-12)
        session.handle(protocol.Undo(), {})
        np.testing.assert_array_equal(session.history.previous_weights(), locked)
        # As after a step that moves a light: the answer before it hangs elsewhere.
        answer = store.answer(store.last_id)
        assert answer is not None
        store.put_answer(StepAnswer(answer.weights, "elsewhere", answer.picture))
        session.handle(protocol.ConstrainLights({"b": {"off": True}}), {})
        with pytest.raises(PaintError, match="moved lights"):
            session.history.previous_weights()


def test_a_session_without_pictures_of_steps_opens_and_gets_them(tmp_path: Path) -> None:
    """An earlier version wrote none."""
    path = tmp_path / "session.db"
    with Store.open(path, identity_of()) as store:
        RandomEditor(1, store).act(with_undo=False)
        store._database.execute("DROP TABLE step_answer")
        store._queue._pending.clear()
    with Store.open(path, identity_of()) as store:
        session = open_session(store)
        assert session.history.picture(store.last_id).any()
        assert session.history.picture(0).shape == (1, 1, 3)


def test_a_cleared_painting_keeps_what_is_asked_of_lights_and_a_new_start_keeps_nothing() -> None:
    editor = RandomEditor(8)
    while len(editor.session.views.layers) < 4:
        editor.act(with_undo=False)
    session = editor.session
    session.handle(protocol.ConstrainLights({"a": {"lock": 2.0}}), {})
    requests, state = session.requests, editor.state()
    for message, kept in ((protocol.ClearPainting(), True), (protocol.StartOver(), False)):
        session.handle(message, {})
        assert session.views.layers == LayerStack()
        assert not session.is_painted
        assert (session.requests == requests) is kept
        if not kept:
            np.testing.assert_allclose(session.weights, session.basis.current_weights)
        fresh = open_session(session.store)
        assert editor.state(fresh) == editor.state()
        session.handle(protocol.Undo(), {})
        assert (editor.state(), session.requests) == (state, requests)


def test_milestones_are_before_pauses_before_new_starts_and_else_every_so_often() -> None:
    pause = history.PAUSE_SECONDS
    steps = [Step("stroke", "", {"stamp": float(k)}) for k in range(50)]
    steps += [Step("stroke", "", {"stamp": 50 + pause}), Step("look_loaded", "", {"stamp": 400.0})]
    steps += [Step("stroke", "")]
    every = history.STEPS_BETWEEN
    assert find_milestones(steps) == {every - 1, 2 * every - 1, 49, 50}
    assert find_milestones(steps[:1]) == frozenset()
