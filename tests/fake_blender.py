"""As much of Blender as set_scene.py asks for, where there is none."""

from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np


class FakeLamp(dict[str, Any]):
    """An object with a lamp, and with custom properties."""

    type = "LIGHT"

    def __init__(self, name: str, data: Any) -> None:
        super().__init__()
        self.name, self.data, self._matrix = name, data, np.eye(4)

    @property
    def matrix_world(self) -> Any:
        return FakeMatrix(self._matrix)

    @matrix_world.setter
    def matrix_world(self, rows: Any) -> None:
        self._matrix = np.array(rows, float)


class FakeData(SimpleNamespace):
    """Data of a lamp, with custom properties."""

    def get(self, key: str) -> Any:
        return self.__dict__.get(key)

    def __setitem__(self, key: str, value: Any) -> None:
        self.__dict__[key] = value


class FakeMatrix(list[list[float]]):
    """A matrix as Blender has it: a sequence of its rows."""

    def __init__(self, rows: Any) -> None:
        super().__init__(np.array(rows, float).tolist())

    def to_scale(self) -> Any:
        return np.linalg.norm(np.array(self)[:3, :3], axis=0)


class FakeObjects(dict[str, Any]):
    """The objects of a file."""

    def new(self, name: str, data: Any) -> Any:
        self[name] = FakeLamp(name, data)
        return self[name]

    def remove(self, item: Any) -> None:
        del self[item.name]


def fake_blender() -> tuple[ModuleType, ModuleType]:
    """Return the modules bpy and mathutils."""
    bpy, vectors = ModuleType("bpy"), ModuleType("mathutils")
    lights = SimpleNamespace(new=lambda name, kind: FakeData(type=kind, users=1))
    bpy.app = SimpleNamespace(version=(4, 2, 0), version_string="4.2.0")  # type: ignore[attr-defined]
    bpy.data = SimpleNamespace(objects=FakeObjects(), worlds={}, lights=lights)  # type: ignore[attr-defined]
    scene_link = SimpleNamespace(link=lambda item: None)
    scene = SimpleNamespace(collection=SimpleNamespace(objects=scene_link))
    shown = SimpleNamespace(hide_render=False, objects=())
    layers = SimpleNamespace(collection=shown, exclude=False, children=())
    layer = SimpleNamespace(update=lambda: None, layer_collection=layers)
    bpy.context = SimpleNamespace(scene=scene, view_layer=layer)  # type: ignore[attr-defined]
    vectors.Matrix = FakeMatrix  # type: ignore[attr-defined]
    return bpy, vectors


def run_in(modules: tuple[ModuleType, ModuleType], text: str, patch: Any) -> None:
    """Run a script with them. patch: pytest's MonkeyPatch."""
    import sys

    for module in modules:
        patch.setitem(sys.modules, module.__name__, module)
    exec(compile(text, "set_scene.py", "exec"), {"__name__": "script"})
