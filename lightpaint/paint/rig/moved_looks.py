"""Looks with moved lights: subjects for their exports, and pictures while a page compares."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.basis import Basis, as_halves, denoise_mix
from lightpaint.display_text import some_names
from lightpaint.errors import LightpaintError
from lightpaint.files import write_text
from lightpaint.paint.background_threads import LatestWork, StoppedError
from lightpaint.paint.protocol import CompareLooks, Message, Notice, PictureUpdate, TaskStarted
from lightpaint.paint.rig.added_lights import new_emitter
from lightpaint.paint.rig.lamp_rig import LampRig
from lightpaint.paint.rig.light_mover import LightMover
from lightpaint.paint.session.look_library import LookLighting
from lightpaint.paint.session.moved_lights import Placed, added_names
from lightpaint.paint.session.picture_table import Picture, page_plane
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.session_access import StudioLinks
from lightpaint.paint.store.history_steps import name_in_view
from lightpaint.paint.subject import Subject, places_path
from lightpaint.placement import AddedLight, Move, PlacementRecord, is_panel
from lightpaint.scene import Scene
from lightpaint.scene.properties.site import Site


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


#: Names of the pictures of a look, raw and denoised, before its number.
PLAIN, CLEAN = "look_plane/", "look_clean/"


class LookComparison:
    """The pictures of compared looks, each with its own lights at its own places.

    mover: renders planes that no look has yet.
    """

    def __init__(self, links: StudioLinks, mover: LightMover) -> None:
        self._access, self._publisher, self._threads = links
        self._mover = mover
        self._work = LatestWork(self._show, self._publisher.publish)
        self._looks: Mapping[int, LookLighting] = {}
        self._offered = set[str]()  # names of pictures
        self._is_working = False

    def stop(self) -> None:
        """End the background work."""
        self._looks = {}
        self._work.stop()

    def handle(self, message: CompareLooks) -> list[Message]:
        """Start to show looks, instead of the looks of the last request. Raises PaintError."""
        self._looks = {number: self._access.looks.lighting(number) for number in message.looks}
        kept = {name for k in self._looks for name in (f"{PLAIN}{k}", f"{CLEAN}{k}")}
        for name in [x for x in self._offered if x.partition("@")[0] not in kept]:
            self._publisher.pictures.withdraw(name)
            self._offered.discard(name)
        self.renew()
        return [TaskStarted(task="compare")]

    def renew(self) -> None:
        """Show the looks again, with the present bases."""
        if not self._looks:
            return
        if not self._is_working:
            self._is_working = True
            self._threads.start_low_priority(self._work.run, "compare")
        self._work.give(self._looks)

    def _show(self, looks: Mapping[int, LookLighting]) -> None:
        """Publish pictures of looks with the planes that there are, then with rendered ones."""

        def check() -> None:
            if self._looks is not looks or not self._publisher.is_open:
                raise StoppedError

        rig = self._mover.rig
        try:
            estimated = [k for k, look in looks.items() if rig.unrendered(look.placed)]
            for number, look in looks.items():
                check()
                self._show_look(looks, number, look)
            for number in estimated:
                self._mover.finish(looks[number].placed, check)
                check()
                self._show_look(looks, number, looks[number])
        except StoppedError:
            pass
        except LightpaintError as error:
            self._publisher.publish(Notice(text=str(error), tone="warn"))

    def _show_look(
        self, looks: Mapping[int, LookLighting], number: int, look: LookLighting
    ) -> None:
        """Publish the pictures of a look in all views."""
        unmoved = self._access.session.bases
        for view, basis in enumerate(self._mover.rig.bases(unmoved, look.placed)):
            pictures = {
                name_in_view(f"{prefix}{number}", view): picture
                for prefix, picture in _pictures(basis, look, unmoved[view]).items()
            }
            self._publisher.publish_made(partial(self._put, looks, pictures))

    def _put(
        self, looks: Mapping[int, LookLighting], pictures: Mapping[str, Picture]
    ) -> PictureUpdate | None:
        """Offer pictures, unless other looks are compared by now."""
        if self._looks is not looks:
            return None
        self._offered |= {*pictures}
        return self._publisher.pictures.put_all(pictures)


def _pictures(basis: Basis, look: LookLighting, unmoved: Basis) -> dict[str, Picture]:
    """Return the picture of a look, raw and denoised, as large as planes of `unmoved` in pages.

    basis: has all its lights in their places.
    """
    dark = np.zeros(3)
    weights = np.array([look.emissions.get(name, dark) for name in basis.names])
    mixed = basis.mix(weights)
    clean = denoise_mix(basis, weights, mixed=mixed)
    return {name: as_halves(page_plane(x, unmoved)) for name, x in ((PLAIN, mixed), (CLEAN, clean))}
