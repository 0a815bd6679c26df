#!/usr/bin/env bash
# Mitsuba 3.9.1 (mitsuba==3.9.1 with its Dr.Jit, numpy==2.4.6), variant scalar_rgb.
#
# An emitter written in Python may stand in a shape, as `area` does. `mi.Emitter` has `set_shape` and
# `set_scene`, and one expects that a Python class can override them, to take what it needs of its
# shape once. Neither is called: the shape calls the C++ method. When the constructor runs there is no
# shape yet, and `get_shape()` returns it only once the scene is loaded, at the first ray.
#
# Output seen:
#   overridden methods called while loading: []
#   in the constructor: None
#   after loading: Shape
#
# Exit status 0 while that is so, 1 once it changes.
set -euo pipefail
unset PYTHONPATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mitsuba==3.9.1 numpy==2.4.6
"$folder/venv/bin/python" - <<'PYTHON'
import sys

import mitsuba as mi

mi.set_variant("scalar_rgb")
called, at_first = [], []


class Lamp(mi.Emitter):
    def __init__(self, props):
        super().__init__(props)
        self.m_flags = +mi.EmitterFlags.Surface
        at_first.append(self.get_shape())

    def set_shape(self, shape):
        called.append("set_shape")
        super().set_shape(shape)

    def set_scene(self, scene):
        called.append("set_scene")
        super().set_scene(scene)


mi.register_emitter("lamp", Lamp)
scene = mi.load_dict({"type": "scene", "x": {"type": "rectangle", "lamp": {"type": "lamp"}}})
later = scene.emitters()[0].get_shape()
print("overridden methods called while loading:", called)
print("in the constructor:", at_first[0])
print("after loading:", type(later).__name__)
sys.exit(bool(called) or at_first[0] is not None or later is None)
PYTHON
