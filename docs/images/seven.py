"""Records seven paintings that a lighting designer tries, in the real page.

    pip install '.[test]'
    python docs/images/seven.py [--spp 64] [--port 8439] [--only NAME ...]

writes `seven-NAME.jpg` beside itself, the painting beside its answer, with the sentence below; and
prints the actions, and the sentence. Actions are counted as `tasks.py` counts them. The painter's
own server in folders that are removed; a basis is rendered once, and kept where all bases are.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import zipfile
from collections.abc import Callable
from contextlib import ExitStack
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image
from record import HERE, SCENES, load, painter, using
from tasks import AWAY, FIGURE, KNOT, VASE, Designer

sys.path.insert(0, str(HERE.parent.parent / "benchmarks"))

from known_places import references

import lightpaint as lp
from lightpaint.basis.cache.cached_render import obtain_basis
from lightpaint.basis.denoised_mixes import denoise_current_look
from lightpaint.colour.primaries import encode_display, to_8_bit

#: Share of a picture's size at which scenes are painted, by scene.
RESOLUTION = {"gallery": "1/2", "stage": "1/2", "table": "1/4"}

#: Where things are, as shares of width and height.
LANTERN, BACK_WALL = (0.392, 0.7), (0.72, 0.2)

#: Light that is painted over the look: blue everywhere, gold within ellipses of these centres and
#: radii.
BLUE, GOLD = (0.3, 0.45, 0.9), (1.8, 1.25, 0.55)
POOLS = ((0.61, 0.64, 0.09, 0.34), (0.45, 0.34, 0.16, 0.24), (0.3, 0.58, 0.1, 0.27))

#: Paint of the sky, and of its sun, with stops; where both are pressed on the map.
SKY, SUN = ("#7c96ff", -1.5, (0.6, 0.4)), ("#ffb070", 0.0, (0.25, 0.36))

#: Width of the pictures that are written.
WIDTH = 900


def drag_objects(designer: Designer, up: float, right: float, *places: tuple[float, float]) -> None:
    """Ask for objects, by drags of as many pixels."""
    if not designer.page.get_by_role("group", name="Area", exact=True).count():
        designer.key("a")
    designer.choose("Area", "Object")
    for place in places:
        designer.ask("drag up and right", place, up, right)


def choose_preset(designer: Designer, name: str) -> None:
    """Take a preset."""
    page = designer.page
    designer.press("Presets")
    page.locator(".sheet button", has=page.get_by_text(name, exact=True)).click()
    page.locator(".layer-name", has_text=name).first.wait_for()
    page.wait_for_timeout(2000)
    designer.done(f"press {name}")


def sculptures(designer: Designer) -> None:
    """Sculptures, warm in a cool dark room."""
    designer.whole(-1.5, -40)
    drag_objects(designer, 140, 70, FIGURE, KNOT, VASE)


def moonlight(designer: Designer) -> None:
    """A moonlit stage."""
    choose_preset(designer, "Moonlight")


def lantern(designer: Designer) -> None:
    """The same, with a warm lantern."""
    choose_preset(designer, "Moonlight")
    drag_objects(designer, 150, 80, LANTERN)


def reference(designer: Designer) -> None:
    """The gallery like a photograph of another place at golden hour."""
    page = designer.page
    picture = references("courtyard")["golden hour"].picture
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "golden-hour.png"
        Image.fromarray(to_8_bit(encode_display(np.asarray(picture)))).save(file)
        page.get_by_role("button", name="References").click()
        designer.done("press References")
        page.locator(".reference-pane input[type=file]").set_input_files(file)
        page.locator(".reference-name", has_text="golden-hour").wait_for()
    designer.done("choose the photograph")
    page.get_by_role("button", name="Look like this", exact=True).click()
    page.locator(".layer-name", has_text="Like golden-hour").first.wait_for()
    page.wait_for_timeout(2000)
    designer.done("press Look like this")
    page.get_by_role("button", name="Close the references").click()


def gold_pools(designer: Designer) -> None:
    """A blue room with pools of gold, painted over the look in 8 bits, elsewhere."""
    page = designer.page
    designer.press("Layers")
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Import layers").click()
    picture = paint_pools()
    chooser.value.set_files(
        {"name": "gold.ora", "mimeType": "image/openraster", "buffer": open_raster(picture)}
    )
    page.locator(".layer-name", has_text="Gold").first.wait_for()
    page.wait_for_timeout(2000)
    designer.done("import gold.ora")


def paint_pools() -> Image.Image:
    """Return the gallery's look in 8 bits, painted blue with pools of gold."""
    scene = lp.load_scene(SCENES / "gallery" / "scene.xml").reduced(RESOLUTION["gallery"])
    look = denoise_current_look(obtain_basis(scene, spp=64))
    height, width = look.shape[:2]
    y, x = np.mgrid[:height, :width]
    light = look * np.array(BLUE)
    for center_x, center_y, radius_x, radius_y in POOLS:
        distance = np.hypot((x / width - center_x) / radius_x, (y / height - center_y) / radius_y)
        gold = np.exp(-(distance**3))[..., None]
        light = (1 - gold) * light + gold * look * np.array(GOLD)
    return Image.fromarray(to_8_bit(encode_display(light.astype(np.float32))))


