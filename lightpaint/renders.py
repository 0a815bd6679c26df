"""What is rendered to be painted on or looked at: templates, and scenes as they were relit."""

from pathlib import Path

from lightpaint.basis.render.render import render_basis
from lightpaint.colour.display import choose_exposure
from lightpaint.colour.transform import ViewTransform
from lightpaint.images.estimate import write_estimate
from lightpaint.images.png import write_png
from lightpaint.lighting.lighting import Lighting
from lightpaint.progress import Progress, silent
from lightpaint.relit.relight import check_relightable, relight, settle
from lightpaint.result_folder import ResultFolder
from lightpaint.scene.quality import Preset
from lightpaint.scene.render import Stream, render
from lightpaint.scene.scene import Scene
from lightpaint.scene.surfaces import render_surfaces
from lightpaint.target.template import Template, write_look, write_template

#: Rendering of what each light does alone, to recognise it by.
THUMBNAIL = Preset(32, 2**14)


def render_template(
    scene: Scene,
    folder: str | Path,
    *,
    transform: ViewTransform | None = None,
    spp: int | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> list[Path]:
    """Render something to paint on into `folder`, and return its files (docs/targets.md).

    Args:
        scene: What is to be painted.
        folder: Receives the files.
        transform: How the look becomes a picture; sRGB by default, at an exposure that shows
            something.
        spp: Samples per pixel (the scene's own number by default).
        seed: Any number >= 0.
        progress: Hears how far the work has come.

    Examples:
        >>> scene = lp.load_scene("room.xml")
        >>> files = lp.render_template(scene, "template", spp=4)
        >>> "template.png" in [file.name for file in files]
        True
    """
    look = render(
        scene, spp=spp, seed=seed, stream=Stream.TEMPLATE, label="template", progress=progress
    ).image
    surfaces = render_surfaces(scene, seed=seed, progress=progress)
    small = scene.reduced(f"1/{THUMBNAIL.reduction(scene.film)}")
    lights = render_basis(small, spp=THUMBNAIL.spp, seed=seed, progress=progress)
    template = Template(
        look,
        transform or ViewTransform("srgb", choose_exposure(look)),
        scene=scene.path.name,
        content=scene.content,
        sensor=scene.sensor_names[scene.sensor],
        albedo=surfaces.albedo,
    )
    return write_template(
        Path(folder),
        template,
        normals=surfaces.normal,
        depth=surfaces.depth,
        mattes=surfaces.coverage,
        lights=dict(zip(lights.names, lights.images, strict=True)),
    )


def render_look(
    scene: Scene,
    path: Path,
    *,
    transform: ViewTransform | None = None,
    spp: int | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> Path:
    """Only the look to paint on, as EXR at `path`; returns the PNG beside it."""
    look = render(
        scene, spp=spp, seed=seed, stream=Stream.TEMPLATE, label="template", progress=progress
    ).image
    return write_look(path, look, transform or ViewTransform("srgb", choose_exposure(look)))


def relit_folder(
    scene: Scene, lighting: Path, folder: Path, *, force: bool = False
) -> ResultFolder:
    """Where `relight_look` writes. lighting: the file whose lighting it is."""
    files = [*check_relightable(scene, folder / "relit.xml")]
    files += [folder / "relit.exr", folder / "relit.png"]
    reads = (lighting, *scene.read_files)
    return ResultFolder(folder, tuple(files), reads, (lighting,), adds_to=lighting, force=force)


def relight_look(
    scene: Scene,
    lighting: Lighting,
    results: ResultFolder,
    *,
    spp: int | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> None:
    """Write relit.xml, and its render as relit.exr and relit.png."""
    results.check()
    with results.filled() as folder:
        relit = relight(scene, lighting, folder / "relit.xml")
        image = render(
            relit, spp=spp, seed=seed, stream=Stream.VERIFICATION, label="relit", progress=progress
        )
        write_estimate(folder / "relit.exr", image, {})
        write_png(folder / "relit.png", image.image, stops=choose_exposure(image.image))
        settle(scene, lighting, folder / "relit.xml", results.folder / "relit.xml")
