"""Measuring planes in the painter: answers meet their wishes, live and exact, unless ignored."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from moving import MovingStudio
from renderer import LIGHTS

from lightpaint.basis.light_basis import Basis
from lightpaint.basis.lights import Lights
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import LightpaintError
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.paint import protocol
from lightpaint.paint.protocol import Message
from lightpaint.paint.session.live_answer import READING_SHARE, LivePace
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.session.session_planes import SessionPlanes
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.session_file import MemoryStore
from lightpaint.photometry.illuminance import (
    Illuminance,
    LightCase,
    MeasuringPlane,
    PowerBudget,
    Wishes,
)
from lightpaint.pipeline.job.settings import Settings

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

SIZE = (18, 32)

#: Under the brush a requirement is met to 1e-5; a wish counts as met to 1e-4.
MET = 1e-4

LAMP = {"emitters": [{"name": "white", "rgb": [1, 1, 1], "watts": 40}]}


def desk(lights: Lights, **wishes: Any) -> Illuminance:
    """Nine points, on which each light gives 100 to 400 lx at full."""
    points = np.random.default_rng(3).random((9, 3))
    up = np.broadcast_to([0.0, 0.0, 1.0], (9, 3))
    cells = np.column_stack([np.arange(9), np.zeros(9, int)])
    plane = MeasuringPlane("desk", points, up, 0.5, 6.0, (9, 1), cells, Wishes(**wishes))
    light = np.random.default_rng(4).uniform(100, 400, (9, len(lights), 1)) * LUMINANCE
    return Illuminance((plane,), lights, light, 0 * light, 1.0)


def measured_session(basis: Basis, *, watts: float | None = None, **wishes: Any) -> Session:
    constraints = Constraints.of(dict.fromkeys(basis.names, LAMP))
    session = Session(
        [basis],
        [basis.current_look],
        MemoryStore(Identity.of([basis])),
        settings=Settings(),
        transform=ViewTransform(),
        constraints=constraints,
    )
    planes = SessionPlanes(desk(basis.lights, **wishes), PowerBudget(watts=watts), 6.0, "")
    session.set_measured_planes(planes)
    return session


def darken(session: Session, number: int = 1) -> protocol.AnswerUpdate:
    """Paint most of the picture black; return the answer under the brush."""
    pixels = {
        "image": np.full((16, 30, 3), 0.001, np.float32),
        "importance": np.ones((16, 30), np.float32),
    }
    [message] = session.handle(protocol.Paint(number, (1, 17, 1, 31)), pixels)
    assert isinstance(message, protocol.AnswerUpdate)
    session.handle(protocol.Paint(number, (1, 17, 1, 31), True), pixels)
    return message


def readings(messages: Sequence[Message]) -> list[protocol.PlanesReading]:
    """Return what messages say of planes."""
    parts = (getattr(message, "reading", None) for message in messages)
    return [part for part in parts if part is not None]


@pytest.fixture
def basis(make_basis: Any) -> Basis:
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] / SIZE[0]
    places = ((0.2, 0.3), (0.6, 0.8), (0.4, 1.4))
    images = [np.exp(-((y - a) ** 2 + (x - b) ** 2) / 0.3)[..., None] + 0.02 for a, b in places]
    planes = np.array(images) * np.ones(3)
    return make_basis(images=planes, emission=[[0.5, 0.5, 0.5]] * 3)  # type: ignore[no-any-return]


def test_live_and_exact_answers_meet_wishes_until_these_are_ignored(basis: Basis) -> None:
    session = measured_session(basis, mean=350.0, uniformity=0.5)
    live = darken(session).reading
    assert live is not None
    assert live.is_required
    assert live.planes[0].mean >= 350 * (1 - MET)
    assert live.planes[0].uniformity >= 0.5 * (1 - MET)
    assert [wish.is_met for wish in live.planes[0].wishes] == [True, True]
    illuminance = desk(basis.lights)
    solution = session.snapshot().solution()
    assert solution is not None
    assert illuminance.reading("desk", solution.weights).mean >= 350 * (1 - MET)

    [ignored] = session.handle(protocol.ChangeSettings({"ignore_wishes": True}), {})
    assert isinstance(ignored, protocol.AnswerUpdate)
    assert ignored.reading is not None
    assert not ignored.reading.is_required
    assert ignored.reading.planes[0].mean < 300
    assert not ignored.reading.planes[0].wishes[0].is_met
    assert session.history.info().undo[-1] == "Answers meet the wishes"
    session.handle(protocol.Undo(), {})
    again = session.answer_update().reading
    assert again is not None
    assert again.planes[0].mean >= 350 * (1 - MET)


def test_readings_take_a_tenth_of_the_time_of_a_stroke() -> None:
    """By a clock that the test sets: a reading of 20 ms comes every 200 ms after its end."""
    now, taken = 0.0, list[float]()

    def planes_reading() -> str:
        nonlocal now
        taken.append(now)
        now += 0.02
        return "reading"

    pace = LivePace(READING_SHARE, clock_s=lambda: now)
    while now < 0.7:
        pace.take(planes_reading)
        now += 0.01
    assert taken == pytest.approx([0.0, 0.22, 0.44, 0.66], abs=0.02)


def test_readings_are_under_the_master_dimmer(basis: Basis) -> None:
    session = measured_session(basis, mean=350.0)
    full = session.answer_update().reading
    session.handle(protocol.SetMaster(0.5), {})
    half = session.answer_update().reading
    assert full is not None
    assert half is not None
    assert half.planes[0].mean == pytest.approx(full.planes[0].mean / 2)
    assert full.watts is not None
    assert half.watts == pytest.approx(full.watts / 2)
    assert not half.planes[0].wishes[0].is_met


def test_what_contradicts_the_limit_of_power_is_refused(basis: Basis) -> None:
    # 90 % of the level in the scene, where a lamp is at half, takes 18 W.
    session = measured_session(basis, watts=30.0, mean=100.0)
    session.handle(protocol.ConstrainLight(0, {"limits": {"min": "90%"}, **LAMP}), {})
    before = session.requests
    with pytest.raises(LightpaintError, match="limit of power"):
        session.handle(protocol.ConstrainLight(1, {"limits": {"min": "90%"}, **LAMP}), {})
    assert session.requests == before


def test_lights_that_were_not_measured_give_nothing(make_basis: Any) -> None:
    basis = make_basis(3, SIZE)
    planes = SessionPlanes(desk(Lights(basis.lights[:2])), PowerBudget(), 6.0, "")
    lux = planes.for_lights(basis.lights).illuminance.of(np.ones((3, 3)))
    np.testing.assert_array_equal(lux, planes.illuminance.of(np.ones((2, 3))))


def test_wishes_hold_in_each_case(basis: Basis) -> None:
    """The first light is locked, and off at night: the others give what is wished for then."""
    session = measured_session(basis, mean=200.0)
    session.handle(protocol.ConstrainLight(0, {"lock": True}), {})
    cases = LightCase("night", {basis.names[0]: 0.0}), LightCase("noon", {basis.names[0]: 1.0})
    illuminance = desk(basis.lights, mean=200.0)
    session.set_measured_planes(SessionPlanes(illuminance, PowerBudget(), 6.0, "", cases))
    planes, reading = session.live_answer.planes, session.answer_update().reading
    assert planes is not None
    assert reading is not None
    assert [plane.name for plane in planes.info.planes] == ["desk, night", "desk, noon"]
    night, noon = reading.planes
    assert night.mean >= 200 * (1 - MET)
    given = noon.mean - night.mean
    alone = illuminance.of(basis.current_weights * [[1], [0], [0]])
    assert given == pytest.approx(alone.mean())


def test_planes_are_measured_at_the_start_and_after_a_move(tmp_path: Path) -> None:
    path = tmp_path / "floor.planes.toml"
    text = '[plane.floor]\nshape = "floor"\nheight = 0.1\ngrid = 0.5\nmean = 20\n'
    path.write_text(text, encoding="utf-8")
    lights = LIGHTS["bulb"] + LIGHTS["beam"]
    settings = Settings(spp=16, use_cache=False, planes=str(path), cd_per_unit=100.0)
    moving = MovingStudio(tmp_path, lights, settings)
    try:
        first = moving.wait(lambda: moving.studio.session.live_answer.planes_reading())
        assert first.planes[0].mean >= 20 * (1 - MET)
        state = moving.wait(
            lambda: next((m for m in moving.messages if getattr(m, "planes", None)), None)
        )
        assert state.planes.planes[0].name == "floor"
        count = len(moving.messages)
        high = {"bulb": {"position": [-0.5, 1.9, 0.5]}}
        [moved] = readings(moving.send(protocol.MoveLights(high)))
        assert moved.is_old
        moving.wait(lambda: any(not x.is_old for x in readings(moving.messages[count:])))
        assert any(getattr(m, "task", "") == "planes" for m in moving.messages)
    finally:
        moving.close()
