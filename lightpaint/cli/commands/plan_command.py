"""`lightpaint plan`: the least power that meets the wishes for measuring planes."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.cli.commands.answer_text import show_planes
from lightpaint.cli.output import documents, terminal
from lightpaint.cli.output.lines import CommandOutcome
from lightpaint.errors import SceneError
from lightpaint.files import write_text
from lightpaint.lighting import Constraints
from lightpaint.photometry.planes_file import planes_file_beside
from lightpaint.pipeline import (
    PLAN,
    LightPlan,
    SceneFile,
    Settings,
    new_answer,
    plan_folder,
    plan_lighting,
    write_planes,
)
from lightpaint.report import planes_numbers, spoken_drives
from lightpaint.version import __version__


def plan(
    *,
    scene: SceneFile,
    planes: Path | None,
    output: Path | None,
    constraints: Constraints,
    settings: Settings,
) -> CommandOutcome:
    """Run `lightpaint plan SCENE`."""
    content = scene.content
    path = planes or planes_file_beside(content.path)
    if planes is None and not path.is_file():
        raise SceneError(
            f"{content.path} has no {path.name} beside it: write one, with the planes and what is "
            "wished for there, or name one with --planes"
        )
    folder = output or Path(f"{content.path.stem}-plan")
    results = plan_folder(content, path, folder, force=settings.force)
    results.check()
    with terminal.TerminalListener() as listen:
        found = plan_lighting(
            content, path, constraints=constraints, settings=settings, progress=listen
        )
    with new_answer(results, found.lighting, scene=content) as answer:
        text = json.dumps(_numbers(found), indent=2, ensure_ascii=False, allow_nan=False)
        write_text(answer.path / PLAN, text + "\n")
        origin, illuminance = f"{content.path.name} as planned", found.planes.wished.illuminance
        lit, glare = found.planes.weights_by_case, found.planes.glare
        write_planes(answer.path, illuminance, lit, origin, glare=glare)
    show_planes(found.planes)
    _show_lamps(found)
    terminal.write(f"results in {folder}/")
    files = [file for file in results.files if file.is_file()]
    is_met = not found.planes.missed
    return CommandOutcome(
        lambda: documents.files_document(folder, files) | _numbers(found), 0 if is_met else 1
    )


def _numbers(found: LightPlan) -> dict[str, Any]:
    return {
        "format": "lightpaint-plan 1",
        "lightpaint": __version__,
        **planes_numbers(found.planes),
    }


def _show_lamps(found: LightPlan) -> None:
    """Print the drives of all lamps."""
    table = terminal.table("lamp", "drive", "W")
    for light in found.lighting.lights:
        if light.lamp is not None:
            watts = light.lamp.watts_for(np.array(light.emission))
            table.row(
                light.name, spoken_drives(light.drives), "" if watts is None else f"{watts:.4g}"
            )
    terminal.print_table(table)
