"""A lamp of emitters in Blender: its drives follow the painter, are discarded, kept and saved."""

import json
import os
import sys

sys.path.insert(0, os.path.dirname(__file__))

import bpy
from scripted_painter import controller, has_answer, open_painter, start_addon, wait_until
from shots import SIZE, new_shot

folder = sys.argv[-1]
new_shot()
start_addon(os.path.join(folder, "shot"))
lights_file = os.path.join(folder, "lamps.lights.toml")
with open(lights_file, "w") as file:
    file.write(
        "[light.Point]\nemitters = [\n"
        '    { name = "red", rgb = [6, 0, 0] },\n'
        '    { name = "green", rgb = [0, 6, 0] },\n'
        '    { name = "blue", rgb = [0, 0, 6] },\n]\n'
    )
bpy.context.scene.lightpaint_settings.lights_file = lights_file
bpy.ops.lightpaint.render()


def drives():
    """Return the drives that lamps have, by name."""
    shown = {lamp.name: lamp.get("lightpaint_drives") for lamp in bpy.data.lights}
    return {name: x.to_dict() for name, x in shown.items() if x is not None}


found = {"before": drives()}
painter = open_painter()
painter.brighten(*SIZE, gain=3.0)
wait_until(lambda: has_answer() and drives(), "an exact answer")
found["factors"] = {k: list(v) for k, v in controller.session.state.factors.items()}
found["shown"] = drives()
bpy.ops.lightpaint.discard()
found["discarded"] = drives()
painter.brighten(*SIZE, gain=5.0, stroke=2)
wait_until(lambda: has_answer() and drives(), "an exact answer to what was painted since")
found["applied"] = drives()
bpy.ops.lightpaint.apply()
bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, "shot.blend"))
bpy.ops.wm.open_mainfile(filepath=os.path.join(folder, "shot.blend"))
found["saved"] = drives()
bpy.ops.lightpaint.revert()
found["reverted"] = drives()
with open(os.path.join(folder, "found.json"), "w") as file:
    json.dump(found, file)
