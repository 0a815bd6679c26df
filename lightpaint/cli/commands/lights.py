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


def lights(
    *,
    scene: SceneFile,
    cd_per_unit: float | None,
    sheet: Path | None,
    is_asked: bool = True,
    force: bool = False,
) -> CommandOutcome:
    """Run `lightpaint lights SCENE`.

    sheet: file of the light sheet; None for none. is_asked: True if the user named it; otherwise a
    sheet that cannot be written is not an error.
    """
    loaded = scene.content
    if sheet is not None and is_asked:
        check_sheet(loaded, sheet, force=force)
    note_scene(loaded)
    for remark in remarks_of_scene(loaded):
        terminal.say(remark)
    tables.show_lights(loaded, cd_per_unit)
    is_drawn = sheet is not None and _draw_sheet(loaded, sheet, is_asked=is_asked, force=force)
    drawn = {"sheet": str(sheet)} if is_drawn else {}
    return CommandOutcome(lambda: {**documents.lights_document(loaded, cd_per_unit), **drawn})


def _draw_sheet(scene: Scene, sheet: Path, *, is_asked: bool, force: bool) -> bool:
    """Write the light sheet; print the reason and return False if it cannot be written."""
    try:
        check_sheet(scene, sheet, force=force)
        with terminal.TerminalListener() as listen:
            reason = render_sheet(scene, sheet, listen)
    except (OutputError, BackendError) as error:
        if is_asked and isinstance(error, OutputError):
            raise
        reason = str(error)
    if reason:
        terminal.say(f"no {sheet}: {reason}")
        return False
    terminal.note("lights drawn")
    terminal.write(f"{sheet}: each light alone")
    return True


def note_scene(loaded: Scene) -> None:
    """Print details of a loaded scene, in verbose mode."""
    height, width = loaded.size
    terminal.note(
        f"{loaded.path} read: {len(loaded.emitters)} emitters, {len(loaded.lights)} lights, "
        f"{width}x{height} pixels through {loaded.sensor_names[loaded.sensor]}, "
        f"{use_variant().variant}"
    )
