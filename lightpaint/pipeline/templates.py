"""Pictures of a scene before a solve: templates to paint on, rendered or summed up from a basis,
and light sheets, each light alone.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis import (
    Basis,
    denoise_current_look,
    denoise_mix,
    denoise_plane,
    light_images,
    meter_exposure,
)
from lightpaint.basis.cache import basis_cache, obtain_basis
from lightpaint.basis.render import emitters_seen, is_of, render_basis, why_not_one_pass
from lightpaint.colour import ViewTransform, choose_exposure
from lightpaint.errors import LightpaintError, OutputError
from lightpaint.files import check_files, check_writable, write_bytes
from lightpaint.images import Features, block_mean, denoised, denoiser_text
from lightpaint.images.formats import png_bytes, png_has_text
from lightpaint.keywords import keywords
from lightpaint.lighting import read_lighting
from lightpaint.pipeline.job.job_checks import remarks_of_pictures
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job_bases import obtain
from lightpaint.pipeline.result_folder import LIGHTING
from lightpaint.progress import Listener, Progress, listener, silent
from lightpaint.report import HungLight, light_sheet
from lightpaint.scene import Scene, Stream, render, render_features, render_surfaces
from lightpaint.scene.lights.texels import image_of
from lightpaint.scene.properties.site import EmitterPlace
from lightpaint.scene.quality_presets import Preset
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.sentences import Hint
from lightpaint.target import LIGHTS, SHOWN_FILE, Template, write_look, write_template

#: Rendering of a light sheet, and its own seed: answers that continue a cached basis must not
#: depend on an earlier sheet.
SHEET, SHEET_SEED = Preset(16, 2**15), 2**31 - 1

#: Maximum number of pixels of all lights together that are rendered for a sheet, and minimum per
#: light; maximum bytes of a cached basis that is read for it; maximum number of lights if each
#: needs a separate render.
SHEET_MAX_PIXELS, LIGHT_MIN_PIXELS, MAX_BASIS_BYTES, MAX_RENDERS = 2**20, 2**12, 2**27, 6

#: Key of the text in a PNG that marks it as a light sheet.
SHEET_KEY = "lightpaint.lights"

#: Rendering of the small picture of each light, to recognise it by.
THUMBNAIL = Preset(32, 2**14)


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
    basis = basis_cache.find_most_sampled(
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
    """Return the places of a scene's emitters; those that moved or are new say so.

    A relit scene is a plain scene: only the lighting in its folder knows the earlier places. It
    counts for each light that hangs, points and opens as it says. A folder without a readable
    lighting changes nothing.
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


@keywords()
def render_template(
    scene: Scene,
    folder: str | Path,
    *,
    transform: ViewTransform | None = None,
    spp: int | None = None,
    time_s: float | None = None,
    seed: int = 0,
    use_cache: bool = True,
    progress: Progress = silent,
) -> list[Path]:
    """Render a template to paint on into `folder`, and return its files (docs/targets.md).

    The look is the sum of the basis that `solve` needs, which is kept in the cache.

    Args:
        scene: The scene to paint.
        folder: Receives the files.
        transform: View transform of the picture; by default sRGB at a metered exposure.
        spp: Samples per pixel (the scene's own number by default).
        time_s: Seconds to render the basis, instead of spp.
        seed: Any number >= 0.
        use_cache: Whether to use a basis from an earlier run, and keep this one.
        progress: Receives progress and, if it is a `Listener`, remarks.

    Examples:
        >>> scene = lp.load_scene("room.xml")
        >>> files = lp.render_template(scene, "template", spp=4)
        >>> "template.png" in [file.name for file in files]
        True
    """
    listen = listener(progress)
    settings = Settings(spp=spp, time_s=time_s, seed=seed, use_cache=use_cache)
    basis = _basis_of(scene, settings, listen)
    look, clean, features = _look(scene, basis, settings, listen)
    surfaces = render_surfaces(scene, seed=seed, progress=progress)
    template = Template(
        look,
        transform or ViewTransform("srgb", _exposure(scene, basis, clean)),
        scene=scene.path.name,
        content=scene.content,
        sensor=scene.sensor_names[scene.sensor],
        albedo=surfaces.albedo,
        clean=clean,
    )
    return write_template(
        Path(folder),
        template,
        normals=surfaces.normal,
        depth=surfaces.depth,
        mattes=surfaces.coverage,
        lights=_thumbnails(scene, basis, settings, progress),
        texts={
            SHOWN_FILE: denoiser_text(features, raw="template.exr"),
            LIGHTS: denoiser_text(features, raw="the basis of the scene"),
        },
    )


