"""`lightpaint lights`: the lights of a scene as a table, as JSON, and as a sheet of pictures."""

from pathlib import Path

from lightpaint.cli.output import documents, tables, terminal
from lightpaint.cli.output.output_mode import CommandOutcome
from lightpaint.errors import BackendError, OutputError
from lightpaint.pipeline.job.remarks import remarks_of_scene
from lightpaint.pipeline.job.sources import SceneFile
from lightpaint.pipeline.light_sheets import check_sheet, render_sheet
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.scene.scene import Scene
from lightpaint.sentences import Sentence


def lights(
    *,
    scene: SceneFile,
    cd_per_unit: float | None,
    sheet: Path | None,
    is_named: bool = True,
    force: bool = False,
) -> CommandOutcome:
    """Run `lightpaint lights SCENE`.

    sheet: file of the light sheet; None for none. is_named: True if the user named it; otherwise a
    sheet that cannot be written is not an error.
    """
    content = scene.content
    if sheet is not None and is_named:
        check_sheet(content, sheet, force=force)
    note_scene(content)
    for remark in remarks_of_scene(content):
        terminal.say(remark)
    tables.show_lights(content, cd_per_unit)
    is_drawn = sheet is not None and _draw_sheet(content, sheet, is_named=is_named, force=force)
    sheet_fields = {"sheet": str(sheet)} if is_drawn else {}
    return CommandOutcome(
        lambda: {**documents.lights_document(content, cd_per_unit), **sheet_fields}
    )


def _draw_sheet(scene: Scene, sheet: Path, *, is_named: bool, force: bool) -> bool:
    """Write the light sheet; print the reason and return False if it cannot be written."""
    try:
        check_sheet(scene, sheet, force=force)
        with terminal.TerminalListener() as listen:
            reason = render_sheet(scene, sheet, listen)
    except (OutputError, BackendError) as error:
        if is_named and isinstance(error, OutputError):
            raise
        reason = error.sentence
    if reason:
        terminal.say(Sentence(f"no {sheet}: ", reason))
        return False
    terminal.note("lights drawn")
    terminal.write(f"{sheet}: each light alone")
    return True


def note_scene(scene: Scene) -> None:
    """Print details of a loaded scene, in verbose mode."""
    height, width = scene.size
    terminal.note(
        f"{scene.path} read: {len(scene.emitters)} emitters, {len(scene.lights)} lights, "
        f"{width}x{height} pixels through {scene.sensor_names[scene.sensor]}, "
        f"{use_variant().variant}"
    )
