"""Estimates the memory needed to render a basis, and checks that it is available."""

from lightpaint.basis.basis import Basis
from lightpaint.basis.render.banded_film import BAND_BYTES, is_banded
from lightpaint.basis.render.integrators import has_indirect_planes, plane_count
from lightpaint.basis.render.render_origin import ONE_PASS, method_of
from lightpaint.errors import SceneError
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import SAMPLES_PER_PASS
from lightpaint.sentences import Hint


def renders_in_bands(scene: Scene, start: Basis | None = None) -> bool:
    """Return whether `render_basis` keeps the sums of the film in a file and only a band in memory.

    start: the basis to continue. Without its exact sums, whole planes are needed.
    """
    can_be_read = start is None or start.sums is not None
    return can_be_read and method_of(scene) == ONE_PASS and is_banded(scene)


def memory_needed(scene: Scene, *, in_bands: bool = False) -> int:
    """Return the peak memory of rendering a basis, in bytes, for any number of samples.

    in_bands: from `renders_in_bands`.
    """
    height, width = scene.size
    images = len(scene.lights) * height * width * 3 * 4
    if in_bands:
        # Half floats of images and half differences, and of indirect light; the remainder is for a
        # band.
        return images * plane_count(scene) // len(scene.lights) + 6 * BAND_BYTES
    # Sums of two halves, the images and half differences computed from them, and a copy of both
    # when they are written to a file; passes are small in comparison.
    sets = 12 if has_indirect_planes(scene) else 6
    return sets * images + 512 * SAMPLES_PER_PASS


def check_memory(scene: Scene, *, in_bands: bool = False) -> None:
    """Raise SceneError if a basis of `scene` does not fit, before the system kills the process."""
    needed_bytes, free_bytes = memory_needed(scene, in_bands=in_bands), _free_memory()
    if free_bytes is not None and needed_bytes > free_bytes:
        height, width = scene.size
        raise SceneError(
            f"{len(scene.lights)} lights at {width}x{height} need {needed_bytes / 1e9:.1f} GB, and "
            f"{free_bytes / 1e9:.1f} GB are free: use ",
            Hint("resolution"),
            " or fewer lights",
        )


def _free_memory() -> int | None:
    """Return the bytes available without swapping; None where unknown (outside Linux)."""
    try:
        with open("/proc/meminfo", encoding="ascii") as lines:
            available = [line.split()[1] for line in lines if line.startswith("MemAvailable:")]
    except OSError:
        return None
    return int(available[0]) * 1024 if available else None
