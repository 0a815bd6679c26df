"""What `lightpaint export` does: an answer in the forms that other programs take."""

from collections.abc import Callable, Sequence
from pathlib import Path

from lightpaint.basis.lightgroups.read import LightGroups
from lightpaint.cli import documents, terminal
from lightpaint.cli.manner import Outcome
from lightpaint.errors import LightpaintError, OutputError
from lightpaint.files import check_files, check_writable, write_text
from lightpaint.lighting.file import read_lighting
from lightpaint.lighting.lighting import Lighting
from lightpaint.relit.export.exports import blender_script
from lightpaint.relit.export.fixtures import fixtures_csv, fixtures_json
from lightpaint.relit.export.nuke import needs_copy, nuke_script, spoken_unreadable
from lightpaint.relit.export.scene_script import scene_script
from lightpaint.relit.patch import emitters_of, scene_patch
from lightpaint.sources import GroupsFile, SceneFile
from lightpaint.staging import finish

#: Name of the file in each form, of a scene and of light groups; None where there is no such thing.
FORMS: dict[str, tuple[str | None, str | None]] = {
    "csv": ("fixtures.csv", "fixtures.csv"),
    "json": ("fixtures.json", "fixtures.json"),
    "mitsuba": ("relit.patch", None),
    "blender": ("set_scene.py", "set_lights.py"),
    "nuke": (None, "relit.nk"),
}


def export(
    *,
    lighting: Path,
    to: Sequence[str],
    scene: SceneFile | None,
    groups: GroupsFile | None,
    output: Path | None,
    force: bool,
) -> Outcome:
    """`lightpaint export lighting.json --to FORM,FORM -o DIR`"""
    finish(lighting.parent)
    answer, folder = read_lighting(lighting), output or lighting.parent
    read = None if groups is None else groups.content
    made = {name: _maker(form, answer, scene, read, folder) for form, name in _names(to, read)}
    files = [folder / name for name in made]
    reads = [lighting, *(scene.content.read_files if scene is not None else ())]
    check_files(files, [*reads, *(read.files if read is not None else ())])
    check_writable(folder)
    if not force and (there := [file for file in files if file.exists()]):
        raise OutputError(f"{there[0]} is there: name another folder (folder=...), or force=True")
    texts = {folder / name: make() for name, make in made.items()}
    for file, text in texts.items():
        write_text(file, text)
        terminal.write(str(file))
    if read is not None and "nuke" in to:
        for remark in spoken_unreadable(read, folder):
            terminal.say(remark)
    return Outcome(lambda: documents.files_document(folder, files, lighting=str(lighting)))


def _names(to: Sequence[str], groups: LightGroups | None) -> list[tuple[str, str]]:
    """Form and file of each. Raises LightpaintError for a form that there is none of."""
    found = []
    for form in dict.fromkeys(to):
        if form not in FORMS:
            raise LightpaintError(f"there is no form {form!r}: known are {', '.join(FORMS)}")
        name = FORMS[form][groups is not None]
        if name is None:
            raise LightpaintError(
                "nuke multiplies the layers of light groups: give them with --lights FILE.exr"
                if form == "nuke"
                else f"{form} is of a scene: give it with --scene, and leave --lights out"
            )
        found.append((form, name))
    return found


def _maker(
    form: str,
    lighting: Lighting,
    scene: SceneFile | None,
    groups: LightGroups | None,
    folder: Path,
) -> Callable[[], str]:
    """What makes the text of a form. Raises LightpaintError where it lacks something."""
    if form in ("csv", "json"):
        return lambda: (fixtures_csv if form == "csv" else fixtures_json)(lighting)
    if groups is not None:
        lighting.weights_for(groups.basis)
        if form == "blender":
            return lambda: blender_script(groups, lighting)
        if needs_copy(groups):
            raise LightpaintError(
                f"Nuke cannot tell the layers of {groups.path} apart: solve writes a copy of them "
                "beside its relit.nk"
            )
        return lambda: nuke_script(groups, lighting, folder)
    if scene is None:
        raise LightpaintError(f"{form} needs the scene: give it with --scene SCENE.xml")
    if form == "mitsuba":
        return lambda: scene_patch(scene.content, lighting)
    found = emitters_of(scene.content, lighting)
    return lambda: scene_script(lighting.target, Path(scene.path).name, found)
