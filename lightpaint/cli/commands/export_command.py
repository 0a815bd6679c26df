"""`lightpaint export`: writes an answer for other programs."""

from collections.abc import Sequence
from pathlib import Path

from lightpaint.basis.lightgroups.frame_sequence import find_frames, is_pattern
from lightpaint.basis.lightgroups.light_groups import first_frame
from lightpaint.cli.output import documents, terminal
from lightpaint.cli.output.output_mode import CommandOutcome
from lightpaint.errors import OutputError
from lightpaint.files import check_files, check_writable
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.pipeline.job.sources import GroupsFile, SceneFile, content
from lightpaint.relit.export_format import Source
from lightpaint.relit.formats import names_of_forms, write_content, writers_of
from lightpaint.sentences import Hint
from lightpaint.storage.staging import finish


def export(
    *,
    lighting: Path,
    forms: Sequence[str],
    scene: SceneFile | None,
    groups: GroupsFile | None,
    stage: Path | None,
    output: Path | None,
    force: bool,
) -> CommandOutcome:
    """Run `lightpaint export lighting.json --to FORM,FORM -o DIR`."""
    finish(lighting.parent)
    answer, folder = read_lighting(lighting), output or lighting.parent
    if groups is not None and is_pattern(groups.path):
        has_rest = any(light.plugin == "rest" for light in answer.lights)
        light_groups = first_frame(find_frames(groups.path), groups.pattern, has_rest=has_rest)
    else:
        light_groups = content(groups)
    source, listen = Source(content(scene), light_groups, stage), terminal.TerminalListener()
    names = names_of_forms(forms, source)
    writers, remark = writers_of(names, answer, source, folder, listen)
    file_writers = {folder / name: make for name, make in writers.items()}
    check_files(list(file_writers), [lighting, *source.files])
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
        write_content(file, content_made)
        terminal.write(str(file))
    if remark:
        listen.say(remark)
    files = list(file_writers)
    return CommandOutcome(lambda: documents.files_document(folder, files, lighting=str(lighting)))
