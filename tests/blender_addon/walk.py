"""The whole way in Blender: prepare, render, paint, apply, key, save, reopen, revert."""

import json
import os
import sys

sys.path.insert(0, os.path.dirname(__file__))

import bpy
from scripted_painter import (
    contents,
    controller,
    has_answer,
    open_painter,
    start_addon,
    wait_until,
)
from shots import SIZE, available_view, new_shot

folder = sys.argv[-1]
view = available_view("AgX")
found = {"view": view}
new_shot(view=view)
start_addon(os.path.join(folder, "shot"))
before = contents()

bpy.ops.lightpaint.prepare()
found["groups"] = contents()["groups"]
bpy.ops.lightpaint.render()
written = os.stat(render_file := os.path.join(folder, "shot", "shot.exr")).st_mtime_ns
bpy.ops.lightpaint.render()
found["rendered once"] = os.stat(render_file).st_mtime_ns == written
found["output is put back"] = contents()["output"] == before["output"]

painter = open_painter()
found["shown view"] = painter.state["transform"]
found["still unpainted"] = [lamp.energy for lamp in bpy.data.lights]
painter.brighten(*SIZE, gain=2.0)
wait_until(lambda: bpy.ops.lightpaint.discard.poll(), "a preview")
bpy.ops.lightpaint.discard()
wait_until(has_answer, "an exact answer to what was discarded")
found["still discarded"] = [lamp.energy for lamp in bpy.data.lights]
painter.brighten(*SIZE, gain=4.0, stroke=2)
wait_until(lambda: bpy.ops.lightpaint.discard.poll(), "a preview of what was painted since")
wait_until(has_answer, "an exact answer")
painter.ask("save_look", name="Evening")
wait_until(lambda: controller.session.state.looks, "a look")
found["factors"] = {k: list(v) for k, v in controller.session.state.factors.items()}
preview = contents()
found["lamps follow"] = preview != before

# A preview that is saved is still one when the file is opened again.
bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, "shot.blend"))
bpy.ops.wm.open_mainfile(filepath=os.path.join(folder, "shot.blend"))
found["kept by the file"] = contents() == preview
found["painter has ended"] = controller.session is None
bpy.ops.lightpaint.discard()
found["discarded"] = [lamp.energy for lamp in bpy.data.lights]

bpy.ops.lightpaint.apply_look(index=0)
found["look"] = [lamp.energy for lamp in bpy.data.lights]
applied = contents()

# The relit shot, rendered anew into another folder.
settings = bpy.context.scene.lightpaint_settings
settings.folder = os.path.join(folder, "relit")
bpy.context.scene.cycles.seed = 7
bpy.ops.lightpaint.render()
written = os.stat(relit_file := os.path.join(folder, "relit", "shot.exr")).st_mtime_ns
bpy.ops.lightpaint.render()
found["relit once"] = os.stat(relit_file).st_mtime_ns == written
settings.folder = os.path.join(folder, "shot")

bpy.context.scene.frame_set(10)
bpy.ops.lightpaint.key_look(index=0)
found["keys"] = len(bpy.data.actions)

bpy.ops.lightpaint.revert()
bpy.context.scene.cycles.seed = 0
after = contents()
found["reverted"] = [key for key in before if before[key] != after.get(key)]
bpy.ops.wm.save_mainfile()
bpy.ops.wm.open_mainfile(filepath=os.path.join(folder, "shot.blend"))
after = contents()
found["reverted and reopened"] = [key for key in before if before[key] != after.get(key)]
with open(os.path.join(folder, "found.json"), "w") as file:
    json.dump(found, file)
