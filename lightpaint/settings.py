"""What can be asked of a solve beside scene and painting."""

from dataclasses import dataclass
from typing import get_args

from lightpaint.colour.view import View
from lightpaint.errors import LightpaintError
from lightpaint.lighting.algebra.optimum import Method
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.problem import Space
from lightpaint.scene.quality import Quality


@dataclass(frozen=True)
class Settings:
    """How a painting is to be answered.

    What is solved:
    constraints: what is asked of the lights; it goes before what the scene's lights file asks.
    unpainted: weight of unpainted pixels against the current look.
    method: `polished`, to a certified optimum, or `gauss-seidel`, the paper's sweeps alone.
    resize: whether a target of another size is resampled.
    space: `linear`, or `display` to come closest in what a display shows, which is `view`; None
    for that of the painting or, where it holds light, sRGB at an exposure that shows something.

    What is rendered:
    spp, seed: of the basis and, with other random numbers, of the verification.
    time_s: instead of spp, seconds in which the basis is rendered, of all views together.
    resolution: `1/4` or `320x180`: part of the film that the basis is rendered on. The
    verification has the whole film.
    quality: preset of spp and resolution, where these are not given. With a time or a preset
    the verification has about as many samples as the basis, whatever the resolution.
    use_cache: whether a basis from an earlier run is taken, and this one kept.

    What is done against noise:
    noise_correction: whether the noise's power, or part of it, is taken out of the equations.
    refine: how often to render the scene as solved, with as many samples as the basis, and
    improve the answer by what that shows; needs a scene.

    What is said:
    suggest: how many point lights that would help most are looked for at most; needs a scene, and
    one view only.
    cd_per_unit: cd/m² that a radiance of 1 stands for, for luminous quantities in the results.
    command: the shell command that asks for this, for the report.
    """

    constraints: Constraints | None = None
    unpainted: float = 0.0
    method: Method = "polished"
    resize: bool = False
    space: Space = "linear"
    view: View | None = None
    spp: int | None = None
    time_s: float | None = None
    seed: int = 0
    resolution: str | None = None
    quality: Quality | None = None
    use_cache: bool = True
    noise_correction: bool = False
    refine: int = 0
    suggest: int = 0
    cd_per_unit: float | None = None
    command: str = ""

    def __post_init__(self) -> None:
        if self.space not in get_args(Space):
            known = " or ".join(get_args(Space))
            raise LightpaintError(f"no space {self.space!r} to fit in: expected {known}")

    @property
    def checks_as_basis(self) -> bool:
        """Whether the verification has as many samples as the basis, whatever their films."""
        return self.spp is None and (self.time_s is not None or self.quality is not None)
