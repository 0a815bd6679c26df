"""Templates: what is rendered, or summed up of a basis, to be painted on."""

import math
from pathlib import Path

from lightpaint.arrays import Floats
from lightpaint.basis import cache
from lightpaint.basis.basis import Basis, meter_exposure
from lightpaint.basis.render.integrators import why_not_one_pass
from lightpaint.basis.render.render import is_of, render_basis
from lightpaint.basis.render.separate import emitters_seen
from lightpaint.colour.display.exposure import choose_exposure
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.images.denoiser import Features, denoised, denoiser_text
from lightpaint.images.pixel_blocks import block_mean
from lightpaint.keywords import keywords
from lightpaint.pipeline.pipeline import obtain
from lightpaint.pipeline.remarks import remarks_of_pictures
from lightpaint.pipeline.settings import Settings
from lightpaint.progress import Listener, Progress, listener, silent
from lightpaint.scene.presets import Preset
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import Stream, render
from lightpaint.scene.surfaces import render_features, render_surfaces
from lightpaint.target.template import LIGHTS, SHOWN, Template, write_look, write_template

#: Rendering of what each light does alone, to recognise it by.
THUMBNAIL = Preset(32, 2**14)


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
    """Render something to paint on into `folder`, and return its files (docs/targets.md).

    The look is the sum of the basis that `solve` will ask for, which is kept for it.

    Args:
        scene: What is to be painted.
        folder: Receives the files.
        transform: How the look becomes a picture; sRGB by default, at an exposure that shows
            something.
        spp: Samples per pixel (the scene's own number by default).
        time_s: Instead of spp, seconds in which the basis is rendered.
        seed: Any number >= 0.
        use_cache: Whether a basis from an earlier run is taken, and this one kept.
        progress: Hears how far the work has come and, if it is a `Listener`, remarks.

    Examples:
        >>> scene = lp.load_scene("room.xml")
        >>> files = lp.render_template(scene, "template", spp=4)
        >>> "template.png" in [file.name for file in files]
        True
    """
    listen = listener(progress)
    settings = Settings(spp=spp, time_s=time_s, seed=seed, use_cache=use_cache)
    basis = _basis_of(scene, settings, listen)
    look, features = _look(scene, basis, settings, listen)
    clean = denoised(look, features, quality="high")
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
            SHOWN: denoiser_text(features, raw="template.exr"),
            LIGHTS: denoiser_text(features, raw="the basis of the scene"),
        },
    )


@keywords()
def template_of_basis(
    basis: Basis, folder: str | Path, *, transform: ViewTransform | None = None
) -> list[Path]:
    """Write something to paint on into `folder`, of a saved basis or light groups.

    Nothing is rendered: the look is their sum, and what only a scene knows is not there. Where the
    noise is known, template.png shows the look without it.

    Args:
        basis: What will be solved with.
        folder: Receives the files, which it returns.
        transform: How the look becomes a picture; sRGB by default, at an exposure that shows
            something.

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
        texts = {SHOWN: raw, LIGHTS: denoiser_text(features, raw="the basis")}
    return write_template(
        Path(folder), template, lights=_small_planes(basis, min(factor, height, width)), texts=texts
    )


def look_of_basis(basis: Basis, path: Path, *, transform: ViewTransform | None = None) -> Path:
    """Write only the look of a basis, as EXR at `path`; returns the PNG beside it."""
    look, clean, features = _look_of_basis(basis)
    shown = transform or ViewTransform("srgb", meter_exposure(look, basis))
    texts = {} if clean is None else denoiser_text(features, raw=path.name)
    return write_look(path, look, shown, clean=clean, texts=texts)


def _look_of_basis(basis: Basis) -> tuple[Floats, Floats | None, Features | None]:
    """The sum as it is; without its noise, where that is known; and what that was taken out by."""
    look = basis.present_look
    if not basis.knows_noise:
        return look, None, None
    return look, denoised(look, basis.features, quality="high"), basis.features


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
    """Only the look to paint on, as EXR at `path`; returns the PNG beside it, which is denoised."""
    listen = listener(progress)
    settings = Settings(spp=spp, time_s=time_s, seed=seed, use_cache=use_cache)
    basis = _basis_of(scene, settings, listen)
    look, features = _look(scene, basis, settings, listen)
    clean = denoised(look, features, quality="high")
    shown = transform or ViewTransform("srgb", _exposure(scene, basis, clean))
    return write_look(path, look, shown, clean=clean, texts=denoiser_text(features, raw=path.name))


def _basis_of(scene: Scene, settings: Settings, listen: Listener) -> Basis | None:
    """The basis whose sum is the look, kept for the solve.

    None where it would cost a render for each light, and nobody has paid for it yet: then a look
    rendered by itself is there n times sooner, and of several paintings only the last is solved.
    """
    for remark in remarks_of_pictures():
        listen.say(remark)
    why = why_not_one_pass(scene)
    if why is None or len(scene.lights) == 1 or settings.time_s is not None:
        return obtain(scene, settings, listen)
    if settings.use_cache:
        # One that has all the samples that are asked for needs no further render.
        sensor = scene.sensor_names[scene.sensor]
        kept = cache.find(scene.identity, sensor, settings.seed, scene.size)
        asked = scene.spp if settings.spp is None else settings.spp
        if kept is not None and is_of(scene, kept, settings.seed) and kept.origin.spp >= asked:
            return obtain(scene, settings, listen)
    listen.say(
        f"{why}, so that each light takes a render of its own: the template is one of all lights "
        "together, and solve renders the lights; after lightpaint basis the template is their sum"
    )
    return None


def _look(
    scene: Scene, basis: Basis | None, settings: Settings, listen: Listener
) -> tuple[Floats, Features]:
    """The scene as it is, (h, w, 3) linear, and what to denoise it by."""
    if basis is not None:
        features = basis.features or render_features(scene, seed=settings.seed)
        return basis.mix(basis.present_weights), features
    image = render(
        scene,
        spp=settings.spp,
        seed=settings.seed,
        stream=Stream.TEMPLATE,
        label="template",
        progress=listen,
    ).image
    return image, render_features(scene, seed=settings.seed)


def _exposure(scene: Scene, basis: Basis | None, look: Floats) -> float:
    """Stops at which to show the scene as it is."""
    if basis is not None:
        return meter_exposure(look, basis)
    return choose_exposure(look, emitters_seen(scene))


def _thumbnails(
    scene: Scene, basis: Basis | None, settings: Settings, progress: Progress
) -> dict[str, Floats]:
    """By name, what each light does alone at unit emission, (h', w', 3) linear, denoised."""
    factor = THUMBNAIL.reduction(scene.film)
    if basis is None:
        small = scene.reduced(f"1/{factor}")
        basis = render_basis(small, spp=THUMBNAIL.spp, seed=settings.seed, progress=progress)
        factor = 1
    return _small_planes(basis, factor)


def _small_planes(basis: Basis, factor: int) -> dict[str, Floats]:
    """By name, what each light does alone, in means over blocks; denoised, where there is noise."""
    small = {
        name: block_mean(image, factor)
        for name, image in zip(basis.names, basis.planes, strict=True)
    }
    if not basis.knows_noise:
        return small
    features = None if basis.features is None else basis.features.reduced(factor)
    return {name: denoised(image, features) for name, image in small.items()}
