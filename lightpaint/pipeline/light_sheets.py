"""Sheets of lights: a picture of what each light of a scene does alone."""

from pathlib import Path

from lightpaint.basis import cache
from lightpaint.basis.render.integrators import why_not_one_pass
from lightpaint.basis.render.obtain import obtain_basis
from lightpaint.errors import OutputError
from lightpaint.files import check_files, check_writable, write_bytes
from lightpaint.images.denoiser import denoiser_text
from lightpaint.images.formats.png import png_bytes, png_has_text
from lightpaint.progress import Progress, silent
from lightpaint.report.light_sheet import light_sheet
from lightpaint.scene.presets import Preset
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.scene.scene import Scene

#: Rendering of a sheet of lights, and its seed: one of its own, so that no answer that goes on from
#: what is kept depends on whether somebody has looked at the lights.
SHEET, SHEET_SEED = Preset(16, 2**15), 2**31 - 1

#: Pixels of all lights together that are rendered for it, and of each at least; bytes of a kept
#: basis that is read for it, at most; lights that it is rendered for where each takes a render.
MANY_PIXELS, FEW_PIXELS, MUCH, FEW_RENDERS = 2**20, 2**12, 2**27, 6

#: Text of a PNG that is a sheet of lights.
SHEET_KEY = "lightpaint.lights"


def check_sheet(scene: Scene, path: Path, *, force: bool = False) -> None:
    """Raise OutputError for a place that the sheet of `scene` cannot or should not go to."""
    if path.suffix.lower() != ".png":
        raise OutputError(f"{path} must end in .png, the format that is written")
    check_files([path], scene.read_files)
    check_writable(path.parent)
    if path.exists() and not force and not (path.is_file() and png_has_text(path, SHEET_KEY)):
        raise OutputError(
            f"{path} is there, and no sheet of lights: choose another name with folder=..., or "
            "pass force=True"
        )


def render_sheet(scene: Scene, path: Path, progress: Progress = silent) -> str:
    """Write what each light of `scene` does alone to `path`, a PNG to look at.

    Of a basis that is kept or, where there is none, of few samples on a small film. Returns why
    nothing was written, if that takes too long here; "" if it was.
    """
    sensor = scene.sensor_names[scene.sensor]
    basis = cache.any_of(scene.identity, sensor, samples=SHEET.spp * FEW_PIXELS, largest=MUCH)
    if basis is None:
        if why := _why_no_sheet(scene):
            return why
        pixels = max(min(SHEET.pixels or 0, MANY_PIXELS // len(scene.lights)), FEW_PIXELS)
        small = scene.reduced(f"1/{Preset(SHEET.spp, pixels).reduction(scene.film)}")
        basis = obtain_basis(small, spp=SHEET.spp, seed=SHEET_SEED, progress=progress)
    title = f"{Path(*scene.path.parts[-2:])} through {sensor}, {len(scene.lights)} lights"
    texts = denoiser_text(basis.features, raw=f"basis of {basis.origin.spp} samples per pixel")
    image = light_sheet(basis, title=title)
    write_bytes(path, png_bytes(image, {SHEET_KEY: "what each light does alone", **texts}))
    return ""


def _why_no_sheet(scene: Scene) -> str:
    """Why the lights of `scene` are not rendered just to be looked at; "" if they are."""
    if note := use_variant().note:
        return note
    why = why_not_one_pass(scene)
    if why is None or len(scene.lights) <= FEW_RENDERS:
        return ""
    return f"{why}, so that each light takes a render of its own"
