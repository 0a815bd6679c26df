"""The painter's console: nothing is sent before it is switched on, then each answer is."""

from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lightpaint as lp
from lightpaint.dmx.console_rig import (
    ConsoleRig,
    DmxChannel,
    RigAxis,
    RigEmitter,
    RigFixture,
    RigHead,
    RigLight,
)
from lightpaint.dmx.levels import check_lamps
from lightpaint.errors import PaintError, RigError
from lightpaint.paint import protocol
from lightpaint.paint.session.look_library import LookLibrary
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.session.picture_table import PictureTable
from lightpaint.paint.store.history_steps import Identity, StoredLook
from lightpaint.paint.store.session_file import MemoryStore
from lightpaint.paint.studio.console_switch import Console, ConsoleSwitch, drives_of_session
from lightpaint.paint.subject_factory import make_subject
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import SceneFile
from lightpaint.scene.lights.lights_file import SceneRequests

SIZE = (8, 12)

EMITTERS = [
    {"name": name, "xy": xy, "Y": 1.0}
    for name, xy in (("red", [0.7, 0.299]), ("green", [0.17, 0.7]), ("blue", [0.135, 0.055]))
]


@dataclass
class RecordedLink:
    """A link that notes what it is told, in place of a network."""

    shown: list[Any] = field(default_factory=list)
    is_closed: bool = False
    trouble: str | None = None
    rig: ConsoleRig | None = None

    def show(self, drives: Any, *, rig: ConsoleRig | None = None) -> None:
        """Note drives, and the rig that they are for."""
        self.rig = rig
        if "nowhere" in drives:
            raise RigError("the rig has no light nowhere")
        self.shown.append(drives)

    def blackout(self) -> None:
        """Note that all is dark."""
        self.shown.append("dark")

    def close(self) -> None:
        """Note the end."""
        self.is_closed = True


def _rig() -> ConsoleRig:
    """A fixture at the second universe's first channel."""
    emitters = tuple(RigEmitter(x["name"], x["xy"], 1, (k,)) for k, x in enumerate(EMITTERS))
    light = RigLight("lamp 1", (0, 0, 3), (0, 0, -1), (0, 1, 0), 20, 30, emitters)
    channels = tuple(DmxChannel(f"ColorAdd_{x}", "Beam", (k + 1,)) for k, x in enumerate("RGB"))
    return ConsoleRig("r", (RigFixture("1", "PAR", "PAR", "RGB", {1: 513}, channels, (light,)),))


@pytest.fixture
def session(make_basis: Any) -> Session:
    """A session of two lights, of which the second one is a lamp of emitters."""
    basis = make_basis(2, SIZE, names=["lamp 0", "lamp 1"])
    keys = {"light": {"lamp 1": {"emitters": EMITTERS}}}
    basis = basis.with_requests(SceneRequests(keys, "hall.lights.toml"))
    store = MemoryStore(Identity.of([basis]))
    options = {"settings": Settings(), "transform": lp.ViewTransform()}
    return Session([basis], [basis.current_look], store, **options)


def _paint(session: Session) -> None:
    """Paint a bright rectangle."""
    arrays = {"image": np.full((4, 5, 3), 0.9, np.float32), "importance": np.ones((4, 5), "f4")}
    session.handle(protocol.Paint(1, (2, 6, 3, 8), True, view=0), arrays)


def test_a_show_without_a_lamp_is_refused_before_anything_is_painted(
    make_basis: Any, tmp_path: Path
) -> None:
    """Of a basis, and of a scene that was never loaded by its lights file."""
    keys = {"light": {"lamp 1": {"emitters": EMITTERS}}}
    basis = make_basis(2, SIZE, names=["lamp 0", "lamp 1"])
    basis = basis.with_requests(SceneRequests(keys, "hall.lights.toml"))
    (tmp_path / "hall.xml").write_text("<scene/>")
    listed = ", ".join(f'{{ name = "{x["name"]}", xy = {x["xy"]}, Y = 1 }}' for x in EMITTERS)
    text = f'[light."lamp 1"]\nemitters = [{listed}]\n'
    (tmp_path / "hall.lights.toml").write_text(text)
    scene = SceneFile(str(tmp_path / "hall.xml"))
    [fixture] = _rig().fixtures
    other = ConsoleRig("r", (replace(fixture, lights=(replace(fixture.lights[0], name="x"),)),))
    one = replace(fixture.lights[0], emitters=fixture.lights[0].emitters[:2])
    fewer = ConsoleRig("r", (replace(fixture, lights=(one,)),))
    for source in (basis, scene):
        make_subject(source, tmp_path, check_lamps=partial(check_lamps, _rig()))
        for rig, message in (
            (other, "r has no light lamp 1: it has x"),
            (fewer, "'lamp 1' of r has no emitter blue: it has green, red"),
        ):
            with pytest.raises(RigError, match=message):
                make_subject(source, tmp_path, check_lamps=partial(check_lamps, rig))


