"""`lightpaint export` and `blender`: answers for other programs, and the add-on; `cache` and
`doctor`: what lightpaint keeps, and what works here.
"""

import io
import shutil
import sysconfig
import zipfile
from collections.abc import Callable, Mapping, Sequence
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint import relit
from lightpaint.arrays import Floats, Position
from lightpaint.basis import LightGroups, find_frames, first_frame, is_pattern
from lightpaint.basis.cache import basis_cache as bases
from lightpaint.basis.cache import delete_orphans, folder
from lightpaint.cli.commands import console_commands
from lightpaint.cli.doctor import examine
from lightpaint.cli.options.console_options import RigFile
from lightpaint.cli.output import documents, tables, terminal
from lightpaint.cli.output.lines import CommandOutcome
from lightpaint.display_text import some_names
from lightpaint.dmx import ConsoleRig, aimed_rig, directions_of
from lightpaint.errors import BasisError, LightingError, LightpaintError, OutputError
from lightpaint.files import check_files, check_writable, write_bytes
from lightpaint.lighting import Lighting, read_lighting
from lightpaint.paint import SESSION_FILE, read_kept_looks
from lightpaint.pipeline import GroupsFile, SceneFile, content
from lightpaint.scene.properties.site import unit
from lightpaint.sentences import Hint
from lightpaint.storage.staging import finish

#: The format that takes several lightings, and its file.
CUES, CUE_FILE = "cues", "cues.csv"


def export(
    *,
    lightings: Sequence[Path],
    forms: Sequence[str],
    rig: RigFile | None,
    fade_s: float,
    positions: bool,
    scene: SceneFile | None,
    groups: GroupsFile | None,
    stage: Path | None,
    output: Path | None,
    force: bool,
) -> CommandOutcome:
    """Run `lightpaint export lighting.json --to FORM,FORM -o DIR`."""
    lighting, others = lightings[0], [form for form in forms if form != CUES]
    if others and (sessions := [path for path in lightings if is_session(path)]):
        raise LightpaintError(
            f"{others[0]} takes a lighting.json, and {sessions[0]} is a session, which cues take"
        )
    if unknown := [form for form in others if form not in relit.FORMS]:
        known = ", ".join((*relit.FORMS, CUES))
        raise LightpaintError(f"there is no form {unknown[0]!r}: known are {known}")
    if len(lightings) > 1 and others:
        raise LightpaintError(
            f"{others[0]} takes one lighting, not {len(lightings)}; cues take all"
        )
    if CUES in forms and rig is None:
        raise LightpaintError("cues need the rig of their fixtures: give --rig show.mvr")
    if positions and CUES not in forms:
        raise LightpaintError("--positions belongs to cues: leave it out, or add cues to --to")
    folder = output or (lighting if lighting.is_dir() else lighting.parent)
    listen = terminal.TerminalListener()
    writers, remark, source = dict[str, Callable[[], str | bytes | Floats]](), "", relit.Source()
    if others:
        finish(lighting.parent)
        answer = read_lighting(lighting)
        show = None if rig is None or (CUES in forms and "mvr" not in forms) else rig.path
        source = relit.Source(content(scene), _light_groups(groups, answer), stage, show)
        names = relit.names_of_forms(others, source)
        writers, remark = relit.writers_of(names, answer, source, folder, listen)
    if CUES in forms and rig is not None:
        text, remarks = cue_list(lightings, rig, fade_s=fade_s, positions=positions)
        writers[CUE_FILE] = lambda: text
        for one in remarks:
            listen.say(one)
    file_writers = {folder / name: make for name, make in writers.items()}
    inputs = [*lightings, *source.files, *([] if rig is None else [rig.path])]
    check_files(list(file_writers), inputs)
    check_writable(folder)
    if not force and (existing_files := [file for file in file_writers if file.exists()]):
        raise OutputError(
            f"{existing_files[0]} exists: name another folder (",
            Hint("folder"),
            "), or pass ",
            Hint("force", True),
        )
    contents = {file: make() for file, make in file_writers.items()}
    for file, content_made in contents.items():
        relit.write_content(file, content_made)
        terminal.write(str(file))
    if remark:
        listen.say(remark)
    files = list(file_writers)
    several = {"lightings": list(map(str, lightings))} if len(lightings) > 1 else {}
    return CommandOutcome(
        lambda: documents.files_document(folder, files, lighting=str(lighting), **several)
    )


