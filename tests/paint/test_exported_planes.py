"""Exports of a session with measuring planes: what `solve --planes` writes, and its command."""

import json
import shlex
from pathlib import Path
from typing import Any

import pytest
from moving import MovingStudio, stroke
from renderer import LIGHTS, write_room

from lightpaint.cli.commands.paint_command import command_for_paintings, options_of
from lightpaint.cli.options.command_arguments import values_of
from lightpaint.cli.options.parser import command_parser
from lightpaint.errors import ConstraintError
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.paint import protocol
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.paint.subject_factory import make_subject
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import SceneFile

PLANES = '[plane.floor]\nshape = "floor"\nheight = 0.1\ngrid = 0.5\nmean = {mean}\n'


@pytest.mark.parametrize("is_ignored", [False, True])
def test_a_report_has_the_planes_of_the_answer(tmp_path: Path, is_ignored: bool) -> None:
    """The wish binds: the paint alone would leave less than half of that light."""
    path = tmp_path / "floor.planes.toml"
    path.write_text(PLANES.format(mean=200), encoding="utf-8")
    settings = Settings(spp=16, use_cache=False, planes=str(path), cd_per_unit=100.0)
    moving = MovingStudio(tmp_path, LIGHTS["bulb"] + LIGHTS["beam"], settings)
    try:
        moving.wait(lambda: moving.studio.session.live_answer.planes_reading())
        stroke(moving)
        if is_ignored:
            moving.send(protocol.ChangeSettings({"ignore_wishes": True}))
        moving.send(protocol.Export(("lighting", "report")))
        moving.wait(lambda: any(isinstance(m, protocol.ExportResult) for m in moving.messages))
        reading = moving.studio.session.live_answer.planes_reading()
        assert reading is not None
    finally:
        moving.close()
    folder = tmp_path / "answer"
    found = json.loads((folder / "report.json").read_text())["planes"]["planes"]["floor"]
    [wish] = found["wishes"]
    assert wish["is_met"] is not is_ignored
    # The page says what the live answer gives, which is solved to 1e-5 of a requirement.
    assert found["mean_lx"] == pytest.approx(reading.planes[0].mean, rel=1e-3)
    assert found["mean_lx"] < 150 if is_ignored else found["mean_lx"] >= 200
    planes = json.loads((folder / "planes" / "planes.json").read_text())
    assert planes["planes"]["floor"]["mean"] == pytest.approx(found["mean_lx"])
    assert (folder / "planes" / "floor.png").is_file()
    page = (folder / "report.html").read_text()
    assert ("The wishes and limits did not bind this answer." in page) is is_ignored


def test_the_command_has_the_limits_and_what_is_ignored() -> None:
    requests = SessionRequests().with_values({"ignore_wishes": True, "hold": 0.5})
    assert options_of(requests) == ["--ignore-wishes", "--hold 0.5"]
    assert options_of(SessionRequests().with_values({"ignore_wishes": False})) == []
    settings: Any = requests.settings(Settings(planes="hall.planes.toml"))
    assert (settings.ignore_wishes, settings.planes) == (True, "hall.planes.toml")


def test_the_command_names_planes_power_and_unit() -> None:
    options = ("--planes", "hall.planes.toml", "--watts", "120", "--unit", "1000")
    arguments = ["paint", "hall.xml", *options, "--error", "2%"]
    values = values_of(command_parser().parse_args(arguments), arguments)
    requests = SessionRequests().with_values({"ignore_wishes": True})
    command = command_for_paintings("hall.xml", {"": "p.exr"}, values["options"], requests)
    solved = command_parser().parse_args(shlex.split(command)[1:])
    found = (solved.planes, solved.watts, solved.cd_per_unit, solved.ignore_wishes)
    assert found == ("hall.planes.toml", 120, 1000, True)


def test_a_limit_of_power_alone_needs_no_planes(tmp_path: Path) -> None:
    """The panel has the power of all lamps, and the answer keeps to the limit."""
    lamp = {"emitters": [{"name": "white", "rgb": [1, 1, 1], "watts": 40}]}
    constraints = Constraints.of({"bulb": lamp, "beam": lamp})
    settings = Settings(spp=16, use_cache=False, watts=2.0)
    moving = MovingStudio(tmp_path, LIGHTS["bulb"] + LIGHTS["beam"], settings, constraints)
    try:
        reading = moving.wait(lambda: moving.studio.session.live_answer.planes_reading())
        assert reading.planes == ()
        stroke(moving)
        reading = moving.studio.session.live_answer.planes_reading()
        assert reading is not None
        assert reading.power is not None
        assert reading.power.is_met
        assert reading.watts == pytest.approx(2.0, rel=1e-3)  # the paint asks for more
        moving.send(protocol.ChangeSettings({"ignore_wishes": True}))
        reading = moving.studio.session.live_answer.planes_reading()
        assert reading is not None
        assert reading.watts is not None
        assert reading.watts > 50
    finally:
        moving.close()


def test_a_limit_of_power_needs_the_power_of_lamps(tmp_path: Path) -> None:
    path = write_room(tmp_path, lights=LIGHTS["bulb"])
    with pytest.raises(ConstraintError, match="the power of 'bulb' is unknown"):
        make_subject(SceneFile(str(path)), tmp_path / "s", settings=Settings(watts=2.0)).prepare()
