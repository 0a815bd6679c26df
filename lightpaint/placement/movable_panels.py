"""Panels of a scene: area lights that are rectangles or disks of their own, and can be moved."""

import math
from collections.abc import Collection
from dataclasses import replace

import numpy as np

from lightpaint.arrays import Position
from lightpaint.placement.paths.panel_site import Outline, PanelSite
from lightpaint.placement.space.free_space import as_position
from lightpaint.scene.lights.light import Light
from lightpaint.scene.properties.emission import MULTIPLE
from lightpaint.scene.properties.site import Site
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_tree import without_emitters

#: Cosine of the angle between the sides of a rectangle, up to which it counts as one.
SHEAR = 1e-4


def is_panel(light: Light) -> bool:
    """Return whether a light of the scene is a rectangle or disk of its own, in one colour."""
    if light.plugin != "area" or light.is_fixed or len(light.members) > 1:
        return False
    [panel] = light.members
    return light.unit != MULTIPLE and panel.site.direction is not None and bool(panel.unit_flux)


def panel_site(scene: Scene, panel: Light, site: Site) -> PanelSite:
    """Return the place of a panel of the scene for frozen paths; of a disk a square of its area.

    site: where it is now.
    """
    [emitter] = panel.members
    assert emitter.unit_flux is not None
    assert emitter.site.direction is not None
    side = math.sqrt(emitter.unit_flux / math.pi)
    half_sides = _half_sides(scene, emitter.node)
    outline = None if half_sides is None else Outline(emitter.site.direction, half_sides)
    return PanelSite(site.position, site.direction, side=side, outline=outline)


def _half_sides(scene: Scene, emitter: int) -> tuple[Position, Position] | None:
    """Return the half sides of a rectangle; None for other shapes, and for a sheared one."""
    props = scene.parsed.state.nodes[scene.parsed.shape_of[emitter]].props
    if props.plugin_name() != "rectangle":
        return None
    matrix = np.eye(4) if "to_world" not in props else np.array(props["to_world"].matrix)
    one, other = matrix.reshape(4, 4)[:3, :2].T
    is_sheared = abs(one @ other) > SHEAR * np.linalg.norm(one) * np.linalg.norm(other)
    return None if is_sheared else (as_position(one), as_position(other))


def without_panels(scene: Scene, names: Collection[str]) -> Scene:
    """Return the scene without those of the lights `names` that are panels, and their shapes.

    Paths along which a panel is tried elsewhere must not meet it where it hangs now.
    """
    panels = [light for light in scene.lights if light.name in names and is_panel(light)]
    if not panels:
        return scene
    nodes = {light.members[0].node for light in panels}
    return replace(
        scene,
        parsed=without_emitters(scene.parsed, nodes),
        emitters=tuple(x for x in scene.emitters if x.node not in nodes),
        lights=tuple(x for x in scene.lights if x not in panels),
    )
