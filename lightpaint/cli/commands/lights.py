"""The lights of a scene: as a table, as JSON, and as a sheet of pictures."""

from pathlib import Path

from lightpaint.cli.output import documents, tables, terminal
from lightpaint.cli.output.output_mode import CommandOutcome
from lightpaint.errors import BackendError, OutputError
from lightpaint.pipeline.light_sheets import check_sheet, render_sheet
from lightpaint.pipeline.remarks import remarks_of_scene
from lightpaint.pipeline.sources import SceneFile
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
    """`lightpaint lights SCENE`

    sheet: where what each does is drawn, if anywhere. is_asked: whether somebody named that place;
    else the listing is what counts, and a sheet that cannot be is no error.
    """
    loaded = scene.content
    if sheet is not None and is_asked:
        check_sheet(loaded, sheet, force=force)
    note_scene(loaded)
    for remark in remarks_of_scene(loaded):
        terminal.say(remark)
    tables.show_lights(loaded, cd_per_unit)
    is_drawn = sheet is not None and _is_drawn(loaded, sheet, is_asked=is_asked, force=force)
    drawn = {"sheet": str(sheet)} if is_drawn else {}
    return CommandOutcome(lambda: {**documents.lights_document(loaded, cd_per_unit), **drawn})


def _is_drawn(scene: Scene, sheet: Path, *, is_asked: bool, force: bool) -> bool:
    """Whether the sheet of lights could be written; what keeps it from that is said."""
    try:
        check_sheet(scene, sheet, force=force)
        with terminal.TerminalListener() as listen:
            why = render_sheet(scene, sheet, listen)
    except (OutputError, BackendError) as error:
        if is_asked and isinstance(error, OutputError):
            raise
        why = str(error)
    if why:
        terminal.say(f"no {sheet}: {why}")
        return False
    terminal.note("lights drawn")
    terminal.write(f"{sheet}: what each of them does alone")
    return True


def note_scene(loaded: Scene) -> None:
    """A scene that was read, and by what, where somebody wants to know all."""
    height, width = loaded.size
    terminal.note(
        f"{loaded.path} read: {len(loaded.emitters)} emitters, {len(loaded.lights)} lights, "
        f"{width}x{height} pixels through {loaded.sensor_names[loaded.sensor]}, "
        f"{use_variant().variant}"
    )
