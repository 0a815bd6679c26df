"""A painter that is started otherwise: without OpenColorIO, and for a shot of another size."""

import json
import os
import shutil
import sys
from pathlib import Path

sys.path.insert(0, os.path.dirname(__file__))

import bpy
from scripted_painter import controller, open_painter, start_addon

folder = Path(sys.argv[-1])
program = folder / "without" / "lightpaint"
program.parent.mkdir()
refusal = "views of OpenColorIO need an extra package: pip install 'lightpaint[ocio]'"
program.write_text(
    f'#!/bin/sh\ncase "$*" in *ocio:*) echo "lightpaint paint: {refusal}" >&2; exit 2;; esac\n'
    f'exec {shutil.which("lightpaint")} "$@"\n'
)
program.chmod(0o755)
os.environ["PATH"] = f"{program.parent}:{os.environ['PATH']}"

start_addon(str(folder / "shot"))
scene = bpy.context.scene
scene.cycles.samples, scene.render.resolution_x, scene.render.resolution_y = 1, 32, 18
open_painter()
controller.end_paint()
scene.render.resolution_x = 48
open_painter()
controller.end_paint()
sessions = sorted(file.name for file in (folder / "shot" / "painting").glob("*.db"))
(folder / "found.json").write_text(json.dumps(sessions))