@keywords()
def template_of_basis(
    basis: Basis, folder: str | Path, *, transform: ViewTransform | None = None
) -> list[Path]:
    """Write a template of a saved basis or light groups into `folder`, and return its files.

    Nothing is rendered: the look is their sum, and files that need a scene are missing. If the
    noise is known, template.png shows the denoised look.

    Args:
        basis: The basis to solve with later.
        folder: Receives the files.
        transform: View transform of the picture; by default sRGB at a metered exposure.

    Examples:
        >>> files = lp.template_of_basis(basis, "over the basis")
        >>> [file.name for file in files[:2]]
        ['template.exr', 'template.png']
    """
    look, clean, features = _look_of_basis(basis)
    template = Template(
        look,
        transform or ViewTransform("srgb", meter_exposure(look, basis)),
        scene=basis.origin.scene,
        sensor=basis.origin.sensor if basis.knows_noise else "",
        clean=clean,
    )
    height, width = basis.size
    factor = max(1, math.isqrt(max(height * width - 1, 0) // (THUMBNAIL.pixels or 1)) + 1)
    texts = {}
    if clean is not None:
        raw = denoiser_text(features, raw="template.exr")
        texts = {SHOWN_FILE: raw, LIGHTS: denoiser_text(features, raw="the basis")}
    return write_template(
        Path(folder), template, lights=_small_planes(basis, min(factor, height, width)), texts=texts
    )


def look_of_basis(basis: Basis, path: Path, *, transform: ViewTransform | None = None) -> Path:
    """Write only the look of a basis, as EXR at `path`; return the PNG beside it."""
    look, clean, features = _look_of_basis(basis)
    view_transform = transform or ViewTransform("srgb", meter_exposure(look, basis))
    texts = {} if clean is None else denoiser_text(features, raw=path.name)
    return write_look(path, look, view_transform, clean=clean, texts=texts)


def _look_of_basis(basis: Basis) -> tuple[Floats, Floats | None, Features | None]:
    """Return the look; denoised, if its noise is known; and the features for that."""
    look = basis.current_look
    if not basis.knows_noise:
        return look, None, None
    return look, denoise_current_look(basis, quality="high"), basis.features


def render_look(
    scene: Scene,
    path: Path,
    *,
    transform: ViewTransform | None = None,
    spp: int | None = None,
    time_s: float | None = None,
    seed: int = 0,
    use_cache: bool = True,
    progress: Progress = silent,
) -> Path:
    """Write only the look to paint on, as EXR at `path`; return the denoised PNG beside it."""
    listen = listener(progress)
    settings = Settings(spp=spp, time_s=time_s, seed=seed, use_cache=use_cache)
    basis = _basis_of(scene, settings, listen)
    look, clean, features = _look(scene, basis, settings, listen)
    view_transform = transform or ViewTransform("srgb", _exposure(scene, basis, clean))
    return write_look(
        path, look, view_transform, clean=clean, texts=denoiser_text(features, raw=path.name)
    )


def _basis_of(scene: Scene, settings: Settings, listen: Listener) -> Basis | None:
    """Return the basis whose sum is the look, kept for the solve.

    None if it would need a render for each light and is not in the cache: then a look rendered by
    itself is ready n times sooner, and only the last of several paintings is solved.
    """
    for remark in remarks_of_pictures():
        listen.say(remark)
    reason = why_not_one_pass(scene)
    if reason is None or len(scene.lights) == 1 or settings.time_s is not None:
        return obtain(scene, settings, listen)
    if settings.use_cache:
        # A cached basis with all the requested samples needs no further render.
        sensor = scene.sensor_names[scene.sensor]
        cached = basis_cache.find(scene.identity, sensor, settings.seed, scene.size)
        spp = scene.spp if settings.spp is None else settings.spp
        if cached is not None and is_of(scene, cached, settings.seed) and cached.origin.spp >= spp:
            return obtain(scene, settings, listen)
    listen.say(
        f"{reason}, so that each light needs a render of its own: the template is a render of all "
        "lights together, and solve renders the lights; after lightpaint basis the template is "
        "their sum"
    )
    return None


def _look(
    scene: Scene, basis: Basis | None, settings: Settings, listen: Listener
) -> tuple[Floats, Floats, Features]:
    """Return the current look, (h, w, 3) linear, the same denoised, and the features for that."""
    if basis is not None:
        features = basis.features or render_features(scene, seed=settings.seed)
        basis = replace(basis, features=features)
        clean = denoise_current_look(basis, quality="high")
        return basis.current_look, clean, features
    image = render(
        scene,
        spp=settings.spp,
        seed=settings.seed,
        stream=Stream.TEMPLATE,
        label="template",
        progress=listen,
    ).image
    features = render_features(scene, seed=settings.seed)
    return image, denoised(image, features, quality="high"), features


def _exposure(scene: Scene, basis: Basis | None, look: Floats) -> float:
    """Return the exposure in stops at which to show the current scene."""
    if basis is not None:
        return meter_exposure(look, basis)
    return choose_exposure(look, emitters_seen(scene))


def _thumbnails(
    scene: Scene, basis: Basis | None, settings: Settings, progress: Progress
) -> dict[str, Floats]:
    """Return, by name, a picture of each light alone, (h', w', 3) linear, denoised."""
    factor = THUMBNAIL.reduction(scene.film)
    if basis is None:
        small_features = scene.reduced(f"1/{factor}")
        basis = render_basis(
            small_features, spp=THUMBNAIL.spp, seed=settings.seed, progress=progress
        )
        factor = 1
    return _small_planes(basis, factor)


def _small_planes(basis: Basis, factor: int) -> dict[str, Floats]:
    """Return, by name, each light alone in means over blocks; denoised, if there is noise.

    A light that is an image is one, as it is now, or an even white if it is off.
    """
    images = [x for x in light_images(basis.lights) if x.is_whole]
    texels = {int(k) for image in images for k in image.lights}
    features = None if basis.features is None else basis.features.reduced(factor)
    pictures = {}
    for k in (k for k in range(len(basis.lights)) if k not in texels):
        if basis.knows_noise and factor == 1:
            pictures[basis.names[k]] = denoise_plane(basis, k)
        else:
            image = block_mean(basis.planes.plane(k), factor)
            pictures[basis.names[k]] = denoised(image, features) if basis.knows_noise else image
    for one in images:
        is_its = np.isin(np.arange(len(basis.lights)), one.lights)[:, None]
        current = basis.current_weights if basis.current_weights[one.lights].any() else 1.0
        weights = np.where(is_its, current, np.zeros((1, 3)))
        if basis.knows_noise:
            pictures[one.name] = denoise_mix(basis, weights, factor=factor)
        else:
            pictures[one.name] = block_mean(basis.mix(weights), factor)
    return pictures
