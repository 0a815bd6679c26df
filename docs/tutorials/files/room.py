"""Runs in Blender: builds a room with five lights and a rolling ball, saves it, renders frames.

    blender --background --factory-startup --python docs/tutorials/files/room.py -- 480 64 1 12 24

Arguments: the width in pixels, samples, and frames from 1 to 24. It writes room.blend and
shot.0001.exr and so on, with a layer for each light group, into the current folder.
"""

import os
import runpy
import sys

import bpy

arguments = sys.argv[sys.argv.index("--") + 1 :]
shot = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../images/frames_shot.py")
sys.argv = ["frames_shot.py", os.getcwd(), *arguments]
runpy.run_path(shot)
bpy.ops.wm.save_as_mainfile(filepath=os.path.join(os.getcwd(), "room.blend"))
