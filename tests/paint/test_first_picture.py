"""A session begins with a picture of the scene, and answers once its lights are rendered."""

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from patience import PATIENCE_S
from studio_client import StudioClient, look_of

import lightpaint as lp
from lightpaint.errors import PaintError, SceneError
from lightpaint.paint import protocol
from lightpaint.paint.protocol import Message
from lightpaint.paint.session.session_messages import WAITING_HEADLINE
from lightpaint.paint.subject import Subject


@pytest.fixture
def basis(make_basis: Any) -> lp.Basis:
    """Two white lamps, each on a half of the picture."""
    left = np.linspace(1, 0.1, 24) * np.ones((16, 1))
    images = np.repeat(np.stack([left, left[:, ::-1]])[..., None], 3, axis=-1)
    two: lp.Basis = make_basis(images=images, emission=[[0.5, 0.5, 0.5]] * 2)
    return two


class WaitingClient(StudioClient):
    """A studio whose lights are rendered once `may_render` is set."""

    def __init__(
        self,
        folder: Path,
        basis: lp.Basis,
        monkeypatch: pytest.MonkeyPatch,
        error: Exception | None = None,
    ) -> None:
        self.may_render = threading.Event()

        def bases(subject: Subject, progress: Any = None) -> Iterator[lp.Basis]:
            yield look_of(basis)
            self.may_render.wait(PATIENCE_S)
            if error is not None:
                raise error
            yield basis

        monkeypatch.setattr(Subject, "bases", bases)
        super().__init__(folder, basis)

    def with_lights(self) -> Message:
        """Let the lights be rendered, and return the state with them."""
        self.may_render.set()
        return self.wait(lambda m: m.kind == "state" and m.fields["basis"]["spp"])


def test_it_shows_the_picture_and_keeps_paint_until_it_can_answer(
    tmp_path: Path, basis: lp.Basis, monkeypatch: pytest.MonkeyPatch
) -> None:
    client = WaitingClient(tmp_path, basis, monkeypatch)
    state = client.wait(lambda m: m.kind == "state")
    assert state.fields["basis"]["spp"] == 0
    assert not state.fields["basis"]["is_complete"]
    assert state.fields["answer"]["headline"] == WAITING_HEADLINE
    assert [light["name"] for light in state.fields["lights"]] == list(basis.names)
    resources = state.fields["resources"]
    assert "present" in resources
    assert not any(x.startswith(("plane/", "clean/", "thumb/")) for x in resources)
    np.testing.assert_allclose(
        client.studio.resource("present").astype(np.float32), basis.current_look, rtol=1e-3
    )

    answer = client.paint(0, 0.9)
    np.testing.assert_array_equal(answer.arrays["weights"], basis.current_weights)
    client.studio.handle(protocol.ConstrainLight(0, {"off": True}, True), {})
    with pytest.raises(PaintError, match="the lights are still being rendered"):
        client.studio.handle(protocol.Explain(), {})
    with pytest.raises(PaintError, match="the lights are still being rendered"):
        client.studio.snapshot()

    exact_answers = [m for m in client.messages if m.fields.get("exact")]
    assert not exact_answers
    resources = client.with_lights().fields["resources"]
    assert all(f"plane/{k}" in resources for k in range(len(basis.names)))
    exact = client.exact()
    assert client.studio.session.is_painted
    assert not np.any(exact.arrays["weights"][0])  # which is locked off
    client.studio.close()

    # The answer is the answer to the same paint where the lights were there at once.
    monkeypatch.undo()
    (tmp_path / "other").mkdir()
    other = StudioClient(tmp_path / "other", basis)
    other.paint(0, 0.9)
    other.studio.handle(protocol.ConstrainLight(0, {"off": True}, True), {})
    np.testing.assert_allclose(
        exact.arrays["weights"], other.exact().arrays["weights"], rtol=1e-6, atol=1e-9
    )
    other.studio.close()


def test_a_session_with_steps_waits_for_its_lights(
    tmp_path: Path, basis: lp.Basis, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its lights may hang elsewhere."""
    first = StudioClient(tmp_path, basis)
    first.paint(0, 0.9)
    first.studio.close()
    with monkeypatch.context() as patch:
        patch.setattr(StudioClient, "wait", lambda *_: None)
        client = WaitingClient(tmp_path, basis, patch)
    assert isinstance(client.studio.state(), protocol.SessionPending)
    assert client.with_lights().fields["basis"]["spp"]
    assert client.studio.session.is_painted
    client.studio.close()


def test_an_error_of_the_lights_is_shown_as_if_there_were_no_picture(
    tmp_path: Path, basis: lp.Basis, monkeypatch: pytest.MonkeyPatch
) -> None:
    client = WaitingClient(tmp_path, basis, monkeypatch, SceneError("no memory for the lights"))
    reasons: list[Exception] = []
    client.studio.on_failure = reasons.append
    client.paint(0, 0.9)
    client.may_render.set()
    pending = client.wait(lambda m: m.kind == "waiting")
    assert "no memory for the lights" in pending.fields["text"]
    assert [str(reason) for reason in reasons] == ["no memory for the lights"]
    assert not client.studio.is_ready
    client.studio.close()


def test_it_may_end_before_its_lights_are_there(
    tmp_path: Path, basis: lp.Basis, monkeypatch: pytest.MonkeyPatch
) -> None:
    client = WaitingClient(tmp_path, basis, monkeypatch)
    client.paint(0, 0.9)
    client.studio.close()
    client.may_render.set()
    monkeypatch.undo()
    again = StudioClient(tmp_path, basis)
    assert again.studio.session.is_painted
    again.studio.close()
