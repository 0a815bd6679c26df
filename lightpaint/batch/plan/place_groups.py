"""Groups of looks that share places of lights: a look with its variations, or looks with `share`.

One search places the lights for a whole group; a file records its result and its inputs.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from lightpaint.batch.manifest.entries import LookEntry
from lightpaint.batch.manifest.folder_names import PLACES
from lightpaint.batch.work.task import Task, render_settings
from lightpaint.display_text import some_names
from lightpaint.errors import BatchError, LightpaintError
from lightpaint.placement.placement import PlacementRecord, read_placement


@dataclass(frozen=True)
class PlaceGroup:
    """A group of looks.

    file: of the record. tasks: of the looks whose paintings decide. fingerprint: of these.
    """

    file: Path
    tasks: tuple[Task, ...]
    fingerprint: str

    @property
    def looks(self) -> tuple[str, ...]:
        """Names of the looks whose paintings decide."""
        return tuple(task.look for task in self.tasks)

    @property
    def picture(self) -> Path:
        """File of the plan and the elevation of the room."""
        return self.file.with_suffix(".png")

    def read_record(self) -> PlacementRecord | None:
        """Return the record, if it belongs to these paintings and they are unchanged."""
        if not self.file.is_file():
            return None
        try:
            record = read_placement(self.file)
        except LightpaintError:
            return None
        return record if record.made_of == self.fingerprint else None


def group_entries(
    entries: Iterable[LookEntry], names_with_moves: Iterable[str]
) -> list[list[LookEntry]]:
    """Return groups of the entries whose lights may move; the paintings of each group decide.

    names_with_moves: names of these. Variations follow the look that they vary. Raises BatchError
    for looks that cannot share places.
    """
    names, groups = set(names_with_moves), dict[str, list[LookEntry]]()
    for entry in entries:
        if entry.name in names:
            groups.setdefault(_key(entry), []).append(entry)
    for group in groups.values():
        _check_alike(group)
    return list(groups.values())


def deciding_looks(group: Sequence[LookEntry]) -> list[LookEntry]:
    """Return the looks of a group whose paintings decide: all but variations, if there are any."""
    return [entry for entry in group if not entry.variation] or list(group)


def file_of_group(folder: Path, group: Sequence[LookEntry]) -> Path:
    """Return the file of a group's record in the folder of the batch."""
    return folder / PLACES / f"{deciding_looks(group)[0].name}.json"


def places_of(entries: Sequence[LookEntry], files: Mapping[str, str]) -> dict[str, str]:
    """Return the file of the places of each look, by name; looks made of others take theirs.

    files: of the looks that are solved. A look stands behind those that it is made of.
    """
    place_files = dict(files)
    for entry in entries:
        if entry.combined_looks and (place := place_files.get(entry.combined_looks[0])):
            place_files[entry.name] = place
    return place_files


def _key(entry: LookEntry) -> str:
    if entry.shares_places:
        return repr(replace(entry.scenes[0].without_content(), sensor=None))
    return entry.varied_look or entry.name


def _check_alike(group: Sequence[LookEntry]) -> None:
    """Raise BatchError if the bases of a group's looks are rendered in different ways."""
    first = render_settings(group[0].settings)
    for entry in group[1:]:
        settings = render_settings(entry.settings)
        if different_keys := [key for key, value in settings.items() if value != first[key]]:
            key = different_keys[0]
            raise BatchError(
                f"{some_names([group[0].name, entry.name], ' and ')} share places, and {key} is "
                f"{first[key]!r} in one and {settings[key]!r} in the other: give both the same"
            )
