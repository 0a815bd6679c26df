"""Makes the pictures of docs/tutorials/an-evening-in-the-gallery.md.

    pip install '.[test]'
    python docs/images/tutorials/evening.py

Somebody lights the gallery for a late evening in the painter, in headless Chromium: a page that
paints, reads the answer, locks a light, asks for warmer, keeps two looks and exports. It prints the
sentence after each step. Two cores take about four minutes; the basis is kept where all bases are.
"""

from __future__ import annotations

import shutil
from io import BytesIO

from PIL import Image
from steps import FILES, clone, keep, painter, work_folder

from designs import save  # isort: skip
from tasks import AWAY, FIGURE, Designer

#: Samples per pixel, with which the pictures of the lights are clean.
SPP = 64

#: The wall behind the red picture and the walls beside it, as shares of the picture.
WALL = ((0.36, 0.30), (0.45, 0.24), (0.57, 0.27), (0.60, 0.36))
WALL_BACK = ((0.60, 0.30), (0.48, 0.20), (0.36, 0.24))


def picture(designer: Designer) -> Image.Image:
    """Return what the page shows."""
    return Image.open(BytesIO(designer.page.screenshot()))


def see(designer: Designer, name: str) -> None:
    """Keep a picture of the page, with no pointer over it, and print its sentence."""
    designer.page.mouse.move(*AWAY)
    designer.hand.wait(0)
    keep(picture(designer), f"evening-{name}")
    print(
        f"{name}: {designer.sentence}", designer.page.locator(".headline").inner_text(), flush=True
    )


def evening(designer: Designer) -> None:
    """All steps of the tutorial."""
    page = designer.page
    see(designer, "1-open")
    designer.whole(-1.5)
    see(designer, "2-darker")
    designer.key("b")
    page.get_by_role("textbox", name="CCT").fill("2700")
    page.keyboard.press("Enter")
    designer.number("Size", 70)
    designer.drag("paint the wall", *WALL)
    designer.drag("paint the wall again", *WALL_BACK)
    see(designer, "3-wall")
    keep_sentence(designer)
    for title in ("Colour", "Adjust by numbers"):
        page.locator(".fold-head button", has_text=title).first.click()
    for name, level in (("sky", "-3"), ("sun", "off")):
        field = page.locator(f'[data-light="{name}"]').get_by_role("textbox").first
        field.fill(level)
        field.press("Tab")
        designer.done(f"{name}: {level}")
    see(designer, "5-lock")
    designer.key("a")
    designer.choose("Area", "Object")
    designer.ask("drag the figure up and right", FIGURE, 70, 110)
    see(designer, "6-warmer")
    save(designer, "Evening")
    layer = page.locator(".layer-name", has_text="Whole picture").first
    layer.scroll_into_view_if_needed()
    layer.click()
    designer.number("Strength", 180)
    see(designer, "7-strength")
    save(designer, "Closing time")
    designer.press("Compare looks")
    see(designer, "8-compare")
    designer.press("Back to the painting")
    page.get_by_role("button", name="Load Evening").first.click()
    designer.done("load Evening")
    export(designer)


def keep_sentence(designer: Designer) -> None:
    """Keep the line below the pictures, with what is in the way."""
    designer.press("Analysis")
    designer.press("Why not closer?")
    see(designer, "4-sentence")
    designer.press("Analysis")


def export(designer: Designer) -> None:
    """Write everything, and keep the dialog that lists it."""
    page = designer.page
    page.get_by_role("button", name="Export").first.click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_role("button", name="Export", exact=True).click()
    dialog.locator(".command code").wait_for(timeout=600_000)
    page.wait_for_timeout(1000)
    keep(page.screenshot(), "evening-9-export")
    print(dialog.inner_text())


def main() -> None:
    """Do the job once."""
    with work_folder("gallery-work") as folder:
        clone(folder, "gallery")
        with painter(folder, "scenes/gallery/scene.xml", "-o", "evening", f"--spp={SPP}") as hand:
            evening(Designer(hand))
        lighting = folder / "evening" / "exports" / "Evening" / "lighting.json"
        shutil.copy(lighting, FILES / "evening.lighting.json")
        for path in sorted((folder / "evening").rglob("*")):
            print(path.relative_to(folder), path.stat().st_size)


if __name__ == "__main__":
    main()
