"""Presets of samples and resolution, for who would rather not choose numbers.

What they give was measured; docs/benchmarks.md has the table. Noise in the basis makes lights
too dim, and how much depends on the samples of a pixel, hardly on the number of pixels: so a
preview saves pixels before it saves samples.
"""

from dataclasses import dataclass
from typing import Literal

from lightpaint.scene.film import Film, reduction_to
from lightpaint.scene.scene import Scene

Quality = Literal["preview", "final"]


@dataclass(frozen=True)
class Preset:
    """spp: samples per pixel. pixels: how many a film is reduced to at most, where it can be."""

    spp: int
    pixels: int | None = None

    def reduction(self, film: Film) -> int:
        """The factor that brings `film` to `pixels`."""
        return 1 if self.pixels is None else reduction_to(film, self.pixels)


PRESETS: dict[Quality, Preset] = {"preview": Preset(64, 2**15), "final": Preset(512)}


def on_film(scene: Scene, quality: Quality | None, resolution: str | None) -> Scene:
    """`scene` on the film that a basis is rendered on: `resolution`, else the preset's.

    Raises SceneError for a resolution that the film cannot be reduced to.
    """
    if resolution is None and quality is not None:
        resolution = f"1/{PRESETS[quality].reduction(scene.film)}"
    return scene if resolution is None else scene.reduced(resolution)


def samples(quality: Quality | None, *, spp: int | None, time_s: float | None) -> int | None:
    """Samples per pixel of a basis: the preset's where neither they nor a time are given."""
    return PRESETS[quality].spp if quality is not None and spp is None and time_s is None else spp
