"""The subjects of a session with moved lights, for its exports and verification."""

from dataclasses import replace

from lightpaint.paint.rig.lamp_rig import LampRig
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.subject import Subject


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
