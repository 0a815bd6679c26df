"""Run in Blender: imports a show with the add-on BlenderDMX, and writes what its sACN receives.

Argument: the folder of found.json. ADDON is the folder of the add-on, SHOW the show, and
BLENDER_USER_RESOURCES a new folder, in which the add-on becomes an extension.
"""

import importlib
import json
import os
import sys
import time
from pathlib import Path

import bpy

PACKAGE, TIMEOUT_S = "bl_ext.user_default.open_stage_blender_dmx", 60

addon, show, folder = Path(os.environ["ADDON"]), os.environ["SHOW"], Path(sys.argv[-1])
extensions = Path(os.environ["BLENDER_USER_RESOURCES"], "extensions", "user_default")
extensions.mkdir(parents=True)
(extensions / PACKAGE.rpartition(".")[2]).symlink_to(addon)
sys.path[:0] = map(str, addon.glob("wheels/*.whl"))
importlib.import_module("addon_utils").enable(PACKAGE, default_set=True)  # bpy brings it
dmx = bpy.context.scene.dmx
dmx.new()
dmx.addMVR(show)
data = importlib.import_module(f"{PACKAGE}.data").DMX_Data
for universe in dmx.universes:
    universe.input = "sACN"
dmx.sacn_enabled = True
end_s = time.monotonic() + TIMEOUT_S
while time.monotonic() < end_s and not all(any(x) for x in data._universes[1:]):
    time.sleep(0.1)
dmx.sacn_enabled = False
found = {
    "addresses": sorted([x.universe, x.address] for f in dmx.fixtures for x in f.dmx_breaks),
    "levels": {k: [*levels] for k, levels in enumerate(data._universes) if k},
}
(folder / "found.json").write_text(json.dumps(found))
# Threads of the add-on outlive it.
sys.stdout.flush()
os._exit(0)
