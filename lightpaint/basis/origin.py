"""The origin of a basis: scene, sensor, seed, samples and method."""

from dataclasses import dataclass

from lightpaint.errors import BasisError
from lightpaint.version import __version__

#: Most samples of a pixel, which is beyond any render.
MAX_SAMPLES = 2**40

#: Prefix of the method of light groups; the renderer follows.
LIGHT_GROUPS = "light groups of "


@dataclass(frozen=True)
class Origin:
    """The origin of a basis, which decides whether bases are comparable and samples can be added.

    halves: samples per pixel of each of the two halves; passes: the number of passes of each.
    each_light: where lights have unequal numbers of samples, because an interrupt ended separate
    renders or because they come from several runs, samples of half A and B and passes of A and B of
    each; `halves` and `passes` are then what all have at least.
    integrator: replacement of the scene's own; "" if there was none.
    is_composed: whether planes come from several renders, some of them of another state of the
    scene, so that no single render reproduces it.
    extra_spp: further samples per pixel, on average, taken where a painting needed them (see
    `Basis.extra`).
    """

    scene: str
    scene_identity: str
    sensor: str
    seed: int
    method: str
    halves: tuple[int, int]
    passes: tuple[int, int]
    lightpaint: str = __version__
    each_light: tuple[tuple[int, int, int, int], ...] = ()
    integrator: str = ""
    is_composed: bool = False
    extra_spp: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.extra_spp <= MAX_SAMPLES:
            raise BasisError(f"{self.extra_spp} extra samples are not 0 or more")
        if (
            max(max(counts) for counts in (self.halves, self.passes, *self.each_light))
            > MAX_SAMPLES
        ):
            raise BasisError(f"{self.halves} samples are more than any render has")

    @property
    def spp(self) -> int:
        """Samples per pixel in all."""
        return sum(self.halves)

    @property
    def mean_spp(self) -> float:
        """Samples per pixel in the mean, extra ones included."""
        return self.spp + self.extra_spp

    @property
    def samples_text(self) -> str:
        """Return how many samples pixels have, as `16 samples per pixel`."""
        text = f"{self.spp} samples per pixel"
        if not self.extra_spp:
            return text
        return f"{text} and, in the mean, {self.extra_spp:.3g} more where a painting needed them"

    @property
    def is_light_groups(self) -> bool:
        """True if another renderer made it, so that its picture has no template."""
        return self.method.startswith(LIGHT_GROUPS)