def _light_groups(groups: GroupsFile | None, answer: Lighting) -> LightGroups | None:
    """Return the light groups, of a shot the groups of its first frame."""
    if groups is None:
        return None
    if not is_pattern(groups.path):
        return groups.content
    has_rest = any(light.plugin == "rest" for light in answer.lights)
    return first_frame(find_frames(groups.path), groups.pattern, has_rest=has_rest)


#: Folder in the archive: the add-on's name in Blender before 4.2. The library is called otherwise.
ADDON_NAME = "lightpaint_blender"

#: File in that folder with the path of the program: Blender seldom has the PATH of a terminal.
PROGRAM_FILE = "PROGRAM"

#: Time of every file in the archive, so that equal sources make equal archives.
ARCHIVE_TIME = (1980, 1, 1, 0, 0, 0)

#: Steps that install it, printed after it is written.
INSTALL_STEPS = (
    "In Blender 4.2 or newer: Edit > Preferences > Get Extensions > Install from Disk",
    "In Blender 3.4 to 4.1: Edit > Preferences > Add-ons > Install, then tick lightpaint",
    "Then press N in the 3D view, and choose the tab lightpaint",
)


def blender(*, output: Path, force: bool) -> CommandOutcome:
    """Run `lightpaint blender -o F.zip`."""
    check_files([output], [])
    check_writable(output.parent)
    data = packed_addon(own_program())
    if output.exists() and not force and not is_addon(output):
        raise OutputError(
            f"{output} exists and is not an add-on of lightpaint: name another file (",
            Hint("output"),
            "), or pass ",
            Hint("force", True),
        )
    write_bytes(output, data)
    terminal.write(str(output))
    for step in INSTALL_STEPS:
        terminal.write(step)
    return CommandOutcome(lambda: documents.files_document(output.parent, [output]))


def own_program() -> str:
    """Return the path of lightpaint as a program, this installation's if it has one; "" if none."""
    scripts = sysconfig.get_path("scripts")
    return shutil.which("lightpaint", path=scripts) or shutil.which("lightpaint") or ""


