"""BlenderDMX as a foreign reader of our show, and receiver of what we send."""

import os
from pathlib import Path

import pytest
from blender import blender_command, found_in_blender

from lightpaint.dmx.console_link import ConsoleLink
from lightpaint.dmx.console_rig import UNIVERSE_SIZE
from lightpaint.dmx.levels import encode_levels
from lightpaint.dmx.mvr import read_rig

SHOW = Path(__file__).parents[2] / "scenes" / "rig" / "show.mvr"


@pytest.mark.nightly
def test_blender_dmx_hangs_our_show_and_receives_its_levels(tmp_path: Path) -> None:
    """LIGHTPAINT_BLENDER_DMX: the folder of the add-on's release 2.2.0, with its wheels."""
    if not (addon := os.environ.get("LIGHTPAINT_BLENDER_DMX")):
        pytest.skip("BlenderDMX (LIGHTPAINT_BLENDER_DMX: its folder)")
    blender, script = blender_command(), Path(__file__).with_name("blender_dmx.py")
    rig = read_rig(SHOW)
    drives = {
        light.name: {x.name: (k + 1) / 10 for k, x in enumerate(light.emitters)}
        for fixture in rig.fixtures
        for light in fixture.lights
    }
    resources = str(tmp_path / "user")
    variables = {"ADDON": addon, "SHOW": str(SHOW), "BLENDER_USER_RESOURCES": resources}
    with ConsoleLink.open("sacn://127.0.0.1", rig) as link:
        link.show(drives)
        found = found_in_blender(blender, script, tmp_path, variables)
    places = [divmod(x - 1, UNIVERSE_SIZE) for f in rig.fixtures for x in f.addresses.values()]
    assert found["addresses"] == sorted([[1 + u, 1 + channel] for u, channel in places])
    levels = encode_levels(rig, drives)
    assert {int(k): bytes(x) for k, x in found["levels"].items()} == levels
