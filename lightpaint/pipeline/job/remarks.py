"""Remarks for the user before a job runs, in plain text."""

from collections.abc import Mapping

from lightpaint.basis.render import memory_needed, remark_on_separate_renders, renders_in_bands
from lightpaint.display_text import some_names
from lightpaint.images import MISSING_REMARK, Size, left_over, oidn_is_installed, whole_factor
from lightpaint.lighting import Constraints
from lightpaint.pipeline.job.settings import Settings
from lightpaint.scene import Scene
from lightpaint.scene.quality_presets import PRESETS
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.sentences import Hint, Sentence, Word
from lightpaint.target import Target

#: Bytes of memory above which a basis gets a remark.
MUCH_MEMORY = 2e9


def remarks_of_scene(scene: Scene, *, is_rendered: bool = True) -> list[str]:
    """Return remarks on the lights of a scene and, if it is rendered, on how."""
    remarks: list[str] = []
    if scene.lights_file is not None:
        remarks.append(f"lights and groups as in {scene.lights_file}")
    remarks += [
        Sentence(
            f"{len(x.members)} similar lamps without names form one light, {x.name}: ",
            Hint("group_alike", False),
            " separates them, ",
            Hint("groups", {"name": ...}),
            " makes a light of some",
        )
        for x in scene.lights
        if x.is_found
    ]
    # Many hang in a room, and few kinds of them.
    remarks += dict.fromkeys(text for x in scene.luminaires for text in x.remarks())
    if scene.integrator_choice is not None:
        remarks.append(
            f"rendered with {scene.integrator_choice} instead of the scene's own integrator"
        )
    if scene.is_spectral and (camera := scene.observer).is_camera:
        remarks.append(
            f"seen by the camera {camera.name}, whose colours in daylight differ from the eye's by "
            f"a mean ΔE of {camera.color_error:.1f}"
        )
    if obstacles := [f"{x.name!r} {x.obstacle}" for x in scene.emitters if x.obstacle]:
        remarks.append(f"not adjusted: {some_names(obstacles, '; ')}")
    if scene.is_spectral and (metals := scene.rgb_metals):
        remarks.append(
            f"{some_names(metals)}: eta and k in RGB, which Mitsuba's spectral variants show too "
            "dark; give the metal by its name (material) or by spectra"
        )
    # Python code gets the same text as a warning.
    note = use_variant().note
    if not note and is_rendered:
        note = remark_on_separate_renders(scene) or ""
    return [*remarks, note] if note else remarks


def remarks_on_spectra(scene: Scene, constraints: Constraints) -> list[Sentence]:
    """Return a remark on lamps with spectra in a scene that is rendered without them."""
    names = {
        name
        for name, table, _ in constraints.lights
        for emitter in table.get("emitters", ())
        if isinstance(emitter, Mapping) and "spectrum" in emitter
    }
    if scene.is_spectral or not names:
        return []
    verb = "has" if len(names) == 1 else "have"
    remark = Sentence(
        f"{some_names(sorted(names))} {verb} spectra, of which pictures in RGB show the colour "
        "alone: ",
        Hint("spectral", True),
        " renders with them",
    )
    return [remark]


def remarks_of_film(scene: Scene, settings: Settings) -> list[str]:
    """Return remarks on pixels that a reduced film leaves out, and on its size.

    scene: on the reduced film.
    """
    film, remarks = scene.film, []
    width, height = film.pixels
    if any(film.left_out):
        film_text = "x".join(map(str, film.crop_size))
        remarks.append(
            f"film of {film_text} reduced to {width}x{height} blocks of {film.block}x{film.block} "
            f"pixels: {_remainder_text(film.left_out)} left over and ignored"
        )
    max_pixels = None
    if settings.quality is not None and settings.resolution is None:
        max_pixels = PRESETS[settings.quality].pixels
    if max_pixels is not None and width * height > max_pixels:
        quality = Hint("quality", Word(settings.quality))
        remark = Sentence(
            "the film cannot be reduced as far as ",
            quality,
            f" asks: {width}x{height} pixels are rendered",
        )
        remarks.append(remark)
    return remarks


def _remainder_text(remainder: tuple[int, int]) -> str:
    """Return `3 columns of pixels at the right and 1 row at the bottom are`.

    remainder: their counts.
    """
    columns, rows = remainder
    parts = [f"{columns} column{'s' * (columns > 1)} of pixels at the right"] * bool(columns)
    parts += [f"{rows} row{'s' * (rows > 1)} at the bottom"] * bool(rows)
    return f"{' and '.join(parts)} {'is' if columns + rows == 1 else 'are'}"


def remarks_of_pictures() -> list[str]:
    """Return a remark if the better denoiser is not installed."""
    return [] if oidn_is_installed() else [MISSING_REMARK]


def remarks_of_memory(scene: Scene) -> list[str]:
    """Return a remark if the basis of `scene` takes much memory."""
    needed_bytes = memory_needed(scene, in_bands=renders_in_bands(scene))
    if needed_bytes <= MUCH_MEMORY:
        return []
    return [
        f"{len(scene.lights)} lights of {scene.size[1]}x{scene.size[0]} pixels: "
        f"up to {needed_bytes / 1e9:.1f} GB of memory"
    ]


def remarks_of_target(
    target: Target,
    size: Size,
    scene: Scene | None,
    fit: Settings,
    *,
    film: Size | None = None,
) -> list[str]:
    """Return remarks on how `target` was read.

    size: of the basis. fit: the resolved settings. film: size of the whole film, if the scene is
    rendered.
    """
    remarks = []
    if scene is not None and target.content not in ("", scene.content):
        remarks.append("the scene has changed since its template was made")
    (height, width), (mine_h, mine_w) = size, target.size
    is_asked_for = fit.resize or fit.resolution or fit.quality
    if size != target.size and not is_asked_for:
        remainder = left_over(target.size, whole_factor(target.size, size) or 1)
        remark = f"{mine_w}x{mine_h} pixels averaged to the basis's {width}x{height}"
        if any(remainder):
            remark += f": {_remainder_text((remainder[1], remainder[0]))} left over and ignored"
        remarks.append(remark)
    if film not in (None, size) and not is_asked_for:
        remarks.append(f"solved at {width}x{height} pixels, the size of its template")
    name = "srgb" if target.transform is None else target.transform.name
    if fit.space == "linear" and name not in ("srgb", "linear"):
        remark = Sentence(
            f"painted through {name}, whose highlights stand for very much light and dominate the "
            "fit: ",
            Hint("space", Word("display")),
            " fits what the eye sees",
        )
        remarks.append(remark)
    remarks += target.notes
    if target.not_finite:
        remarks.append(f"{target.not_finite} pixels hold NaN or Inf and are ignored")
    return [Sentence(f"{target.name}: ", remark) for remark in remarks]
