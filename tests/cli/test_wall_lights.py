"""A wall of LEDs is split into texels on the command line, under every constraint."""

from pathlib import Path

import numpy as np
import pytest
from command import run, run_refused, succeed
from renderer import LIGHTS, write_room

from lightpaint.colour.color import luminance
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.scene.properties.emission import read_emitted_image
from lightpaint.scene.scene_reader import load_scene
from lightpaint.scene.scene_render import Stream, render

SPLIT = "--split", "led=4x3"
NOW = '<rgb name="radiance" value="0.5 0.5 0.5"/>'
WANTED = """<texture type="bitmap" name="radiance"><string name="filename" value="wanted.exr"/>
    <string name="wrap_mode" value="clamp"/></texture>"""
#: The camera sees it, upright in front of the far wall.
WALL = """<shape type="rectangle" id="led"><transform name="to_world"><scale x="0.8" y="0.6"/>
    <translate y="1" z="-0.9"/></transform><emitter type="area">{}</emitter></shape>"""
#: Radiances of the painted wall from the top: warm, grey, dark.
ROWS = np.array([(6, 3, 1), (0.5, 0.5, 0.5), (0.1, 0.1, 0.2)], np.float32)


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a room, and a painting of it with another picture on its wall."""
    folder = tmp_path_factory.mktemp("walls")
    write_room(folder, lights=WALL.format(NOW) + LIGHTS["bulb"])
    # Mitsuba's first row is the lowest of a rectangle.
    write_rgb(folder / "wanted.exr", np.repeat(ROWS[::-1, None], 4, axis=1))
    lights = WALL.format(WANTED) + LIGHTS["bulb"]
    wanted = load_scene(write_room(folder, lights=lights, name="wanted.xml"))
    write_rgb(folder / "target.exr", render(wanted, spp=512, stream=Stream.TEMPLATE).image)
    return folder


def solve(room: Path, *options: object) -> str:
    """Solve for the painting, with the wall as painted, and return what that prints."""
    fixed = "--emitters", "count", "--literal", "--spp", 128, "-o", "out"
    return succeed(room, "solve", "room.xml", "target.exr", *SPLIT, *fixed, *options)


def rows_of(room: Path) -> np.ndarray:
    """Return the radiances of the answer, (rows, columns, 3), from the top."""
    emission = read_lighting(room / "out" / "lighting.json").emission
    return np.array([[emission[f"led.x{x}.y{y}"] for x in range(4)] for y in range(3)])


def test_the_answer_is_the_picture_that_was_on_the_wall(room: Path) -> None:
    output = solve(room)
    assert "led, 4x3 texels" in output
    assert "nothing found against it" in output  # each texel is a small part
    expected = np.repeat(ROWS[:, None], 4, axis=1)
    np.testing.assert_allclose(rows_of(room), expected, atol=0.15)
    stored = read_emitted_image(room / "out" / "relit.led.exr", is_linear=True)
    np.testing.assert_allclose(stored[::-1], rows_of(room), rtol=1e-6)
    page = (room / "out" / "report.html").read_text()
    assert page.count("led now, over its surface") == 2  # alt and title
    assert "mean over its surface" in page
    assert run(room, "verify", "out").returncode == 0
    succeed(room, "relight", "room.xml", "out/lighting.json", "-o", "again", "--spp", 2)
    again = read_emitted_image(room / "again" / "relit.led.exr", is_linear=True)
    np.testing.assert_array_equal(again, stored)


def test_a_limited_wall_is_as_near_as_its_limit_permits(room: Path) -> None:
    output = solve(room, "--limit", "led.*=:2")
    assert "nothing found against it" in output  # each texel is a small part
    bright = luminance(rows_of(room))
    assert bright.max() <= 2 * (1 + 1e-6)
    np.testing.assert_allclose(bright[0], 2, rtol=1e-6)
    certificate = read_lighting(room / "out" / "lighting.json").certificate
    assert certificate is not None
    assert certificate.converged


@pytest.mark.nightly
def test_a_wall_keeps_to_all_constraints(room: Path) -> None:
    """Its name stands for its texels, and patterns for its rows and columns."""
    solve(room, "--off", "led.*.y2", "--lock", "led.x0.*", "--kelvin", "led.x1.y0=3000")
    found = rows_of(room)
    assert not found[2].any()
    np.testing.assert_allclose(found[:2, 0], 0.5, rtol=1e-6)
    red, green, blue = found[0, 1]
    assert red > green > blue > 0
    solve(room, "--kelvin", "led=2700:6500", "--limit", "led=0.2:")
    found = rows_of(room)
    assert luminance(found).min() >= 0.2 * (1 - 1e-6)
    assert (found[..., 0] >= found[..., 2] * 0.98).all()


@pytest.mark.nightly
def test_a_wall_can_be_one_dimmer_or_have_one_row_that_changes(room: Path) -> None:
    solve(room, "--group", "dimmer=led")
    stored = read_emitted_image(room / "out" / "relit.led.exr", is_linear=True)
    np.testing.assert_allclose(stored, np.broadcast_to(stored[0, 0], stored.shape), rtol=1e-6)
    assert not np.allclose(stored, 0.5)
    solve(room, "--lights", "led.*.y0")
    stored = read_emitted_image(room / "out" / "relit.led.exr", is_linear=True)[::-1]
    np.testing.assert_allclose(stored[1:], 0.5, rtol=1e-6)
    assert stored[0, :, 0].min() > 3


def test_the_list_of_lights_has_one_row_for_the_wall(room: Path) -> None:
    output = succeed(room, "lights", "room.xml", *SPLIT, "--no-sheet")
    assert [line.split()[0] for line in output.splitlines()] == ["light", "led", "bulb"]
    assert "4x3 texels led.xCOLUMN.yROW" in output


@pytest.mark.parametrize(
    ("split", "part"),
    [
        ("led=1x1", "split: led is 1x1: the image of an area light has at least 2 columns and 2"),
        ("led=400x250", "split: led is 400x250, 100,000 texels: expected at most 4,096"),
        ("ball=4x4", "has no light 'ball' to split into texels; it has led"),
    ],
)
def test_a_wrong_split_is_one_line(room: Path, split: str, part: str) -> None:
    assert part in run_refused(room, "lights", "room.xml", "--split", split, "--no-sheet")


def test_an_image_that_does_not_load_is_one_line(room: Path) -> None:
    (room / "broken.exr").write_bytes(b"no image")
    write_room(room, lights=WALL.format(WANTED.replace("wanted", "broken")), name="broken.xml")
    assert "broken" in run_refused(room, "lights", "broken.xml", *SPLIT, "--no-sheet")
