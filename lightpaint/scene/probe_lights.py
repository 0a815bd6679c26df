"""A copy of a scene lit only by point lights, to probe many candidate positions."""

import hashlib
from collections.abc import Sequence
from dataclasses import replace

from lightpaint.arrays import Position
from lightpaint.scene.changed_emitters import with_points
from lightpaint.scene.lights.emitters import point_emitter
from lightpaint.scene.lights.light import free_names, lights_of
from lightpaint.scene.lights.light_choice import REST
from lightpaint.scene.lights.lights_file import SceneRequests
from lightpaint.scene.properties.emission import EmitterSetting
from lightpaint.scene.scene import Scene


def lit_by_points(scene: Scene, positions: Sequence[Position]) -> Scene:
    """Return a scene lit only by point lights, one at each of `positions`, in their order.

    The scene's own emitters become black but stay in place, so that they still block and reflect
    light. Together they are the last light, which is fixed.
    """
    names = free_names("candidate", len(positions), [x.name for x in scene.emitters])
    dark = {x.node: EmitterSetting(x.kind, (0.0, 0.0, 0.0), 0.0) for x in scene.emitters}
    parsed = with_points(scene.parsed, dark, dict(zip(names, positions, strict=True)))
    points = tuple(
        point_emitter(name, node, position)
        for name, node, position in zip(
            names, parsed.emitter_nodes[-len(names) :], positions, strict=True
        )
    )
    members = {name: [name] for name in names}
    members |= {free_names(REST, 1, members)[0]: [x.name for x in scene.emitters]}
    lit_by = hashlib.sha256(repr((scene.content, positions)).encode()).hexdigest()[:32]
    emitters = (*scene.emitters, *points)
    return replace(
        scene,
        emitters=emitters,
        lights=lights_of(emitters, members, fixed=[*members][-1:]),
        content=lit_by,
        requests=SceneRequests(),
        parsed=parsed,
    )
