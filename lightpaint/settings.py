"""What can be asked of a solve beside scene and painting."""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from numbers import Integral, Real
from typing import Any, get_args

from lightpaint.colour.transform import ViewTransform
from lightpaint.errors import LightpaintError
from lightpaint.lighting.algebra.optimum import Method
from lightpaint.lighting.problem import Space
from lightpaint.scene.film import check_resolution
from lightpaint.scene.quality import Quality

#: More rounds of rendering and solving again than this are a slip of the pen.
MAX_REFINE = 100


@dataclass(frozen=True)
class Settings:
    """How a painting is to be answered.

    Attributes:
        unpainted: Weight of unpainted pixels against the current look.
        method: `polished`, to a certified optimum, or `gauss-seidel`, the paper's sweeps alone.
        resize: Whether a target of another size is resampled.
        space: `linear`, or `display` to come closest in what a display shows.
        transform: The display meant by `space`; None for that of the painting or, where it holds
            light, sRGB at an exposure that shows something.
        spp: Samples per pixel of the basis and of the verification.
        time_s: Instead of spp, seconds in which the basis is rendered, of all views together.
        seed: Of the basis and, with other random numbers, of the verification.
        resolution: `1/4` or `320x180`: part of the film that the basis is rendered on. The
            verification has the whole film.
        quality: Preset of spp and resolution, where these are not given. With a time or a preset
            the verification has about as many samples as the basis, whatever the resolution.
        use_cache: Whether a basis from an earlier run is taken, and this one kept.
        noise_correction: Whether the noise's power, or part of it, is taken out of the equations.
        refine: How often to render the scene as solved, with as many samples as the basis, and
            improve the answer by what that shows; needs a scene.
        suggest: How many point lights that would help most are looked for at most; needs a scene,
            and one view only.
        cd_per_unit: cd/m² that a radiance of 1 stands for, for luminous quantities in the results.
        command: The shell command that asks for this, for the report.

    Raises:
        LightpaintError: For a value that means nothing.

    Examples:
        >>> lp.Settings(spp=64, refine=2).space
        'linear'
        >>> lp.Settings(refine=-1)
        Traceback (most recent call last):
            ...
        lightpaint.errors.LightpaintError: refine is -1: expected a whole number >= 0, at most 100
    """

    unpainted: float = 0.0
    method: Method = "polished"
    resize: bool = False
    space: Space = "linear"
    transform: ViewTransform | None = None
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
        for field in fields(self):
            value, (fits, expected) = getattr(self, field.name), _EXPECTED[field.name]
            if not (fits(value) or (value is None and field.default is None)):
                raise LightpaintError(f"{field.name} is {value!r}: expected {expected}")
        if self.spp is not None and self.time_s is not None:
            raise LightpaintError(
                f"spp is {self.spp} and time_s {self.time_s:g}: expected a number of samples or a "
                "time to render for, not both"
            )
        if self.resolution is not None:
            check_resolution(self.resolution)

    @property
    def checks_as_basis(self) -> bool:
        """Whether the verification has as many samples as the basis, whatever their films."""
        return self.spp is None and (self.time_s is not None or self.quality is not None)


#: Whether a value will do, and what else is expected of it.
Check = tuple[Callable[[Any], bool], str]


def _whole(least: int, most: float = math.inf) -> Check:
    # bool is an int to Python, and no number to people.
    def fits(value: Any) -> bool:
        return isinstance(value, Integral) and not _is_bool(value) and least <= int(value) <= most

    return fits, f"a whole number >= {least}" + (f", at most {most}" if most < math.inf else "")


def _number(about: str, *, may_be_zero: bool = False) -> Check:
    def fits(value: Any) -> bool:
        if not isinstance(value, Real) or _is_bool(value):
            return False
        return 0 < float(value) < math.inf or (may_be_zero and value == 0)

    return fits, f"{about} {'>= 0' if may_be_zero else '> 0'}"


def _one_of(words: Any) -> Check:
    known = get_args(words)
    expected = " or ".join(map(repr, known))
    return lambda value: isinstance(value, str) and value in known, expected


def _a(kind: type, about: str) -> Check:
    return lambda value: isinstance(value, kind), about


def _is_bool(value: Any) -> bool:
    return isinstance(value, bool)


_SWITCH: Check = (_is_bool, "True or False")

_EXPECTED: dict[str, Check] = {
    "unpainted": _number("a weight", may_be_zero=True),
    "method": _one_of(Method),
    "resize": _SWITCH,
    "space": _one_of(Space),
    "transform": _a(ViewTransform, "a ViewTransform, like ViewTransform('agx', 1.0)"),
    # Two halves of the samples tell the noise.
    "spp": _whole(2),
    "time_s": _number("seconds"),
    "seed": _whole(0),
    "resolution": _a(str, "a part of the film like '1/4' or '320x180'"),
    "quality": _one_of(Quality),
    "use_cache": _SWITCH,
    "noise_correction": _SWITCH,
    "refine": _whole(0, MAX_REFINE),
    "suggest": _whole(0),
    "cd_per_unit": _number("cd/m²"),
    "command": _a(str, "the text of a shell command"),
}