def packed_addon(program: str = "") -> bytes:
    """Return the archive of the add-on, an extension that older versions install as an add-on.

    program: path that the add-on starts; "" for that on the PATH.
    """
    sources = _sources(files("lightpaint") / "blender_addon", ADDON_NAME)
    if program:
        sources.append((f"{ADDON_NAME}/{PROGRAM_FILE}", f"{program}\n".encode()))
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in sorted(sources):
            archive.writestr(zipfile.ZipInfo(name, ARCHIVE_TIME), data, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def is_addon(path: Path) -> bool:
    """Return whether a file is an add-on that this command has written."""
    try:
        with zipfile.ZipFile(path) as archive:
            return f"{ADDON_NAME}/blender_manifest.toml" in archive.namelist()
    except (OSError, zipfile.BadZipFile):
        return False


def _sources(folder: Traversable, name: str) -> list[tuple[str, bytes]]:
    """Return the files of a folder and of those within, by their names in the archive."""
    found = []
    for item in folder.iterdir():
        if item.is_dir() and item.name != "__pycache__":
            found += _sources(item, f"{name}/{item.name}")
        elif item.name.endswith((".py", ".toml")) or item.name == "LICENSE":
            found.append((f"{name}/{item.name}", item.read_bytes()))
    return found


def is_session(path: Path) -> bool:
    """Return whether a path is the session of a painter, or the folder that it is in."""
    return path.suffix == Path(SESSION_FILE).suffix or (path / SESSION_FILE).is_file()


def cue_list(
    sources: Sequence[Path], rig: RigFile, *, fade_s: float, positions: bool
) -> tuple[str, list[str]]:
    """Return the table of a cue for each lighting and each look of a session, in their order, and
    what fixtures cannot do.

    positions: whether pan and tilt follow. Raises LightingError for what has no drives, PaintError
    for what is not a session, RigError for what does not fit the rig.
    """
    fixtures = console_commands.read_rig_file(rig)
    cues = []
    for path in sources:
        cues += (
            _cues_of_session(path, fixtures, fade_s=fade_s)
            if is_session(path)
            else [_cue_of_lighting(path, fade_s=fade_s)]
        )
    if not positions:
        cues = [relit.Cue(x.label, x.fade_s, x.drives) for x in cues]
    remarks = [r for x in cues if x.directions for r in aimed_rig(fixtures, x.directions)[1]]
    return relit.cue_list_csv(fixtures, cues), [*dict.fromkeys(remarks)]


def _cue_of_lighting(path: Path, *, fade_s: float) -> relit.Cue:
    lighting, drives = console_commands.read_answer(path)
    return relit.Cue(_label_of(path), fade_s, drives, directions_of(lighting))


def _cues_of_session(path: Path, rig: ConsoleRig, *, fade_s: float) -> list[relit.Cue]:
    """Return a cue for each look of a session."""
    file = path / SESSION_FILE if path.is_dir() else path
    looks = read_kept_looks(file)
    if not looks:
        raise LightingError(f"{file} has no looks: keep some in the painter, one for each cue")
    cues = []
    for look in looks:
        if look.drives is None:
            raise LightingError(
                f"{file} has no drives of the look {look.name!r}: open it in the painter once, "
                "with lights that have emitters"
            )
        placed = look.requests.placed
        cues.append(relit.Cue(look.name, fade_s, look.drives, _directions(placed, rig)))
    return cues


def _directions(placed: Mapping[str, Mapping[str, Any]], rig: ConsoleRig) -> dict[str, Position]:
    """Return where lights that were moved point; others point as in the show."""
    lights = {light.name: light for fixture in rig.fixtures for light in fixture.lights}
    found = {}
    for name, pose in placed.items():
        if name in lights and pose.get("target") is not None:
            way = np.subtract(pose["target"], pose.get("position") or lights[name].position)
            if np.linalg.norm(way) > 0:
                found[name] = unit(way)
    return found


def _label_of(lighting: Path) -> str:
    """Return the name of a look: its file's, or its folder's where all files are called alike."""
    path = lighting.absolute()
    return path.parent.name if path.stem == "lighting" else path.stem


def cache(*, action: str, names: Sequence[str]) -> CommandOutcome:
    """Run `lightpaint cache [list | drop NAME... | clear]`."""
    if action != "drop" and names:
        raise BasisError(f"cache {action} takes no name: did you mean cache drop {names[0]}?")
    if action == "list":
        listed_entries = bases.entries()
        fields = {"folder": str(folder()), "largest": bases.MAX_BYTES}
        tables.show_kept(listed_entries)
        size = sum(entry.size for entry in listed_entries) / 1e6
        terminal.write(f"kept in {folder()}: {size:.0f} of at most {bases.MAX_BYTES / 1e6:.0f} MB")
        kept_documents = [documents.kept_document(entry) for entry in reversed(listed_entries)]
        return CommandOutcome(lambda: {**fields, "kept": kept_documents})
    deleted = bases.entries() if action == "clear" else _kept_by_names(names)
    freed_bytes = bases.delete_entries(deleted)
    if action == "clear":
        freed_bytes += delete_orphans()
    if action == "drop":
        tables.show_kept(deleted)
    terminal.write(f"{len(deleted)} deleted from {folder()}: {freed_bytes / 1e6:.1f} MB are free")
    deleted_documents = [documents.kept_document(entry) for entry in deleted]
    return CommandOutcome(
        lambda: {"folder": str(folder()), "dropped": deleted_documents, "freed": freed_bytes}
    )


def _kept_by_names(names: Sequence[str]) -> list[bases.Entry]:
    """Return the bases of these names, each once. Raises BasisError for an unknown name."""
    if not names:
        raise BasisError(
            "cache drop needs the name of a scene or of a file, as cache list shows it"
        )
    by_path: dict[Path, bases.Entry] = {}
    for name in names:
        if not (matches := bases.entries_named(name)):
            scenes = {entry.origin.scene for entry in bases.entries() if entry.origin is not None}
            known_scenes = some_names(sorted(scenes)) or "none"
            raise BasisError(f"no basis of {name!r} is kept in {folder()}: it has {known_scenes}")
        by_path |= {entry.path: entry for entry in matches}
    return list(by_path.values())


def doctor(*, variant: str | None) -> CommandOutcome:
    """Run `lightpaint doctor`."""
    findings = examine(variant)
    width = max(len(finding.subject) for finding in findings)
    for finding in findings:
        mark = {"ok": "ok", "missing": "MISSING", "info": ""}[finding.state]
        terminal.write(f"{finding.subject:{width}s} {mark:8s} {finding.result}")
    missing = [finding for finding in findings if finding.state == "missing"]
    for finding in missing:
        if finding.remedy:
            terminal.write(f"to fix {finding.subject}: {finding.remedy}")
    terminal.write("something is missing" if missing else "everything that is needed works")
    return CommandOutcome(lambda: documents.doctor_document(findings), 2 if missing else 0)
