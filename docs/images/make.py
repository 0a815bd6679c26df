"""Makes the pictures of the scenes that the README and the documentation show.

    pip install pyoidn
    python docs/images/make.py [--spp 64] [--bases FOLDER] [PICTURE...]

writes beside itself

    gallery.jpg     the gallery with the lighting found for its evening
    stage.jpg       the stage with the lighting found for its sunset
    six-looks.jpg   six paintings of the gallery, each beside the gallery with the lighting found
                    for it
    placement.jpg   the gallery's evening with spots that may turn and slide on their two tracks, as
                    a report draws it; it also prints what moved, and the processor's seconds
    table.jpg       the table's painting of sunset, the answer, and the sky that was found for it
    led-wall.jpg    the stage with the picture that its wall of LEDs shows for the sunset, which is
                    in a corner
    office.jpg      the office's painting of an evening, the answer that gives the desks 500 lx, and
                    the lux of one desk

Each scene's basis is rendered once at 1280 x 720, the table's of 130 lights at 640 x 360, and kept
in FOLDER for the next time if there is one. Each look is the sum of that basis for the lighting
found; its noise is taken away by Open Image Denoise. Two cores take about eight minutes for 64
samples.
"""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path.insert(0, str(ROOT / "targets"))

from clean import Floats, Surfaces, denoise, see  # noqa: E402

import lightpaint as lp  # noqa: E402
from lightpaint.basis.lights import light_images  # noqa: E402
from lightpaint.images.denoiser import denoised  # noqa: E402
from lightpaint.report.hung_light import hung_lights  # noqa: E402
from lightpaint.report.page.placement_section import aim_picture  # noqa: E402
from lightpaint.report.rig_plan import rig_drawing  # noqa: E402
from lightpaint.scene.scene_render import Stream, render  # noqa: E402

SIZE = (1280, 720)
INSET, GAP = (176, 99), 8
PICTURES = ("gallery", "stage", "six-looks", "placement", "table", "led-wall", "office")

#: Qualities that are tried until a picture has so few bytes.
QUALITIES, MAX_BYTES = range(88, 60, -4), 380_000

#: Columns and rows of the wall of LEDs, and the size of the picture of it.
WALL, WALL_SIZE = (16, 9), (960, 540)

#: Size of a painting and of its answer, and the strip above them with their titles.
CELL, TITLE, TITLE_SIZE = (640, 360), 36, 22

#: Stops of the office's painting.
OFFICE_STOPS = -8.4

#: The two tracks of the gallery, the spots that may turn and slide on each, and spots to add.
TRACKS = {
    "left": {"line": [[-1.8, 3.5, 0.6], [-1.8, 3.5, 6.0]]},
    "right": {"line": [[2.2, 3.5, 0.6], [2.2, 3.5, 6.0]]},
}
MOVES = {
    name: {"move": {"on": side}, "aim": 40}
    for side, names in {
        "left": ("spot_tide", "spot_figure"),
        "right": ("spot_knot", "spot_vase"),
    }.items()
    for name in names
}
CEILING_SPOTS = {"kind": "spot", "count": 2, "on": ["ceiling"]}

LOOKS = ("morning.exr", "overcast.png", "last-sun.png", "evening.png", "opening.png",
         "after-hours.png")  # fmt: skip


@dataclass(frozen=True)
class Set:
    """A scene ready to be lit: what its lights do, and what its pixels see."""

    name: str
    basis: lp.Basis
    surfaces: Surfaces

    @classmethod
    def built(cls, name: str, spp: int, bases: Path | None) -> Set:
        """Render it, or take what an earlier run kept."""
        path = ROOT / "scenes" / name / "scene.xml"
        kept = bases and bases / f"{name}.basis.exr"
        if kept and kept.exists():
            return cls(name, lp.read_basis(kept), see(path, size=SIZE))
        scene = lp.load_scene(path, parameters={"width": SIZE[0], "height": SIZE[1]})
        print(f"{name}: {len(scene.lights)} lights, {spp} samples per pixel", flush=True)
        basis = lp.render_basis(scene, spp=spp)
        if kept:
            lp.write_basis(kept, basis)
        return cls(name, basis, see(path, size=SIZE))

    def painting(self, name: str) -> Path:
        """A shipped painting of it."""
        return ROOT / "targets" / self.name / name

    def lit_as(self, painting: str) -> Image.Image:
        """How it looks with the lighting that comes closest to a painting."""
        path = self.painting(painting)
        mask = path.with_suffix(".mask.exr")
        with tempfile.TemporaryDirectory() as folder:
            look = lp.paint_with_light(
                None,
                path,
                Path(folder) / "look",
                basis=self.basis,
                mask=mask if mask.exists() else None,
                resize=True,
                verify=False,
                report=False,
            )
        print(f"{self.name}: {painting}: {look.verdict}", flush=True)
        return shown(denoise(look.predicted.image, self.surfaces))


