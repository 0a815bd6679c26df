"""The origin of a basis: scene, sensor, seed, samples and method."""

from dataclasses import dataclass

from lightpaint.errors import BasisError
from lightpaint.version import __version__

#: Maximum number of samples per pixel, beyond that of any render.
MAX_SAMPLES = 2**40

#: Prefix of the method of light groups, before the name of the renderer.
LIGHT_GROUPS = "light groups of "


@dataclass(frozen=True)
class Origin:
    """The origin of a basis, which decides whether bases are comparable and samples can be added.

    halves: samples per pixel of each of the two halves; a light rendered alone until it was as
    clean as the others counts as having theirs. passes: number of passes of each half.
    each_light: samples of halves A and B and passes of A and B for each light, if these numbers
    differ because separate renders were interrupted or come from several runs; `halves` and
    `passes` are then the minimum over all lights.
    integrator: the integrator that replaced the scene's; "" if that was used.
    is_composed: whether planes come from several renders, some of them of other states of the
    scene, so that no single render reproduces the basis exactly.
    extra_spp: mean number of additional samples per pixel where a painting needed them (see
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
        """Samples per pixel in both halves together."""
        return sum(self.halves)

    @property
    def mean_spp(self) -> float:
        """Mean samples per pixel, including extra ones."""
        return self.spp + self.extra_spp

    @property
    def samples_text(self) -> str:
        """The number of samples in words, such as `16 samples per pixel`."""
        text = f"{self.spp} samples per pixel"
        if not self.extra_spp:
            return text
        return f"{text} and, on average, {self.extra_spp:.3g} more where a painting needed them"

    @property
    def is_light_groups(self) -> bool:
        """True if another renderer made the picture, which then has no template."""
        return self.method.startswith(LIGHT_GROUPS)
