"""Renders of a scene under a lighting, in a folder with the relit scene."""

import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from lightpaint.arrays import Floats
from lightpaint.basis.render import emitters_seen
from lightpaint.colour import ViewTransform, choose_exposure
from lightpaint.images import (
    HALF_DIFFERENCE,
    Estimate,
    Features,
    denoised,
    denoiser_text,
    write_estimate,
)
from lightpaint.images.formats import ExrPart, rgb_channels, write_parts, write_png, write_png_16
from lightpaint.lighting import Lighting
from lightpaint.pipeline.job.remarks import remarks_of_pictures
from lightpaint.pipeline.results.answer_folder import (
    RELIT,
    answer_files,
    new_answer,
    reload_relit,
)
from lightpaint.pipeline.results.result_folder import ResultFolder
from lightpaint.progress import Progress, listener, silent
from lightpaint.relit import relight
from lightpaint.scene import Scene, Stream, render, render_features, with_width
from lightpaint.scene.quality_presets import on_film
from lightpaint.target import texts_of

#: EXR layer of a final render without its noise.
DENOISED = "denoised"


def relit_folder(
    scene: Scene,
    lighting: Path,
    folder: Path,
    *,
    views: Sequence[str] = ("",),
    force: bool = False,
) -> ResultFolder:
    """Return the folder that `relight_look` writes to.

    lighting: the file of the lighting. views: as in `relight_look`.
    """
    files = answer_files(folder, scene=scene, has_lighting=True)
    files += [folder / view / name for view in views for name in ("relit.exr", "relit.png")]
    input_files = (lighting, *scene.read_files)
    return ResultFolder(
        folder, tuple(files), input_files, (lighting,), adds_to=lighting, force=force
    )


def relight_look(
    scenes: Mapping[str, Scene],
    lighting: Lighting,
    results: ResultFolder,
    *,
    spp: int | None = None,
    seed: int = 0,
    resolution: str | None = None,
    progress: Progress = silent,
    render_elsewhere: Callable[[Scene], Estimate] | None = None,
) -> None:
    """Write relit.xml, and its renders as relit.exr and, denoised, relit.png.

    scenes: the scene through each sensor, by the folder in `results` for its pictures; "" for
    `results` itself. resolution: part of the film to render, as in `Settings`. render_elsewhere:
    function that renders the relit scene outside this process.
    """
    for remark in remarks_of_pictures():
        listener(progress).say(remark)
    results.check()
    options: dict[str, Any] = {"seed": seed, "stream": Stream.VERIFICATION, "progress": progress}
    first, *_ = scenes.values()
    with new_answer(results, lighting, scene=first, has_lighting=True) as answer:
        for view, scene in scenes.items():
            folder = answer.path
            relit = on_film(answer.seen_through(scene.sensor), None, resolution)
            label = f"relit of {view}" if view else "relit"
            image = (
                render_elsewhere(relit)
                if render_elsewhere
                else render(relit, spp=spp, label=label, **options)
            )
            (folder / view).mkdir(exist_ok=True)
            write_estimate(folder / view / "relit.exr", image, {})
            features = render_features(relit, seed=seed)
            clean = denoised(image.image, features, quality="high")
            texts = denoiser_text(features, raw="relit.exr")
            stops = choose_exposure(clean, emitters_seen(relit))
            write_png(folder / view / "relit.png", clean, stops=stops, texts=texts)


@dataclass(frozen=True)
class FinalPicture:
    """A render of a scene under a lighting, for use elsewhere.

    image: as rendered. clean: (h, w, 3) linear, denoised. features: what guided the denoiser.
    """

    image: Estimate
    clean: Floats
    features: Features


def render_final(
    scene: Scene,
    lighting: Lighting,
    *,
    width: int,
    spp: int,
    seed: int = 0,
    progress: Progress = silent,
) -> FinalPicture:
    """Render a scene under a lighting at another size; the picture has the same frame.

    width: in pixels; the height follows from the film of the scene's file. spp: samples per pixel.
    Raises LightpaintError if the lighting does not fit the scene.
    """
    with tempfile.TemporaryDirectory(prefix="lightpaint-") as place:
        relit = relight(scene, lighting, Path(place) / RELIT)
        if relit.sensor != scene.sensor:
            relit = reload_relit(relit, relit.path, scene.sensor)
        relit = replace(relit, film=with_width(relit.film, width))
        options: dict[str, Any] = {"seed": seed, "stream": Stream.VERIFICATION}
        image = render(relit, spp=spp, label="final", progress=progress, **options)
        features = render_features(relit, seed=seed)
    return FinalPicture(image, denoised(image.image, features, quality="high"), features)


def write_final_exr(path: Path, picture: FinalPicture) -> None:
    """Write the light of a final render: as rendered, its noise, and denoised as a layer."""
    channels = rgb_channels(picture.image.image)
    channels |= rgb_channels(picture.image.half_difference, HALF_DIFFERENCE)
    channels |= rgb_channels(picture.clean, DENOISED)
    write_parts(path, [ExrPart("rgb", channels, {})])


def write_final_png(path: Path, picture: FinalPicture, transform: ViewTransform) -> None:
    """Write a final render, denoised, as a display shows it: 16 bits a channel."""
    texts = texts_of(transform) | denoiser_text(picture.features, raw="render.exr")
    write_png_16(path, transform.encode(picture.clean), texts=texts)
