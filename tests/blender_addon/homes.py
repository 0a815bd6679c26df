"""Shots of files that are saved: the first time, under another name, during a solve."""

import json
import os
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, os.environ["ADDON_FOLDER"])

import bpy
import lightpaint_blender
from lightpaint_blender.interface.controller import controller
from lightpaint_blender.shot.shot_home import is_kept, shot_folder

folder = Path(sys.argv[-1])
found: dict[str, Any] = {}


def save(name: str) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / name))


def note(key: str) -> None:
    """Note where the shot is now, its looks, and what the panel says."""
    shot = shot_folder(scene)
    looks = [name for name, _ in shot.read_looks()]
    found[key] = [str(shot.path), looks, controller.message, controller.is_error]


def keep_look(name: str) -> None:
    """Keep a look in the shot's folder, as a painter's."""
    shot = shot_folder(scene)
    shot.check_writable()
    shot.write_looks([(name, {})])


lightpaint_blender.register()
scene = bpy.context.scene
found["temporary"] = str(bpy.app.tempdir)
found["kept unsaved"] = is_kept(scene)
keep_look("first")
picture = bpy.data.images.new("picture", 4, 4)
picture.filepath_raw = str(shot_folder(scene).path / "painting.png")
picture.pixels[0] = 1.0
note("unsaved")
save("a.blend")
found["kept saved"] = is_kept(scene)
found["picture"] = [picture.filepath_raw, picture.pixels[0]]
note("saved")
save("b.blend")
keep_look("second")
note("another name")

# A file of that name had a shot of its own, which is kept under another name.
save("a.blend")
note("name of another")

# While a solve runs, its files stay where they are.
controller.solve = object()
save("c.blend")
note("busy")
controller.solve = None
controller.tick()
note("idle")

# Something else is where the copy would be written.
(folder / "d.lightpaint.part").write_text("mine")
save("d.blend")
note("in the way")
(folder / "d.lightpaint.part").unlink()
save("d.blend")
note("out of the way")

bpy.ops.wm.read_homefile(use_empty=True)
scene = bpy.context.scene
note("new file")


class RunningPainter:
    """A painter that works on the shot until Blender ends."""

    is_over = False

    def end(self) -> None:
        (folder / "painter-ended").write_text("")


keep_look("last")
controller.session = RunningPainter()
save("last.blend")
note("during a painter")
(folder / "found.json").write_text(json.dumps(found))
