"""All looks of a manifest: those of its tables, and the frames of its sequences."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from lightpaint.batch.checks import SHOWN, check_handover, check_sequence, check_wanted
from lightpaint.batch.entries import Entry, looks_of
from lightpaint.batch.manifest import Manifest
from lightpaint.batch.names import is_reserved, name_clashes
from lightpaint.batch.sequence import at_frame
from lightpaint.screen import some_names


def entries_of(manifest: Manifest) -> tuple[Entry, ...]:
    """All looks in the order of the manifest; what is wrong is added to its mistakes."""
    found = looks_of(manifest)
    for where, sequence in manifest.sequences:
        found += _of_sequence(manifest, found, where, sequence)
    _check_names(manifest, found)
    return tuple(found)


def _check_names(manifest: Manifest, looks: Sequence[Entry]) -> None:
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


def _of_sequence(
    manifest: Manifest, looks: Sequence[Entry], where: str, said: Mapping[str, Any]
) -> list[Entry]:
    """A look for each frame."""
    mistakes, by_name = manifest.mistakes, {look.name: look for look in looks}
    before, through = len(mistakes.found), said.get("through", ())
    check_sequence(mistakes, where, said)
    if len(mistakes.found) > before:
        return []
    if unknown := [name for name in through if name not in by_name]:
        if not mistakes.found:  # else it may be a look that has mistakes of its own
            mistakes.add(where, f"through: no look is called {unknown[0]!r}")
        return []
    ends = [by_name[name] for name in through]
    path = said.get("sensors")
    if any(_place(end, path) != _place(ends[0], path) for end in ends):
        mistakes.add(where, "through: its looks are of different scenes, sensors or bases")
    elif path and not ends[0].scenes:
        mistakes.add(where, "sensors: its looks are of no scene, which other sensors could see")
    elif not path and any(end.by_sensor for end in ends):
        mistakes.add(where, "through: a look of several views has no one picture: take single ones")
    check_wanted(mistakes, where, said)
    final = mistakes.final(said.get("render", {}), where)
    handover = mistakes.handover(said.get("export", {}), where, manifest.folder)
    if len(mistakes.found) > before:
        return []
    want = tuple(said.get("want", SHOWN))
    how: dict[str, Any] = {"want": want, "final": final, "handover": handover}
    made = [replace(frame, where=where, **how) for frame in _frames(said, ends)]
    if "render" in want and not ends[0].scenes:
        mistakes.add(where, "want has 'render', which needs the scene of its looks")
    if "export" in want:
        check_handover(mistakes, where, handover, made[0])
    return made


def _frames(said: Mapping[str, Any], ends: Sequence[Entry]) -> Iterator[Entry]:
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


def _place(entry: Entry, path: Sequence[str] | None) -> tuple[Any, ...]:
    """What two looks of one sequence have in common. path: of sensors, which theirs give way to."""
    if path:
        return tuple(replace(scene, sensor=None) for scene in entry.scenes[:1]), entry.basis
    return entry.scenes, entry.basis
