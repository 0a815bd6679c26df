"""Makes the sheets of presets and of references that docs/painter.md shows.

    python docs/images/presets.py [--spp 256] [SHEET...]

writes beside itself

    presets-SCENE.jpg     for the gallery, the stage, the table and the cornell box: in each pair of
                          rows what each preset asks for, and below it the answer
    references.jpg        six references of another place, and what they ask for and give on the
                          gallery, the stage, the table and the cornell box

Bases come from the render cache, or are rendered. The table's sky of 128 texels takes some minutes.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path.insert(0, str(ROOT / "benchmarks"))

from known_places import references  # noqa: E402

import lightpaint as lp  # noqa: E402
from lightpaint.basis.cache.cached_render import obtain_basis  # noqa: E402
from lightpaint.basis.denoised_mixes import denoise_current_look, denoise_mix  # noqa: E402
from lightpaint.basis.light_basis import meter_exposure  # noqa: E402
from lightpaint.paint.presets.lighting_presets import PRESETS  # noqa: E402
from lightpaint.paint.protocol import ApplyPreset, LookLike  # noqa: E402
from lightpaint.paint.session.painting_session import Session  # noqa: E402
from lightpaint.paint.store.history_steps import Identity  # noqa: E402
from lightpaint.paint.store.session_file import MemoryStore  # noqa: E402
from lightpaint.pipeline.job.settings import Settings  # noqa: E402

SIZES = {"gallery": "213x120", "stage": "213x120", "table": "160x90", "cornell": "128x128"}
SHEETS = (*(f"presets-{name}" for name in SIZES), "references")

#: Scenes of the sheet of references, and the place that they show.
PLACES, PLACE = ("gallery", "stage", "table", "cornell"), "market"

#: Height of a picture, of its title, the gap between pictures, and presets in a row.
HEIGHT, TITLE, GAP, COLUMNS = 126, 16, 4, 5


def main() -> None:
    """Make the sheets."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sheets", nargs="*", metavar="SHEET", help=", ".join(SHEETS))
    parser.add_argument("--spp", type=int, default=256)
    options = parser.parse_args()
    for sheet in options.sheets or SHEETS:
        if sheet == "references":
            rows = reference_rows(options.spp)
        else:
            rows = preset_rows(sheet.removeprefix("presets-"), options.spp)
        save(rows, HERE / f"{sheet}.jpg")


def preset_rows(name: str, spp: int) -> list[list[Image.Image]]:
    """Return rows of pictures: what presets ask for, and the answers below it."""
    scene = Set(name, spp)
    pairs = {
        preset.title: scene.asked_and_answer(ApplyPreset(preset.name))
        for preset in PRESETS.values()
    }
    rows = []
    titles = list(pairs)
    for first in range(0, len(titles), COLUMNS):
        some = titles[first : first + COLUMNS]
        rows.append([scene.picture(pairs[title][0], title) for title in some])
        rows.append([scene.picture(pairs[title][1]) for title in some])
    return rows


def reference_rows(spp: int) -> list[list[Image.Image]]:
    """Return rows of pictures: the references, and what is asked for and found for each scene."""
    plain = lp.ViewTransform()
    pictures = {k: displayed(x.picture, plain) for k, x in references(PLACE).items()}
    rows = [[framed(Image.fromarray(x), name.capitalize()) for name, x in pictures.items()]]
    for place in PLACES:
        scene = Set(place, spp)
        pairs = [scene.asked_and_answer(LookLike(1), x) for x in pictures.values()]
        rows.append([scene.picture(asked) for asked, _ in pairs])
        rows.append([scene.picture(answer) for _, answer in pairs])
    return rows


class Set:
    """A scene that is lit now, and its basis."""

    def __init__(self, name: str, spp: int) -> None:
        scene = lp.load_scene(ROOT / "scenes" / name / "scene.xml")
        self.basis = obtain_basis(scene.reduced(SIZES[name]), spp=spp)
        self.look = denoise_current_look(self.basis)
        stops = meter_exposure(self.basis.current_look, self.basis)
        self.transform = lp.ViewTransform("srgb", stops)
        print(name, flush=True)

    def asked_and_answer(
        self, request: ApplyPreset | LookLike, reference: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the painting after a request, and the answer to it, (h, w, 3) linear each."""
        store = MemoryStore(Identity.of([self.basis]))
        session = Session(
            [self.basis], [self.look], store, settings=Settings(), transform=self.transform
        )
        if reference is not None:
            session.references.add("reference", reference)
        session.handle(request, {})
        target = session.target()
        assert target is not None
        solution = lp.correct_noise(lp.solve(self.basis, target))
        return target.image, denoise_mix(self.basis, solution.weights)

    def picture(self, light: np.ndarray, title: str = "") -> Image.Image:
        """Return a picture of light in a cell of a sheet."""
        return framed(Image.fromarray(displayed(light, self.transform)), title)


def displayed(light: np.ndarray, transform: lp.ViewTransform) -> np.ndarray:
    """Return display values (h, w, 3) uint8."""
    return np.round(255 * np.clip(transform.encode(np.maximum(light, 0)), 0, 1)).astype(np.uint8)


def framed(picture: Image.Image, title: str = "") -> Image.Image:
    """Return a picture at the height of a sheet, below its title if it has one."""
    width = round(picture.width * HEIGHT / picture.height)
    top = TITLE if title else 0
    cell = Image.new("RGB", (width, HEIGHT + top), "white")
    cell.paste(picture.resize((width, HEIGHT), Image.Resampling.LANCZOS), (0, top))
    if title:
        ImageDraw.Draw(cell).text((2, 2), title, fill="black")
    return cell


def save(rows: list[list[Image.Image]], path: Path) -> None:
    """Write rows of pictures as one."""
    widths = [sum(x.width + GAP for x in row) - GAP for row in rows]
    heights = [max(x.height for x in row) for row in rows]
    sheet = Image.new("RGB", (max(widths), sum(heights) + GAP * (len(rows) - 1)), "white")
    y = 0
    for row, height in zip(rows, heights, strict=True):
        x = 0
        for cell in row:
            sheet.paste(cell, (x, y))
            x += cell.width + GAP
        y += height + GAP
    sheet.save(path, quality=86)
    print(path.name, path.stat().st_size // 1000, "kB", flush=True)


if __name__ == "__main__":
    main()
