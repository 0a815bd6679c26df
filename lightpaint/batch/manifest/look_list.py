"""All looks of a manifest: those of its tables, and the frames of its sequences."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from lightpaint.batch.manifest.checks import (
    GIVEN_LIGHTING_STEPS,
    check_handover,
    check_sequence,
    check_step_tables,
)
from lightpaint.batch.manifest.entries import MAX_LOOKS, LookEntries, LookEntry, looks_of
from lightpaint.batch.manifest.folder_names import is_reserved, name_clashes
from lightpaint.batch.manifest.keys import MAX_FRAMES, Mistakes
from lightpaint.batch.manifest.manifest import Manifest, Table
from lightpaint.batch.manifest.sequence import frame_position
from lightpaint.display_text import some_names
from lightpaint.errors import BatchError


def entries_of(manifest: Manifest) -> LookEntries:
    """Return all looks in the order of the manifest, and add errors to its mistakes."""
    looks = looks_of(manifest)
    for table in manifest.sequences:
        looks.complete.extend(_sequence_looks(manifest, looks, table))
        if len(looks.complete) > MAX_LOOKS + MAX_FRAMES:
            raise BatchError(
                f"{manifest.path} asks for more than {MAX_LOOKS} looks and {MAX_FRAMES} frames: "
                "make several batches of it"
            )
    named_entries = [entry for _, entry in looks.incomplete if entry.name]
    _check_names(manifest, [*looks.complete, *named_entries])
    return looks


def _check_names(manifest: Manifest, looks: Sequence[LookEntry]) -> None:
    """Add each look whose folder another look, or the batch itself, would use to the mistakes."""
    for look in looks:
        if is_reserved(look.name):
            manifest.mistakes.add(
                look.label,
                f"a look cannot be called {look.name!r}, the name of a file of the batch itself: "
                "set name = ...",
            )
    for names_of_folder in name_clashes(look.name for look in looks):
        labels = some_names(
            dict.fromkeys(x.label for x in looks if x.name in names_of_folder), " and "
        )
        names = " and ".join(map(repr, names_of_folder))
        text = f"more than one look would be called {names}: set name = ... in one of them"
        if len(names_of_folder) > 1:
            text = (
                f"{names} would be one folder on disks that ignore case: set name = ... "
                "in one of them"
            )
        manifest.mistakes.add(labels, text)


def _sequence_looks(manifest: Manifest, looks: LookEntries, table: Table) -> list[LookEntry]:
    """Return a look for each frame; none if the sequence has mistakes."""
    mistakes, label, values = manifest.mistakes, table.label, table.values
    by_name = {look.name: look for look in looks.complete}
    mistakes_before = len(mistakes.lines)
    check_sequence(mistakes, table)
    check_step_tables(mistakes, table)
    final = mistakes.final(values.get("render", {}), label)
    handover = mistakes.handover(values.get("export", {}), label, manifest.folder)
    ends = [by_name[name] for name in values.get("through", ()) if name in by_name]
    for name in (name for name in values.get("through", ()) if name not in by_name):
        if not any(_may_become(name, entry) for _, entry in looks.incomplete):
            mistakes.add(label, f"through: no look is called {name!r}")
    if ends:
        _check_ends(mistakes, label, ends, values)
    if (
        len(mistakes.lines) > mistakes_before
        or table.unclear_keys
        or len(ends) < len(values["through"])
    ):
        return []
    steps = tuple(values.get("want", GIVEN_LIGHTING_STEPS))
    options: dict[str, Any] = {"want": steps, "final": final, "handover": handover}
    looks_of_frames = [replace(frame, label=label, **options) for frame in _frames(values, ends)]
    if "render" in steps and not ends[0].scenes:
        mistakes.add(label, "want has 'render', which needs the scene of its looks")
    if "export" in steps:
        check_handover(mistakes, label, handover, looks_of_frames[0])
    return looks_of_frames


def _check_ends(
    mistakes: Mistakes, label: str, ends: Sequence[LookEntry], values: Mapping[str, Any]
) -> None:
    """Add reasons why looks cannot be the ends of a sequence to the mistakes."""
    path = values.get("sensors")
    if any(_view_key(end, path) != _view_key(ends[0], path) for end in ends):
        mistakes.add(label, "through: its looks are of different scenes, sensors or bases")
    elif path and not ends[0].scenes:
        mistakes.add(label, "sensors: its looks have no scene that other sensors could see")
    elif not path and any(end.by_sensor for end in ends):
        mistakes.add(
            label, "through: a look of several views has several pictures: name looks of one view"
        )


def _may_become(name: str, entry: LookEntry) -> bool:
    """Return whether a table would expand to a look of that name if its mistakes were mended."""
    if not entry.name:
        return True
    return name == entry.name or name.startswith(f"{entry.name}-")


def _frames(values: Mapping[str, Any], ends: Sequence[LookEntry]) -> Iterator[LookEntry]:
    """Yield each frame: a mix of two of `ends`, through their sensor or its own on a path."""
    path, look_names = values.get("sensors"), values["through"]
    frames = len(path) if path else values["frames"]
    digits = len(str(frames - 1))
    for k in range(frames):
        first, share = frame_position(k, frames, len(look_names))
        scenes = ends[first].scenes
        yield replace(
            ends[first],
            name=f"{values['name']}-{k:0{digits}}",
            scenes=(replace(scenes[0], sensor=path[k]),) if path else scenes,
            by_sensor=False,
            paintings=(),
            lighting="",
            variation="",
            combined_looks=tuple(look_names[first : first + 2]),
            share=share,
            space=values.get("space", "log"),
        )


def _view_key(entry: LookEntry, path: Sequence[str] | None) -> tuple[Any, ...]:
    """Return the inputs that all looks of a sequence must share.
    path: sensors that replace the looks' own.
    """
    if path:
        return tuple(replace(scene, sensor=None) for scene in entry.scenes[:1]), entry.basis
    return entry.scenes, entry.basis
