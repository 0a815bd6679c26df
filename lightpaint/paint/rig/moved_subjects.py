"""The subjects of a session with moved lights, for its exports and verification."""

from dataclasses import replace
from pathlib import Path

from lightpaint.files import write_text
from lightpaint.paint.rig.added_lights import new_emitter
from lightpaint.paint.rig.lamp_rig import LampRig
from lightpaint.paint.session.moved_lights import Placed, added_names
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.subject import Subject, places_path
from lightpaint.placement.placement import AddedLight, Move
from lightpaint.placement.placement_record import PlacementRecord


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


def write_places(folder: Path, rig: LampRig, placed: Placed) -> Path:
    """Write the places of moved and added lights for `solve` to `folder`; return the file."""
    added = added_names(placed)
    moves = tuple(
        Move(name, rig.site(name, {}), rig.site(name, values), gain_share=0.0)
        for name, values in placed.items()
        if name not in added
    )
    additions = tuple(AddedLight(new_emitter(x, placed[x]), gain_share=0.0) for x in added)
    path = places_path(folder)
    write_text(path, PlacementRecord(moves, additions, 0.0, 0.0).to_json())
    return path
