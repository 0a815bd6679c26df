"""The subjects of a session with moved lights, for its exports and verification."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from lightpaint.display_text import some_names
from lightpaint.files import write_text
from lightpaint.paint.rig.added_lights import new_emitter
from lightpaint.paint.rig.lamp_rig import LampRig
from lightpaint.paint.session.moved_lights import Placed, added_names
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.subject import Subject, places_path
from lightpaint.placement.paths.panel_lights import is_panel
from lightpaint.placement.placement import AddedLight, Move, PlacementRecord
from lightpaint.scene.properties.pose import Site
from lightpaint.scene.scene import Scene


def of_moved_scenes(
    snapshot: SessionSnapshot, rig: LampRig
) -> tuple[tuple[Subject, ...], SessionSnapshot]:
    """Return subjects and snapshot with scenes whose lights have their places in the session."""
    placed, subjects = snapshot.requests.placed, rig.subjects
    if not placed:
        return subjects, snapshot
    scenes = [rig.moved_scene(placed, k) for k in range(len(subjects))]
    moved = tuple(replace(x, scene=scene) for x, scene in zip(subjects, scenes, strict=True))
    bases = tuple(
        replace(basis, origin=replace(basis.origin, scene_identity=scene.identity))
        for basis, scene in zip(snapshot.bases, scenes, strict=True)
    )
    return moved, replace(snapshot, bases=bases)


def shadow_remark(rig: LampRig, placed: Placed) -> str:
    """Return which moved and added panels cast a shadow in a render of the answer, but not in the
    pictures of other lights; "" if there is none.
    """
    names = [name for name, values in placed.items() if _has_shape(rig, name, values)]
    if not names:
        return ""
    verb, whose = ("casts", "its") if len(names) == 1 else ("cast", "their")
    return (
        f"In it {some_names(names)} {verb} {whose} shadow, which the pictures of the other lights "
        "do not have yet"
    )


def _has_shape(rig: LampRig, name: str, values: Mapping[str, Any]) -> bool:
    return values.get("kind") == "panel" or (
        "kind" not in values and is_panel(rig.scene.light(name))
    )


def _site(scene: Scene, name: str) -> Site:
    return scene.light(name).members[0].site


def write_places(folder: Path, rig: LampRig, placed: Placed) -> Path:
    """Write the places of moved and added lights for `solve` to `folder`; return the file."""
    added, moved_scene = added_names(placed), rig.moved_scene(placed)
    # As in the scene: the rig has panels as squares of their size.
    moves = tuple(
        Move(name, _site(rig.scene, name), _site(moved_scene, name), gain_share=0.0)
        for name in placed
        if name not in added
    )
    additions = tuple(AddedLight(new_emitter(x, placed[x]), gain_share=0.0) for x in added)
    path = places_path(folder)
    write_text(path, PlacementRecord(moves, additions, 0.0, 0.0).to_json())
    return path
