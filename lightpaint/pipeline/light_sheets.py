"""Light sheets: a picture of each light of a scene alone."""

from dataclasses import replace
from pathlib import Path

from lightpaint.basis.cache import cache, obtain_basis
from lightpaint.basis.render import why_not_one_pass
from lightpaint.errors import LightpaintError, OutputError
from lightpaint.files import check_files, check_writable, write_bytes
from lightpaint.images import denoiser_text
from lightpaint.images.formats import png_bytes, png_has_text
from lightpaint.lighting import read_lighting
from lightpaint.pipeline.results.answer_folder import LIGHTING
from lightpaint.progress import Progress, silent
from lightpaint.report import HungLight, light_sheet
from lightpaint.scene import Scene
from lightpaint.scene.lights.texels import image_of
from lightpaint.scene.properties.site import EmitterPlace
from lightpaint.scene.quality_presets import Preset
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.sentences import Hint

#: Rendering of a light sheet, and its own seed: answers that continue a cached basis must not
#: depend on an earlier sheet.
SHEET, SHEET_SEED = Preset(16, 2**15), 2**31 - 1

#: Maximum number of pixels of all lights together that are rendered for a sheet, and minimum per
#: light; maximum bytes of a cached basis that is read for it; maximum number of lights if each
#: needs a separate render.
SHEET_MAX_PIXELS, LIGHT_MIN_PIXELS, MAX_BASIS_BYTES, MAX_RENDERS = 2**20, 2**12, 2**27, 6

#: Key of the text in a PNG that marks it as a light sheet.
SHEET_KEY = "lightpaint.lights"


def check_sheet(scene: Scene, path: Path, *, force: bool = False) -> None:
    """Raise OutputError if the sheet of `scene` cannot or should not be written to `path`."""
    if path.suffix.lower() != ".png":
        raise OutputError(f"{path} must end in .png: a light sheet is a PNG")
    check_files([path], scene.read_files)
    check_writable(path.parent)
    if path.exists() and not force and not (path.is_file() and png_has_text(path, SHEET_KEY)):
        raise OutputError(
            f"{path} exists and is not a light sheet: choose another name with ",
            Hint("folder"),
            ", or pass ",
            Hint("force", True),
        )


def render_sheet(scene: Scene, path: Path, progress: Progress = silent) -> str:
    """Write a picture of each light of `scene` alone to `path`, a PNG.

    It shows a cached basis or, if there is none, one of few samples on a small film. Of a relit
    scene the plan shows what moved, as the lighting beside it records. Returns "", or the reason
    why nothing was written, if rendering would take too long.
    """
    sensor = scene.sensor_names[scene.sensor]
    basis = cache.find_most_sampled(
        scene.identity, sensor, samples=SHEET.spp * LIGHT_MIN_PIXELS, largest=MAX_BASIS_BYTES
    )
    if basis is None:
        if reason := _why_no_sheet(scene):
            return reason
        pixels = max(
            min(SHEET.pixels or 0, SHEET_MAX_PIXELS // len(scene.lights)), LIGHT_MIN_PIXELS
        )
        small_scene = scene.reduced(f"1/{Preset(SHEET.spp, pixels).reduction(scene.film)}")
        basis = obtain_basis(small_scene, spp=SHEET.spp, seed=SHEET_SEED, progress=progress)
    count = len({image_of(light.name) or light.name for light in scene.lights})
    title = f"{Path(*scene.path.parts[-2:])} through {sensor}, {count} lights"
    texts = denoiser_text(basis.features, raw=f"basis of {basis.origin.spp} samples per pixel")
    emissions = {member.name: member.emission for member in scene.emitters}
    lights = [HungLight(place, emissions[place.name]) for place in recorded_places(scene)]
    image = light_sheet(basis, title=title, lights=lights, up=scene.up)
    write_bytes(path, png_bytes(image, {SHEET_KEY: "what each light does alone", **texts}))
    return ""


def _why_no_sheet(scene: Scene) -> str:
    """Return the reason not to render lights just to look at them; "" if there is none."""
    if note := use_variant().note:
        return note
    reason = why_not_one_pass(scene)
    if reason is None or len(scene.lights) <= MAX_RENDERS:
        return ""
    return f"{reason}, so that each light needs a render of its own"


def recorded_places(scene: Scene) -> tuple[EmitterPlace, ...]:
    """Return the places of a scene's emitters, with a mark on each that moved or is new.

    The marks come from the lighting in the folder of a relit scene, which knows the earlier places.
    A light whose place differs from the lighting's gets no mark, nor does any without a readable
    lighting.
    """
    file = scene.path.parent / LIGHTING
    if not file.is_file():
        return scene.emitter_places
    try:
        recorded = {place.name: place for place in read_lighting(file).places}
    except LightpaintError:
        return scene.emitter_places
    return tuple(_with_change(place, recorded.get(place.name)) for place in scene.emitter_places)


def _with_change(place: EmitterPlace, recorded: EmitterPlace | None) -> EmitterPlace:
    is_the_same = recorded is not None and place.site.is_near(recorded.site)
    if recorded is None or not is_the_same or place.new or place.moved_from is not None:
        return place
    return replace(
        place, moved_from=recorded.moved_from, new=recorded.new, size=place.size or recorded.size
    )