def shown(image: Floats) -> Image.Image:
    """Linear light as sRGB, as it is: no exposure, no curve."""
    linear = np.clip(image, 0, 1)
    curve = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return Image.fromarray(np.rint(255 * curve).astype(np.uint8))


def read_painting(path: Path) -> Image.Image:
    """A painting as a person sees it."""
    if path.suffix == ".png":
        return Image.open(path).convert("RGB")
    return shown(lp.read_target(path, find=False).image)


def six_looks(room: Set) -> Image.Image:
    """Six rows, a painting at the left of each and its answer at the right."""
    width, height = CELL
    sheet = Image.new("RGB", (2 * width + GAP, TITLE + len(LOOKS) * (height + GAP) - GAP), "white")
    draw = ImageDraw.Draw(sheet)
    for k, title in enumerate(("Painting", "Answer: what the lights can do")):
        place = (k * (width + GAP) + width / 2, TITLE / 2)
        draw.text(place, title, "black", ImageFont.load_default(TITLE_SIZE), anchor="mm")
    for k, name in enumerate(LOOKS):
        top = TITLE + k * (height + GAP)
        pair = (read_painting(room.painting(name)), room.lit_as(name))
        for left, picture in zip((0, width + GAP), pair, strict=True):
            sheet.paste(picture.resize(CELL, Image.Resampling.LANCZOS), (left, top))
    return sheet


