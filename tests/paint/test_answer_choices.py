"""Three answers to choose from: they come after the exact one, and a click gives what they show."""

from collections.abc import Iterator
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
import pytest
from studio_client import StudioClient

import lightpaint as lp
from lightpaint.paint import protocol
from lightpaint.paint.protocol import AnswerChoices
from lightpaint.paint.session.picture_table import display_thumbnail
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.studio import exact_answers, session_bases

SIZE = (18, 32)

pytestmark = pytest.mark.usefixtures("without_reasons")


@pytest.fixture
def basis(make_basis: Any) -> lp.Basis:
    """Two white lamps, each on a half of the picture."""
    left = np.linspace(1, 0.1, SIZE[1]) * np.ones((SIZE[0], 1))
    images = np.repeat(np.stack([left, left[:, ::-1]])[..., None], 3, axis=-1)
    two: lp.Basis = make_basis(images=images, emission=[[0.5, 0.5, 0.5]] * 2)
    return two


@pytest.fixture
def client(basis: lp.Basis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """A studio whose pictures are not denoised."""
    monkeypatch.setattr(
        session_bases.PlaneDenoiser, "planes_for", lambda _, bases: [None] * len(bases)
    )
    new_client = StudioClient(tmp_path, basis)
    yield new_client
    new_client.studio.close()
    new_client.studio.wait()


def _paint(client: StudioClient, stroke: int, color: tuple[float, float, float]) -> None:
    region = (2, 16, 2, 12)
    shape = region[1] - region[0], region[3] - region[2]
    image = np.ones((*shape, 1), np.float32) * np.array(color, np.float32)
    arrays = {"image": image, "importance": np.ones(shape, np.float32)}
    client.studio.handle(protocol.Paint(stroke, region, True), arrays)


def _choices(client: StudioClient) -> AnswerChoices:
    version = client.studio.session.version
    message = client.wait(lambda m: m.kind == "choices" and m.fields["version"] == version)
    assert isinstance(message, AnswerChoices)
    return message


def test_a_click_gives_what_the_picture_shows(client: StudioClient):
    _paint(client, 1, (0.2, 0.6, 0.3))
    exact, message = client.exact(), _choices(client)
    assert [choice.colors for choice in message.choices] == ["own", "gentle", "free"]
    assert [choice.is_chosen for choice in message.choices] == [False, True, False]
    own, as_painted, bold = message.choices
    assert as_painted.delta_e == pytest.approx(exact.fields["delta_e"], rel=1e-6)
    assert own.delta_e > as_painted.delta_e > bold.delta_e
    # The painting asks for one wish, whose colour white lamps do not bring.
    [delivery] = exact.fields["deliveries"]
    assert as_painted.brightness == pytest.approx(min(delivery["brightness"], 1))
    assert as_painted.color == pytest.approx(min(delivery["color"], 1))
    assert own.color == pytest.approx(0, abs=0.05)
    assert own.worst is not None
    assert own.worst.layers == tuple(delivery["layers"])
    assert own.color < as_painted.color < bold.color
    studio = client.studio
    pictures = {x.colors: studio.resource(f"choice/{x.colors}").copy() for x in message.choices}
    assert set(message.resources) == {f"choice/{colors}" for colors in pictures}
    for choice in (own, bold):
        studio.handle(protocol.ChangeSettings({"colors": choice.colors}), {})
        answer = client.exact()
        assert answer.fields["delta_e"] == pytest.approx(choice.delta_e, rel=1e-6)
        light = studio.session.views[0].basis.mix(studio.session.weights)
        side = exact_answers.PICTURE_SIDE
        expected = display_thumbnail(light, studio.session.transform, side=side)
        np.testing.assert_array_equal(pictures[choice.colors], expected)
        assert [x.colors for x in _choices(client).choices if x.is_chosen] == [choice.colors]
        if choice is own:  # white lamps stay white
            weights = studio.session.weights
            np.testing.assert_allclose(weights, weights[:, :1] * np.ones(3), rtol=1e-9)
        studio.handle(protocol.Undo(), {})  # one step
        client.exact()
        assert studio.session.live_answer.fit.colors == "gentle"


def test_the_next_stroke_cancels_them(client: StudioClient, monkeypatch: pytest.MonkeyPatch):
    first_version = None
    solve = exact_answers.solve_choices

    def interrupted(snapshot: SessionSnapshot, solution: Any) -> Any:
        nonlocal first_version
        if first_version is None:
            first_version = snapshot.version
            # As a page does it, in a thread that the change does not cancel.
            stroke = Thread(target=_paint, args=(client, 2, (0.6, 0.3, 0.2)))
            stroke.start()
            stroke.join()
        return solve(snapshot, solution)

    monkeypatch.setattr(exact_answers, "solve_choices", interrupted)
    _paint(client, 1, (0.2, 0.6, 0.3))
    client.wait(lambda m: m.kind == "choices")
    versions = [m.fields["version"] for m in client.messages if m.kind == "choices"]
    assert first_version not in versions


def test_a_page_that_connects_gets_them(client: StudioClient):
    _paint(client, 1, (0.2, 0.6, 0.3))
    client.exact()
    choices = _choices(client).choices
    assert client.studio.state().choices == choices  # type: ignore[union-attr]
    assert "choice/own" in client.studio.state().resources  # type: ignore[union-attr]
    _paint(client, 2, (0.6, 0.3, 0.2))
    assert client.studio.state().choices == ()  # type: ignore[union-attr]


def test_lamps_without_a_choice_of_colour_have_no_other_answers(client: StudioClient):
    studio = client.studio
    colors = {name: {"color": "#ffaa66"} for name in studio.session.basis.names}
    studio.handle(protocol.ConstrainLights(colors), {})
    _paint(client, 1, (0.2, 0.6, 0.3))
    client.exact()
    assert _choices(client).choices == ()


def test_pictures_have_the_master_dimmer(client: StudioClient):
    studio = client.studio
    studio.handle(protocol.SetMaster(0.25), {})
    _paint(client, 1, (0.2, 0.6, 0.3))
    client.exact()
    _choices(client)
    light = studio.session.views[0].basis.mix(0.25 * studio.session.weights)
    side = exact_answers.PICTURE_SIDE
    expected = display_thumbnail(light, studio.session.transform, side=side)
    np.testing.assert_array_equal(studio.resource("choice/gentle"), expected)