def test_nothing_is_sent_before_it_is_on_and_then_each_answer(session: Session) -> None:
    link = RecordedLink()
    switch = ConsoleSwitch(Console(_rig(), lambda: link, "sacn://127.0.0.1"))
    switch.follow(session)
    assert link.shown == []
    [state] = switch.handle(protocol.SwitchConsole(True), session)
    assert state.console.is_on
    _paint(session)
    switch.follow(session)
    assert link.shown[-1] == drives_of_session(session)
    assert link.shown[-1] != link.shown[0]
    assert link.shown[-1].keys() == {"lamp 1"}
    switch.handle(protocol.SwitchConsole(False), session)
    assert link.is_closed


def test_after_a_blackout_nothing_shines_until_it_is_lit_again(session: Session) -> None:
    link = RecordedLink()
    switch = ConsoleSwitch(Console(_rig(), lambda: link, "sacn://127.0.0.1"))
    switch.handle(protocol.SwitchConsole(True), session)
    [state] = switch.handle(protocol.BlackOut(), session)
    assert state.console.is_dark
    _paint(session)
    switch.follow(session)
    assert link.shown[-1] == "dark"
    [state] = switch.handle(protocol.SwitchConsole(True), session)
    assert not state.console.is_dark
    assert link.shown[-1] == drives_of_session(session)


def test_a_refused_link_is_closed_and_stays_off(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    link = RecordedLink()
    switch = ConsoleSwitch(Console(_rig(), lambda: link, "sacn://127.0.0.1"))
    name = "lightpaint.paint.studio.console_switch.drives_of_session"
    monkeypatch.setattr(name, lambda session: {"nowhere": {}})
    with pytest.raises(RigError):
        switch.handle(protocol.SwitchConsole(True), session)
    assert link.is_closed
    assert switch.info is not None
    assert not switch.info.is_on


def test_without_a_target_there_is_only_the_address_of_lights(session: Session) -> None:
    switch = ConsoleSwitch(Console(_rig()))
    assert switch.info is None
    assert switch.addresses == {"lamp 1": "PAR 2.1"}
    for message in (protocol.SwitchConsole(True), protocol.BlackOut()):
        with pytest.raises(PaintError, match="there is no console"):
            switch.handle(message, session)


@pytest.mark.parametrize("has_positions", [False, True])
def test_heads_follow_lights_that_move_if_they_are_to(
    session: Session, has_positions: bool
) -> None:
    link, warnings = RecordedLink(), list[str]()
    axis = RigAxis("tilt", 3, (1, 0, 0), (0, 255), (-90, 90))
    [still] = _rig().fixtures
    channels = (*still.channels, DmxChannel("Tilt", "Head", (4,), default=128))
    head = RigHead((axis,), (0, 0, -1), ("lamp 1",))
    rig = ConsoleRig("r", (replace(still, channels=channels, heads=(head,)),))
    ways = [(0, 0, -1), (0, 1, 0), (1, 0, 0), (1, 0, 0)]
    switch = ConsoleSwitch(
        Console(rig, lambda: link, "sacn://127.0.0.1", has_positions=has_positions),
        find_directions=lambda _: {"lamp 1": ways.pop(0)},
        warn=warnings.append,
    )
    switch.handle(protocol.SwitchConsole(True), session)
    levels = []
    for _ in range(3):
        switch.follow(session)
        levels.append(None if link.rig is None else link.rig.fixtures[0].channels[3].default)
    if has_positions:
        # +y is 90° of tilt; +x is across it.
        assert levels[0] == 255
        assert len(warnings) == 1
        assert "so it misses by 90°" in warnings[0]
    else:
        assert levels == [None] * 3
        assert warnings == []


def test_a_blackout_of_a_console_that_is_off_is_refused(session: Session) -> None:
    switch = ConsoleSwitch(Console(_rig(), RecordedLink, "sacn://127.0.0.1"))
    with pytest.raises(PaintError, match="nothing is sent"):
        switch.handle(protocol.BlackOut(), session)


def test_looks_keep_their_drives_and_learn_them_when_lamps_change(session: Session) -> None:
    _paint(session)
    session.handle(protocol.SetMaster(0.5), {})
    library = LookLibrary(session, PictureTable())
    library.handle(protocol.SaveLook("dusk"))
    [look] = session.store.looks()
    assert look.fields["drives"] == drives_of_session(session)
    # As a file that knew other lamps, or none, has it.
    for others in ({"lamp 1": {"red": 0.1}}, None):
        fields = {**look.fields, "drives": others}
        if others is None:
            del fields["drives"]
        session.store.put_look(StoredLook(look.id, fields, look.arrays))
        LookLibrary(session, PictureTable())
        assert session.store.looks()[0].fields["drives"] == drives_of_session(session)


def test_the_master_dimmer_dims_the_drives(session: Session) -> None:
    _paint(session)
    full = np.array([*drives_of_session(session)["lamp 1"].values()])
    session.handle(protocol.SetMaster(0.5), {})
    half = np.array([*drives_of_session(session)["lamp 1"].values()])
    np.testing.assert_allclose(half, full / 2, atol=1e-6)
