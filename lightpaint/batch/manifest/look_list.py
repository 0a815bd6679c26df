"""All looks of a manifest: those of its tables, and the frames of its sequences."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from lightpaint.batch.manifest.checks import SHOWN, check_handover, check_sequence, check_wanted
from lightpaint.batch.manifest.entries import MOST_LOOKS, LookEntries, LookEntry, looks_of
from lightpaint.batch.manifest.folder_names import is_reserved, name_clashes
from lightpaint.batch.manifest.keys import MOST_FRAMES, Mistakes
from lightpaint.batch.manifest.manifest import Manifest, Table
from lightpaint.batch.manifest.sequence import at_frame
from lightpaint.errors import BatchError
from lightpaint.screen import some_names


def entries_of(manifest: Manifest) -> LookEntries:
    """Return all looks in the order of the manifest; what is wrong is added to its mistakes."""
    looks = looks_of(manifest)
    for table in manifest.sequences:
        looks.whole.extend(_of_sequence(manifest, looks, table))
        if len(looks.whole) > MOST_LOOKS + MOST_FRAMES:
            raise BatchError(
                f"{manifest.path} asks for more than {MOST_LOOKS} looks and {MOST_FRAMES} frames: "
                "make several batches of it"
            )
    named = [entry for _, entry in looks.rest if entry.name]
    _check_names(manifest, [*looks.whole, *named])
    return looks


def _check_names(manifest: Manifest, looks: Sequence[LookEntry]) -> None:
    """Add to the mistakes each look whose folder another look, or the batch itself, would use."""
    for look in looks:
        if is_reserved(look.name):
            manifest.mistakes.add(
                look.where,
                f"a look cannot be called {look.name!r}, where the batch has files of its own: "
                "say name = ...",
            )
    for same in name_clashes(look.name for look in looks):
        wheres = some_names(dict.fromkeys(x.where for x in looks if x.name in same), " and ")
        names = " and ".join(map(repr, same))
        said = f"more than one look would be called {names}: say name = ... in one of them"
        if len(same) > 1:
            said = (
                f"{names} would be one folder on disks that do not tell case: say name = ... "
                "in one of them"
            )
        manifest.mistakes.add(wheres, said)


def _of_sequence(manifest: Manifest, looks: LookEntries, table: Table) -> list[LookEntry]:
    """Return a look for each frame; none of a sequence with mistakes."""
    mistakes, where, said = manifest.mistakes, table.where, table.said
    by_name = {look.name: look for look in looks.whole}
    before = len(mistakes.found)
    check_sequence(mistakes, table)
    check_wanted(mistakes, table)
    final = mistakes.final(said.get("render", {}), where)
    handover = mistakes.handover(said.get("export", {}), where, manifest.folder)
    ends = [by_name[name] for name in said.get("through", ()) if name in by_name]
    for name in (name for name in said.get("through", ()) if name not in by_name):
        if not any(_may_make(name, entry) for _, entry in looks.rest):
            mistakes.add(where, f"through: no look is called {name!r}")
    if ends:
        _check_ends(mistakes, where, ends, said)
    if len(mistakes.found) > before or table.unclear or len(ends) < len(said["through"]):
        return []
    want = tuple(said.get("want", SHOWN))
    how: dict[str, Any] = {"want": want, "final": final, "handover": handover}
    made = [replace(frame, where=where, **how) for frame in _frames(said, ends)]
    if "render" in want and not ends[0].scenes:
        mistakes.add(where, "want has 'render', which needs the scene of its looks")
    if "export" in want:
        check_handover(mistakes, where, handover, made[0])
    return made


def _check_ends(
    mistakes: Mistakes, where: str, ends: Sequence[LookEntry], said: Mapping[str, Any]
) -> None:
    """Add why there is nothing between the looks that a sequence goes through."""
    path = said.get("sensors")
    if any(_place(end, path) != _place(ends[0], path) for end in ends):
        mistakes.add(where, "through: its looks are of different scenes, sensors or bases")
    elif path and not ends[0].scenes:
        mistakes.add(where, "sensors: its looks are of no scene, which other sensors could see")
    elif not path and any(end.by_sensor for end in ends):
        mistakes.add(where, "through: a look of several views has no one picture: take single ones")


def _may_make(name: str, entry: LookEntry) -> bool:
    """Return whether a table might make a look of that name without its mistakes."""
    if not entry.name:
        return True
    return name == entry.name or name.startswith(f"{entry.name}-")


def _frames(said: Mapping[str, Any], ends: Sequence[LookEntry]) -> Iterator[LookEntry]:
    """Each frame: what lies between two of `ends`, seen as they are or by its place on a path."""
    path, through = said.get("sensors"), said["through"]
    frames = len(path) if path else said["frames"]
    digits = len(str(frames - 1))
    for k in range(frames):
        first, share = at_frame(k, frames, len(through))
        scenes = ends[first].scenes
        yield replace(
            ends[first],
            name=f"{said['name']}-{k:0{digits}}",
            scenes=(replace(scenes[0], sensor=path[k]),) if path else scenes,
            by_sensor=False,
            paintings=(),
            lighting="",
            variation="",
            of=tuple(through[first : first + 2]),
            share=share,
            space=said.get("space", "log"),
        )


def _place(entry: LookEntry, path: Sequence[str] | None) -> tuple[Any, ...]:
    """What two looks of one sequence have in common. path: of sensors, which theirs give way to."""
    if path:
        return tuple(replace(scene, sensor=None) for scene in entry.scenes[:1]), entry.basis
    return entry.scenes, entry.basis
