"""What can be asked of a solve beside scene and painting."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, TypedDict

from lightpaint.errors import LightpaintError
from lightpaint.keywords import keywords
from lightpaint.lighting.algebra.optimum import Method
from lightpaint.lighting.fit import Colors, Emitters, Fit, Space
from lightpaint.scene.film import MAX_SPP, check_resolution
from lightpaint.scene.presets import Quality
from lightpaint.validation import SWITCH, Check, a, number, one_of, whole

#: More rounds of rendering and solving again than this are a slip of the pen.
MAX_REFINE = 100
#: And lights that are suggested.
MAX_SUGGEST = 100


@keywords()
@dataclass(frozen=True)
class Settings(Fit):
    """How a painting is to be answered.

    Attributes:
        space: As of `Fit`, as are the next six: `linear` or `display`; None as it was painted.
        hold: Weight of all that is not painted beside all that is; None as it was painted.
        colors: `free`, `gentle` or `white`; None as it was painted.
        unpainted: Instead of `hold`, the weight of each pixel that is not painted.
        literal: Whether the target is taken at its word, and noise is left in the equations, but
            for what is said here.
        method: `polished`, to a certified optimum, or `gauss-seidel`, the paper's sweeps alone.
        transform: The display meant by `space`; None for that of the painting or, where it holds
            light, sRGB at an exposure that shows something.
        emitters: Whether pixels in which the camera sees an emitter count, as of `Fit`.
        resize: Whether a target of another size is resampled.
        spp: Samples per pixel of the basis, and at most of the verification.
        time_s: Instead of spp, seconds in which the basis is rendered, of all views together.
        seed: Of the basis and, with other random numbers, of the verification.
        resolution: `1/4` or `320x180`: part of the film that the basis is rendered on. The
            verification has the whole film, or as much of it as its samples are enough for.
        quality: Preset of spp and resolution, where these are not given.
        use_cache: Whether a basis from an earlier run is taken, and this one kept.
        exact_spp: Whether the basis has just as many samples as are asked for, even where one with
            more is kept: then the answer does not depend on what earlier runs have left.
        noise_correction: Whether the noise's power, or part of it, is taken out of the equations;
            None for wherever it is known, unless `literal`.
        refine: How often to render the scene as solved, with as many samples as the basis, and
            improve the answer by what that shows; needs a scene.
        suggest: How many point lights that would help most are looked for at most; needs a scene,
            and one view only.
        cd_per_unit: cd/m² that a radiance of 1 stands for, for luminous quantities in the results.
        verify: Whether the scene as it was relit is rendered, to see that the prediction holds,
            with as many samples as the basis has at most, so that it takes no longer.
        verify_spp: Instead, samples per pixel of the verification, on the whole film.
        report: Whether there are report.html and comparison.png beside the numbers.
        force: Whether results of something else, or changed by hand, are replaced.
        command: The shell command that asks for this, for the report.

    Raises:
        LightpaintError: For a value that means nothing.

    Examples:
        >>> lp.Settings(spp=64, refine=2).refine
        2
        >>> lp.Settings(refine=-1)
        Traceback (most recent call last):
            ...
        lightpaint.errors.LightpaintError: refine is -1: expected a whole number >= 0, at most 100
    """

    resize: bool = False
    spp: int | None = None
    time_s: float | None = None
    seed: int = 0
    resolution: str | None = None
    quality: Quality | None = None
    use_cache: bool = True
    exact_spp: bool = False
    noise_correction: bool | None = None
    refine: int = 0
    suggest: int = 0
    cd_per_unit: float | None = None
    verify: bool = True
    verify_spp: int | None = None
    report: bool = True
    force: bool = False
    command: str = ""

    expected: ClassVar[Mapping[str, Check]] = {
        **Fit.expected,
        "resize": SWITCH,
        # Two halves of the samples tell the noise.
        "spp": whole(2, MAX_SPP),
        "time_s": number("seconds"),
        "seed": whole(0),
        "resolution": a(str, "a part of the film like '1/4' or '320x180'"),
        "quality": one_of(Quality),
        "use_cache": SWITCH,
        "exact_spp": SWITCH,
        "noise_correction": SWITCH,
        "refine": whole(0, MAX_REFINE),
        "suggest": whole(0, MAX_SUGGEST),
        "cd_per_unit": number("cd/m²"),
        "verify": SWITCH,
        "verify_spp": whole(2, MAX_SPP),
        "report": SWITCH,
        "force": SWITCH,
        "command": a(str, "the text of a shell command"),
    }

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.spp is not None and self.time_s is not None:
            raise LightpaintError(
                f"spp is {self.spp} and time_s {self.time_s:g}: expected a number of samples or a "
                "time to render for, not both"
            )
        if self.exact_spp and self.time_s is not None:
            raise LightpaintError(
                f"exact_spp is True and time_s {self.time_s:g}: expected a number of samples, of "
                "which a time says nothing"
            )
        if self.verify_spp is not None and not self.verify:
            raise LightpaintError(
                f"verify is False and verify_spp {self.verify_spp}: expected one of them, no "
                "verification or its samples"
            )
        if self.resolution is not None:
            check_resolution(self.resolution)

    def corrects_noise(self, *, is_known: bool) -> bool:
        """Whether noise is taken out of the equations. is_known: whether the basis knows it."""
        if self.noise_correction is None:
            return is_known and not self.literal
        return self.noise_correction

    @property
    def checks_as_basis(self) -> bool:
        """Whether the verification has as many samples as the basis, whatever their films."""
        return self.spp is None and (self.time_s is not None or self.quality is not None)


class SettingsByName(TypedDict, total=False):
    """Fields of `Settings` for `**settings`, so that type checkers know their names.

    `transform` is an argument of its own where part of one can be asked.
    """

    space: Space | None
    hold: float | None
    colors: Colors | None
    unpainted: float
    literal: bool
    method: Method
    emitters: Emitters
    resize: bool
    spp: int | None
    time_s: float | None
    seed: int
    resolution: str | None
    quality: Quality | None
    use_cache: bool
    exact_spp: bool
    noise_correction: bool | None
    refine: int
    suggest: int
    cd_per_unit: float | None
    verify: bool
    verify_spp: int | None
    report: bool
    force: bool
    command: str