def open_raster(picture: Image.Image) -> bytes:
    """Return a picture as an OpenRaster file of one layer, as a paint program saves it."""
    png, file = BytesIO(), BytesIO()
    picture.save(png, "PNG")
    stack = (
        f'<image version="0.0.3" w="{picture.width}" h="{picture.height}"><stack>'
        '<layer name="Gold" src="data/layer0.png" x="0" y="0"/></stack></image>'
    )
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("mimetype", "image/openraster")
        archive.writestr("stack.xml", stack)
        for name in ("data/layer0.png", "mergedimage.png", "Thumbnails/thumbnail.png"):
            archive.writestr(name, png.getvalue())
    return file.getvalue()


def warm_wall(designer: Designer) -> None:
    """One warm wall, and all else as it is."""
    drag_objects(designer, 40, 120, BACK_WALL)


def sky(designer: Designer) -> None:
    """A blue sky with a low sun, on the map of the sky."""
    page = designer.page
    designer.press("sky")
    paint = page.get_by_role("group", name="Paint of texels")
    grid = page.get_by_role("grid", name="Texels of sky")
    for tool, (color, stops, (u, v)) in (("Fill", SKY), ("Sun", SUN)):
        designer.press(tool)
        for label, text in (("Hex", color), ("Brightness", f"{stops:g}")):
            field = paint.get_by_role("textbox", name=label)
            field.fill(text)
            field.press("Enter")
            designer.done(f"{label}: {text}")
        grid.scroll_into_view_if_needed()
        box = grid.bounding_box()
        assert box is not None
        page.mouse.click(box["x"] + u * box["width"], box["y"] + v * box["height"])
        page.wait_for_timeout(6000)
        designer.done("press on the map")


Job = Callable[[Designer], None]

#: Scene, and what is done.
JOBS: dict[str, tuple[str, Job]] = {
    "sculptures": ("gallery", sculptures),
    "moonlight": ("stage", moonlight),
    "lantern": ("stage", lantern),
    "reference": ("gallery", reference),
    "gold-pools": ("gallery", gold_pools),
    "warm-wall": ("gallery", warm_wall),
    "sky": ("table", sky),
}


def save_middle(designer: Designer, path: Path) -> None:
    """Write painting and answer, side by side, with the sentence below."""
    stage, line = (designer.page.locator(x).bounding_box() for x in (".stage", ".answer"))
    assert stage is not None
    assert line is not None
    height = 9 / 32 * stage["width"]
    top = stage["y"] + (stage["height"] - height) / 2
    parts = [
        Image.open(
            BytesIO(designer.page.screenshot(clip={"x": x, "y": y, "width": width, "height": high}))
        ).convert("RGB")
        for x, y, width, high in (
            (stage["x"], top, stage["width"], height),
            (line["x"], line["y"], line["width"], line["height"]),
        )
    ]
    whole = Image.new("RGB", (parts[0].width, sum(part.height for part in parts)))
    whole.paste(parts[0])
    whole.paste(parts[1], (0, parts[0].height))
    size = (WIDTH, round(WIDTH * whole.height / whole.width))
    whole.resize(size, Image.Resampling.LANCZOS).save(path, quality=80)


def main() -> None:
    """Do the jobs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--port", type=int, default=8439)
    parser.add_argument("--only", nargs="+", choices=JOBS, default=list(JOBS))
    options = parser.parse_args()
    for name in options.only:
        scene, job = JOBS[name]
        with ExitStack() as stack:
            resolution = f"--resolution={RESOLUTION[scene]}"
            server = painter(scene, options.spp, options.port, resolution)
            designer = Designer(stack.enter_context(using(stack.enter_context(server))))
            load(designer.page)
            job(designer)
            designer.page.mouse.move(*AWAY)
            designer.hand.wait(0)
            designer.page.wait_for_timeout(2000)
            save_middle(designer, HERE / f"seven-{name}.jpg")
            actions = designer.actions
            print(f"{name}: {len(actions)} actions: {'; '.join(actions)}")
            print(f"    {designer.sentence}", flush=True)


if __name__ == "__main__":
    main()
