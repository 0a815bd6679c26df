"""Measures the illuminance at points of planes, from every light, in one pass."""

from collections.abc import Sequence

from lightpaint.photometry.illuminance import Illuminance
from lightpaint.photometry.measuring_plane import MeasuringPlane
from lightpaint.progress import Progress, silent
from lightpaint.scene.scene import Scene


def measure_illuminance(
    scene: Scene,
    planes: Sequence[MeasuringPlane],
    *,
    spp: int | None = None,
    error: float = 0.02,
    cd_per_unit: float = 1.0,
    seed: int = 0,
    use_cache: bool = True,
    progress: Progress = silent,
) -> Illuminance:
    """Return the illuminance at the points of `planes` from every light of `scene`.

    spp: samples per point; by default as many as the error needs. error: largest relative error of
    the 95 % interval of a plane's mean, and standard error of a point, with all lights as they are.
    cd_per_unit: cd/m² of a radiance of 1. Raises Interrupted on Ctrl-C, which keeps samples.
    """
    raise NotImplementedError
