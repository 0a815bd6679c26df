"""`lightpaint rig`: the fixtures of a show as a scene with a lights file."""

from pathlib import Path
from typing import Any

from lightpaint.cli.output import documents, terminal
from lightpaint.cli.output.lines import CommandOutcome
from lightpaint.cli.output.vocabulary import spoken
from lightpaint.dmx import (
    KindSummary,
    Room,
    RoomFiles,
    Show,
    address_text,
    cd_per_unit,
    lights_of,
    lights_text,
    read_show,
    room_of_scene,
    room_of_show,
    scene_text,
    spectrum_tables,
)
from lightpaint.errors import OutputError, RigError
from lightpaint.files import check_files, check_writable, write_bytes, write_text
from lightpaint.scene.lights.lights_file import lights_file_beside
from lightpaint.sentences import Hint, Sentence
from lightpaint.storage.staging import finish, staged


def rig(
    *,
    show: Path,
    output: Path,
    room: Path | None,
    only_lights: bool,
    force: bool,
    gdtf_folder: Path | None,
    zoom: float | None,
    pixels: bool,
    usual_colors: bool,
    open_wheels: bool,
) -> CommandOutcome:
    """Run `lightpaint rig SHOW.mvr -o F.xml`."""
    if room is not None and only_lights:
        raise RigError("--only-lights leaves the room out: give --room, or --only-lights")
    content = read_show(
        show, gdtf_folder=gdtf_folder, zoom=zoom, pixels=pixels, usual_colors=usual_colors
    )
    folder, surroundings = output.parent, RoomFiles(Room(), {})
    if room is not None:
        surroundings = RoomFiles(room_of_scene(room, folder), {})
    elif not only_lights:
        surroundings = room_of_show(show, content.models)
    unit = cd_per_unit(content.rig)
    texts = {
        output: scene_text(content.rig, unit, None if only_lights else surroundings.room),
        lights_file_beside(output): lights_text(
            content.rig, unit, open_wheels=open_wheels, stem=output.stem
        ),
    }
    tables = spectrum_tables(content.rig, output.stem)
    texts |= {folder / name: text for name, text in tables.items()}
    files = [*texts, *(folder / name for name in surroundings.files)]
    _check(files, [show, *([] if room is None else [room])], folder, force=force)
    with staged(folder) as stage:
        for file, text in texts.items():
            write_text(stage / file.name, text)
        for name, data in surroundings.files.items():
            write_bytes(stage / name, data)
    _print(content, files)
    remarks = [*content.remarks, *surroundings.remarks]
    for remark in remarks:
        terminal.say(remark)
    return CommandOutcome(lambda: _document(show, files, content, unit, remarks))


def _check(files: list[Path], inputs: list[Path], folder: Path, *, force: bool) -> None:
    check_files(files, inputs)
    check_writable(folder)
    finish(folder)
    if not force and (existing_files := [file for file in files if file.exists()]):
        raise OutputError(
            f"{existing_files[0]} exists: name another file with -o, or pass ",
            Hint("force", True),
        )


def _print(show: Show, files: list[Path]) -> None:
    """Print a row for each type, with what is to know of it below, and the main files."""
    table = terminal.table("fixtures", "type", "mode", "emitters", "light from")
    for kind in show.kinds:
        emitters = ", ".join(kind.emitters) or "none"
        table.row(str(len(kind.fixtures)), kind.kind, kind.mode, emitters, kind.emission)
    terminal.print_table(table)
    for kind in show.kinds:
        for remark in kind.remarks:
            terminal.write(spoken(Sentence(f"{kind.kind}: ", remark)))
    count = len(lights_of(show.rig))
    universes = ", ".join(map(str, show.rig.universes))
    terminal.write(f"{count} {'lights' if count > 1 else 'light'}, universes {universes}")
    for file in files[:2]:
        terminal.write(str(file))


def _document(
    path: Path, files: list[Path], show: Show, unit: float, remarks: list[str]
) -> dict[str, Any]:
    """Return the document of `rig`."""
    fixtures = [
        {
            "id": fixture.fixture_id,
            "name": fixture.name,
            "type": fixture.kind,
            "mode": fixture.mode,
            "addresses": {str(k): address_text(x) for k, x in fixture.addresses.items()},
            "lights": [light.name for light in fixture.lights],
        }
        for fixture in show.rig.fixtures
    ]
    return documents.files_document(
        files[0].parent,
        files,
        rig=str(path),
        cd_per_unit=unit,
        types=[_kind(kind) for kind in show.kinds],
        fixtures=fixtures,
        remarks=[spoken(x) for x in remarks],
    )


def _kind(kind: KindSummary) -> dict[str, Any]:
    fields = {("type" if key == "kind" else key): value for key, value in vars(kind).items()}
    return {**fields, "remarks": [spoken(x) for x in kind.remarks]}
