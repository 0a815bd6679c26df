"""A client that paints as a script, and the add-on around it; imported within Blender only."""

import array
import os
import sys
import time
from collections.abc import Callable
from typing import Any

sys.path.insert(0, os.environ["ADDON_FOLDER"])
sys.path.insert(0, os.path.dirname(__file__))

import bpy
import lightpaint_blender
from lightpaint_blender.interface.controller import controller
from lightpaint_blender.painter.painter_link import SocketClient
from lightpaint_blender.painter.painter_messages import from_bytes, to_bytes
from lightpaint_blender.painter.program import running_painter

#: Seconds that anything takes on a busy machine.
PATIENCE_S = 200.0


def wait_until(is_so: Callable[[], object], description: str) -> None:
    """Do what Blender's timer would do, until something is so."""
    end = time.monotonic() + PATIENCE_S
    while not is_so():
        controller.tick()
        session = controller.session
        state = (controller.message, session.message if session else "", description)
        assert time.monotonic() < end, state
        time.sleep(0.02)


class ScriptedPainter:
    """A client of the painter that the add-on has started."""

    def __init__(self) -> None:
        found = running_painter(controller.session.folder.session)
        self._socket, self._seq = SocketClient.open(*found), 0
        self.state = self.ask("hello", version=3)

    def ask(self, kind: str, covered: Any = None, **fields: Any) -> dict[str, Any]:
        """Send a request, and return its answer."""
        self._seq += 1
        described, buffers = [], []
        if covered is not None:
            shape = fields["region"][1], fields["region"][3]
            described = [{"name": "importance", "dtype": "float32", "shape": shape}]
            buffers = [covered.tobytes()]
        content = {"kind": kind, "seq": self._seq, **fields, "buffers": described}
        self._socket.send(to_bytes(content, buffers))
        while True:
            answer, _ = from_bytes(self._socket.receive())
            if answer.get("reply") == self._seq:
                assert answer["kind"] != "failed", answer["text"]
                return answer

    def brighten(self, width: int, height: int, *, gain: float, stroke: int = 1) -> None:
        """Ask for more light in the left third of the picture."""
        covered = array.array("f", [float(x < width // 3) for x in range(width)] * height)
        self.ask(
            "paint",
            covered,
            stroke=stroke,
            region=[0, height, 0, width],
            is_final=True,
            label="brighter",
            layer=1,
            properties={"id": 1, "kind": "adjust", "gain": gain},
        )


def has_answer() -> bool:
    """Return whether the painter has found its exact answer to what was painted."""
    return has_moved() and bool(controller.session.state.is_exact)


def has_moved() -> bool:
    """Return whether the painter's answer differs from what was rendered."""
    factors = controller.session.state.factors.values()
    return any(abs(value - 1) > 1e-3 for factor in factors for value in factor)


def open_painter() -> ScriptedPainter:
    """Press Paint, and wait until the painter is there."""
    bpy.ops.lightpaint.paint()
    wait_until(lambda: controller.session and controller.session.state.is_open, "the painter")
    return ScriptedPainter()


def start_addon(folder: str) -> None:
    """Enable the add-on, and let shots be kept in a folder."""
    lightpaint_blender.register()
    bpy.context.scene.lightpaint_settings.folder = folder


def contents() -> dict[str, Any]:
    """Return all in this file that the add-on could have changed."""
    scene, layer = bpy.context.scene, bpy.context.view_layer
    image = scene.render.image_settings
    found: dict[str, Any] = {
        "engine": scene.render.engine,
        "output": [scene.render.filepath, image.file_format, scene.render.use_compositing],
        "layer": [layer.use_pass_cryptomatte_object, layer.cycles.denoising_store_passes],
        "groups": [group.name for group in layer.lightgroups],
        "properties": [x.name for x in owners() if "lightpaint_memory" in x],
        "actions": sorted(action.name for action in bpy.data.actions),
    }
    for item in [*bpy.data.objects, *bpy.data.worlds]:
        found[f"group of {item.name}"] = item.lightgroup
    for lamp in bpy.data.lights:
        found[f"lamp {lamp.name}"] = [lamp.energy, *lamp.color, lamp.animation_data is None]
    for owner in [*bpy.data.materials, *bpy.data.worlds]:
        if owner.node_tree:
            found[f"nodes of {owner.name}"] = tree_contents(owner.node_tree)
    return found


def owners() -> list[Any]:
    """Return all data that may remember something."""
    data = bpy.data
    return [*data.scenes, *data.objects, *data.lights, *data.materials, *data.worlds]


def tree_contents(tree: Any) -> list[Any]:
    """Return nodes, values and links of a tree."""
    values = [
        (node.name, socket.identifier, plain(socket.default_value))
        for node in tree.nodes
        for socket in node.inputs
        if hasattr(socket, "default_value")
    ]
    links = sorted((x.from_node.name, x.to_node.name, x.to_socket.identifier) for x in tree.links)
    return [values, links, tree.animation_data is None]


def plain(value: Any) -> Any:
    return list(value) if hasattr(value, "__len__") and not isinstance(value, str) else str(value)
