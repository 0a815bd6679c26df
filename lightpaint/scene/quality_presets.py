"""Presets of samples and resolution.

docs/benchmarks.md has a table of their measured quality. Noise in the basis biases lights towards
dark by an amount that depends on samples per pixel but hardly on the number of pixels, so a preview
saves pixels rather than samples.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from lightpaint.scene.mitsuba_scene import Scene
    from lightpaint.scene.properties.film import Film

Quality = Literal["preview", "final"]


@dataclass(frozen=True)
class Preset:
    """A preset. spp: samples per pixel. pixels: upper bound for the reduced film, if it can be
    met.
    """

    spp: int
    pixels: int | None = None

    def reduction(self, film: "Film") -> int:
        """Return the factor that reduces `film` to `pixels`."""
        from lightpaint.scene.properties.film import reduction_to  # late, as it needs NumPy

        return 1 if self.pixels is None else reduction_to(film, self.pixels)


PRESETS: dict[Quality, Preset] = {"preview": Preset(32, 2**15), "final": Preset(256)}


def on_film(scene: "Scene", quality: Quality | None, resolution: str | None) -> "Scene":
    """Return `scene` on the film for its basis: at `resolution`, or else the resolution of the
    preset.

    Raises SceneError if the film cannot be reduced to that resolution.
    """
    if resolution is None and quality is not None:
        resolution = f"1/{PRESETS[quality].reduction(scene.film)}"
    return scene if resolution is None else scene.reduced(resolution)


def samples(quality: Quality | None, *, spp: int | None, time_s: float | None) -> int | None:
    """Return the samples per pixel of a basis: `spp`, or the preset's if neither it nor a time is
    given.
    """
    return PRESETS[quality].spp if quality is not None and spp is None and time_s is None else spp
