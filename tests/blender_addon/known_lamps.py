"""Known lamps, seen through one of Blender's views, are to be found again from that picture."""

import json
import os
import sys

sys.path.insert(0, os.path.dirname(__file__))

import bpy
from scripted_painter import controller, start_addon, wait_until
from shots import new_shot

folder, view = sys.argv[-2:]
#: Multipliers that the picture is rendered with. Lamps keep their colours, as a solve lets them.
KNOWN = {"Area": 0.4, "Point": 2.5, "Spot": 2.0}

scene = new_shot(view=view)
scene.cycles.samples = 128  # noise bends through a tone curve, which looks like other light
start_addon(os.path.join(folder, "shot"))
bpy.ops.lightpaint.render()

before = {lamp.name: lamp.energy for lamp in bpy.data.lights}
for name, factor in KNOWN.items():
    bpy.data.lights[name].energy *= factor
picture = os.path.join(folder, "known.png")
scene.render.image_settings.file_format = "PNG"
scene.render.image_settings.color_depth = "16"
scene.render.filepath, scene.cycles.seed = picture, 3
bpy.ops.render.render(write_still=True)
scene.cycles.seed = 0
for name, energy in before.items():
    bpy.data.lights[name].energy = energy

bpy.context.tool_settings.image_paint.canvas = bpy.data.images.load(picture)
bpy.ops.lightpaint.solve_image()
wait_until(lambda: controller.solve is None, "an answer")
found = {lamp.name: lamp.energy / before[lamp.name] for lamp in bpy.data.lights}
answer = {"known": KNOWN, "found": found, "message": controller.message}
with open(os.path.join(folder, "known.json"), "w") as file:
    json.dump(answer, file)