def placement() -> Image.Image:
    """The picture of a solve in which spots may move, with its plan and elevation below it."""
    room = ROOT / "scenes" / "gallery" / "scene.xml"
    before = cpu_s()
    with tempfile.TemporaryDirectory() as folder:
        look = lp.paint_with_light(
            str(room),
            str(ROOT / "targets" / "gallery" / "evening.exr"),
            Path(folder) / "look",
            rigging=lp.Rigging.of(MOVES, on=TRACKS, new=[CEILING_SPOTS]),
            resolution="1/4",
            resize=True,
            literal=True,
            report=False,
            use_cache=False,
        )
    found = look.placement
    assert found is not None
    for change in (*found.moves, *found.additions):
        print(change)
    print(
        f"missed, by the search: {found.missed_before:.4f} to {found.missed_after:.4f} of the "
        f"painting's energy, {cpu_s() - before:.0f} CPU seconds in all; {look.verdict}"
    )
    lights = hung_lights(look.lighting)
    features = look.basis.features
    answer = np.asarray(shown(denoised(look.predicted.image, features)))
    drawings = (
        aim_picture(answer, features, lights),
        rig_drawing(features, lights, up=look.lighting.up, width=answer.shape[1] * 4),
    )
    pictures = [Image.fromarray(drawing) for drawing in drawings if drawing is not None]
    width = max(picture.width for picture in pictures)
    sheet = Image.new("RGB", (width, sum(picture.height for picture in pictures)), "black")
    top = 0
    for picture in pictures:
        sheet.paste(picture, ((width - picture.width) // 2, top))
        top += picture.height
    return sheet


def table(spp: int) -> Image.Image:
    """The painting of a table, its answer, and the image of the sky as Mitsuba interpolates it."""
    scene = ROOT / "scenes" / "table" / "scene.xml"
    painting = ROOT / "targets" / "table" / "sunset.png"
    with tempfile.TemporaryDirectory() as folder:
        look = lp.paint_with_light(
            str(scene), str(painting), Path(folder) / "look", spp=spp, colors="free"
        )
    print(f"table: {look.verdict}", flush=True)
    [sky] = light_images(look.basis.lights)
    height, width = look.basis.size
    weights = look.lighting.weights_for(look.basis)
    panels = [
        read_painting(painting),
        shown(denoise(look.predicted.image, see(scene, size=(width, height)))),
        shown(sky.domain.interpolated(weights[sky.places], (2 * height, height))),
    ]
    return side_by_side(panels)


def side_by_side(panels: list[Image.Image]) -> Image.Image:
    """Pictures of the same height in a row."""
    width = sum(panel.width + GAP for panel in panels) - GAP
    sheet = Image.new("RGB", (width, panels[0].height), "white")
    left = 0
    for panel in panels:
        sheet.paste(panel, (left, 0))
        left += panel.width + GAP
    return sheet


def led_wall(spp: int) -> Image.Image:
    """The stage in front of a wall of LEDs, with the picture that the wall shows in a corner."""
    path = ROOT / "scenes" / "stage" / "led_wall.xml"
    size = {"width": WALL_SIZE[0], "height": WALL_SIZE[1]}
    with tempfile.TemporaryDirectory() as folder:
        look = lp.paint_with_light(
            lp.load_scene(path, split={"wall": WALL}),
            ROOT / "targets" / "stage" / "sunset.exr",
            Path(folder) / "look",
            spp=spp,
            resolution="1/2",
            resize=True,
            emitters="count",
            report=False,
        )
        relit = lp.load_scene(Path(folder) / "look" / "relit.xml", parameters=size)
        rendered = render(relit, spp=spp, stream=Stream.TEMPLATE).image
    print(f"stage with a wall of LEDs: {look.verdict}", flush=True)
    sheet = shown(denoise(rendered, see(path, size=WALL_SIZE)))
    [wall] = light_images(look.basis.lights)
    weights = look.lighting.weights_for(look.basis)
    small = shown(wall.domain.interpolated(weights[wall.places], INSET))
    left, top = 10, WALL_SIZE[1] - INSET[1] - 10
    draw = ImageDraw.Draw(sheet)
    draw.rectangle((left - 2, top - 2, left + INSET[0] + 1, top + INSET[1] + 1), fill="white")
    sheet.paste(small, (left, top))
    return sheet


def office(spp: int) -> Image.Image:
    """The painting of the office's evening, its answer with 500 lx on the desks, and one desk."""
    folder, painting = ROOT / "scenes" / "office", ROOT / "docs/tutorials/files/office-evening.png"
    with tempfile.TemporaryDirectory() as results:
        look = lp.paint_with_light(
            str(folder / "office.xml"),
            str(painting),
            Path(results) / "look",
            planes=str(folder / "office.planes.toml"),
            transform=lp.ViewTransform("srgb", OFFICE_STOPS),
            spp=spp,
            verify=False,
            report=False,
        )
        desk = Image.open(Path(results) / "look/planes/desk_2.png").convert("RGB")
    print(f"office: {look.verdict}", flush=True)
    height, _ = look.basis.size
    desk_size = (round(desk.width * height / desk.height), height)
    panels = [
        read_painting(painting),
        shown(2.0**OFFICE_STOPS * denoised(look.predicted.image, look.basis.features)),
        desk.resize(desk_size, Image.Resampling.LANCZOS),
    ]
    return side_by_side(panels)


def cpu_s() -> float:
    """Seconds of the processor that this process has taken."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def main() -> None:
    """Make those that the command line names, or all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pictures", nargs="*", help=f"{', '.join(PICTURES)}; all by default")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--bases", type=Path, metavar="FOLDER")
    asked = parser.parse_args()
    wanted = set(asked.pictures) or set(PICTURES)
    made: dict[str, Image.Image] = {}
    if wanted & {"gallery", "six-looks"}:
        gallery = Set.built("gallery", asked.spp, asked.bases)
        if "gallery" in wanted:
            made["gallery"] = gallery.lit_as("evening.png")
        if "six-looks" in wanted:
            made["six-looks"] = six_looks(gallery)
    if "stage" in wanted:
        made["stage"] = Set.built("stage", asked.spp, asked.bases).lit_as("sunset.exr")
    if "placement" in wanted:
        made["placement"] = placement()
    if "table" in wanted:
        made["table"] = table(asked.spp)
    if "led-wall" in wanted:
        made["led-wall"] = led_wall(asked.spp)
    if "office" in wanted:
        made["office"] = office(asked.spp)
    for name, picture in made.items():
        write(picture, HERE / f"{name}.jpg")


def write(picture: Image.Image, path: Path) -> None:
    """Write a picture as JPEG, small enough for a page to load it."""
    for quality in QUALITIES:
        picture.save(path, quality=quality, optimize=True, progressive=True)
        if path.stat().st_size <= MAX_BYTES:
            break


if __name__ == "__main__":
    main()
