"""Presets of samples and resolution, for who would rather not choose numbers.

What they give was measured; docs/benchmarks.md has the table. Noise in the basis makes lights
too dim, and how much depends on the samples of a pixel, hardly on the number of pixels: so a
preview saves pixels before it saves samples.
"""

from dataclasses import dataclass
from typing import Literal

from lightpaint.scene.parsed import View
from lightpaint.scene.resolution import reductions
from lightpaint.scene.scene import Scene

Quality = Literal["preview", "final"]


@dataclass(frozen=True)
class Preset:
    """spp: samples per pixel. pixels: what the film is reduced to, where it divides so."""

    spp: int
    pixels: int | None = None

    def reduction(self, view: View) -> int:
        """The smallest factor that brings `view` to `pixels`, else the largest there is."""
        if self.pixels is None:
            return 1
        width, height = view.crop_size
        possible = reductions(view)
        small = (k for k in possible if width * height <= self.pixels * k * k)
        return next(small, possible[-1])


PRESETS: dict[Quality, Preset] = {"preview": Preset(64, 2**15), "final": Preset(512)}


def with_quality(
    scene: Scene,
    quality: Quality | None,
    *,
    spp: int | None = None,
    time_s: float | None = None,
    resolution: str | None = None,
) -> tuple[Scene, int | None]:
    """The scene to render a basis of, and its samples per pixel: the preset's where none is given.

    With `time_s` there is no number of samples. Raises SceneError for a resolution that does
    not divide the film.
    """
    if quality is not None:
        preset = PRESETS[quality]
        resolution = resolution or f"1/{preset.reduction(scene.view)}"
        spp = preset.spp if spp is None and time_s is None else spp
    return (scene if resolution is None else scene.reduced(resolution)), spp
