"""Makes the pictures of docs/tutorials/a-paint-over-from-gimp-or-krita.md, and its paintings.

    python docs/images/tutorials/paint_over.py

Needs GIMP 2.10, Krita and Xvfb. GIMP paints by paint_over.scm, with its own brush on layers, and
its window is looked at; Krita opens the same layers. The paintings are written beside the tutorial.
It prints what each command says. Two cores take about five minutes.
"""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from PIL import Image
from steps import FILES, HERE, clone, comparison, keep, lightpaint, report_picture, work_folder
from windows import own_home, window_picture

#: Seconds until a program has started on a busy machine and shows a picture.
GIMP_S, KRITA_S = 60, 120

SCENE = "scenes/gallery/scene.xml"
INTERPRETER = ("--batch-interpreter", "plug-in-script-fu-eval")


def gimp_script(folder: Path, end: str) -> str:
    """Write the script for a folder, and return the expression that runs it."""
    text = (HERE / "paint_over.scm").read_text(encoding="utf-8")
    script = folder / "paint_over.scm"
    script.write_text(f'(define folder "{folder}/")\n{text}\n{end}\n', encoding="utf-8")
    return f'(load "{script}")'


def paint(folder: Path) -> None:
    """Paint in GIMP, without and with its window."""
    save_layers = f"""(gimp-file-save RUN-NONINTERACTIVE image
        (car (gimp-image-get-active-layer image)) "{folder}/dusk.psd" "dusk.psd")"""
    run = gimp_script(folder, f"{save_layers}\n(gimp-quit 1)")
    subprocess.run(["gimp-console-2.10", "-i", "-f", *INTERPRETER, "-b", run], check=True)
    for name in ("dusk.png", "dusk-2.png"):
        shutil.copy(folder / "template" / name, FILES / name)
        print(name, (FILES / name).stat().st_size)
    settings = folder / "home" / ".config" / "GIMP" / "2.10"
    settings.mkdir(parents=True)
    (settings / "contextrc").write_text('(tool "gimp-paintbrush-tool")\n', encoding="utf-8")
    for name, visible in (("3-layers", "TRUE"), ("6-mended", "FALSE")):
        show = f"(gimp-item-set-visible streak {visible})(gimp-display-new image)"
        gimp = ("gimp", "--no-splash", *INTERPRETER, "-b", gimp_script(folder, show))
        keep(window_picture(folder, *gimp, patience_s=GIMP_S), f"paint-over-{name}")
    krita = ("krita", "--nosplash", str(folder / "dusk.psd"))
    keep(window_picture(folder, *krita, patience_s=KRITA_S), "paint-over-8-krita")


def main() -> None:
    """Do the job once."""
    with work_folder("night-work") as folder:
        clone(folder, "gallery")
        lightpaint(folder, "template", SCENE)
        keep(Image.open(folder / "template" / "template.png"), "paint-over-1-template")
        paint(folder)
        lightpaint(folder, "solve", SCENE, "template/dusk.png")
        report_picture(folder / "dusk" / "report.html", "paint-over-4-report")
        keep(comparison(folder / "dusk" / "comparison.png"), "paint-over-5-comparison")
        lightpaint(folder, "solve", SCENE, "template/dusk-2.png", "--colors", "free")
        keep(comparison(folder / "dusk-2" / "comparison.png"), "paint-over-7-mended")
        krita = ("krita", "dusk.psd", "--export", "--export-filename", "template/dusk-krita.png")
        subprocess.run(["xvfb-run", "-a", *krita], cwd=folder, env=own_home(folder), check=True)
        lightpaint(folder, "solve", SCENE, "template/dusk-krita.png", "--colors", "free")


if __name__ == "__main__":
    main()
