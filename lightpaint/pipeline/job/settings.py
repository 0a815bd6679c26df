"""Settings of a solve, beyond scene and painting."""

from dataclasses import dataclass
from typing import Annotated, TypedDict

from lightpaint.errors import LightpaintError
from lightpaint.keywords import keywords
from lightpaint.lighting.algebra.optimum import Method
from lightpaint.lighting.fit import Colors, Emitters, Fit, Space
from lightpaint.scene.lights.texels.texel import MAX_TEXELS
from lightpaint.scene.properties.film import MAX_SPP, check_resolution
from lightpaint.scene.quality_presets import Quality, samples
from lightpaint.validation import a, between, number, whole

#: Maximum number of rounds of rendering and solving again: a larger number is a typing error.
MAX_REFINE = 100
#: Maximum number of suggested lights: a larger number is a typing error.
MAX_SUGGEST = 32
#: Least error that may be asked for: a smaller one is a typing error.
MIN_ERROR = 1e-4
#: Samples per pixel of the pilot, which tells where more are needed.
PILOT_SPP = 16


@keywords()
@dataclass(frozen=True)
class Settings(Fit):
    """The settings of a solve.

    Attributes:
        space: `linear` or `display`; None decides by the painting. It and the next six are those of
            `Fit`.
        hold: Weight of all unpainted pixels relative to all painted ones; None decides by the
            painting.
        colors: `free`, `gentle`, `white` or `own`; None decides by the painting.
        unpainted: Weight of each unpainted pixel, instead of `hold`.
        literal: True to fit the target exactly as given and leave noise in the equations, unless
            another setting says otherwise.
        method: `polished`, to a certified optimum, or `gauss-seidel`, the paper's sweeps alone.
        transform: View transform of `space`; None for that of the painting or, if it holds light,
            sRGB at a metered exposure.
        emitters: Whether pixels in which the camera sees an emitter count, as in `Fit`.
        resize: Whether to resample a target of another size.
        spp: Samples per pixel of the basis, and upper limit for the verification.
        time_s: Seconds to render the bases of all views, instead of spp.
        error: Largest error of any visible light, as a share of its luminance, at 95 %: samples are
            added where the painting needs them until it is met, instead of spp; with time_s for
            that many seconds at most.
        seed: Seed of the basis; the verification derives its own from it.
        resolution: `1/4` or `320x180`: size of the film for the basis. The verification uses the
            whole film, or as much of it as its samples allow.
        quality: Preset of spp and resolution, if these are not given.
        use_cache: Whether to use a basis from an earlier run, and keep this one.
        exact_spp: Whether to use exactly the requested samples, even if a cached basis has more:
            then the answer does not depend on earlier runs.
        noise_correction: Whether to remove the power of the noise, or part of it, from the
            equations; None if the noise is known, unless `literal`.
        refine: Rounds of rendering the solved scene, with as many samples as the basis, and
            improving the answer; needs a scene.
        suggest: Maximum number of point lights to suggest; needs a scene. All views count.
        sun: How many texels a sky that is split may get more, finer ones where a sun is; None for
            as many as the lights file says, by default none.
        move_lights: Whether to move the lights that may move.
        animate: True to find a lighting for each painted frame of a shot, and lights that change
            smoothly between them, instead of one lighting for all.
        cd_per_unit: cd/m² that a radiance of 1 stands for, for luminous quantities in the results.
        verify: Whether to render the relit scene and compare it with the prediction, with at most
            as many samples as the basis, so that it takes no longer.
        verify_spp: Samples per pixel of the verification on the whole film, instead of that limit.
        report: Whether to write report.html and comparison.png beside the numbers.
        force: Whether to replace results of another painting, or ones changed by hand.
        command: The shell command of this solve, for the report.

    Raises:
        LightpaintError: For an invalid value.

    Examples:
        >>> lp.Settings(spp=64, refine=2).refine
        2
        >>> lp.Settings(refine=-1)
        Traceback (most recent call last):
            ...
        lightpaint.errors.LightpaintError: refine is -1: expected a whole number >= 0, at most 100
    """

    resize: bool = False
    # The noise is estimated from two halves of the samples.
    spp: Annotated[int | None, whole(2, MAX_SPP)] = None
    time_s: Annotated[float | None, number("seconds")] = None
    error: Annotated[float | None, between(MIN_ERROR, 1, "a share")] = None
    seed: Annotated[int, whole(0)] = 0
    resolution: Annotated[str | None, a(str, "a part of the film like '1/4' or '320x180'")] = None
    quality: Quality | None = None
    use_cache: bool = True
    exact_spp: bool = False
    noise_correction: bool | None = None
    refine: Annotated[int, whole(0, MAX_REFINE)] = 0
    suggest: Annotated[int, whole(0, MAX_SUGGEST)] = 0
    sun: Annotated[int | None, whole(0, MAX_TEXELS)] = None
    move_lights: bool = True
    animate: bool = False
    cd_per_unit: Annotated[float | None, number("cd/m²")] = None
    verify: bool = True
    verify_spp: Annotated[int | None, whole(2, MAX_SPP)] = None
    report: bool = True
    force: bool = False
    command: Annotated[str, a(str, "the text of a shell command")] = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.spp is not None and self.time_s is not None:
            raise LightpaintError(
                f"spp is {self.spp} and time_s {self.time_s:g}: expected a number of samples or a "
                "rendering time, not both"
            )
        if self.error is not None and (self.spp is not None or self.exact_spp):
            given_text = f"spp {self.spp}" if self.exact_spp is False else "exact_spp True"
            raise LightpaintError(
                f"error is {self.error:g} and {given_text}: expected either the largest error of a "
                "light, or a number of samples"
            )
        if self.exact_spp and self.time_s is not None:
            raise LightpaintError(
                f"exact_spp is True and time_s {self.time_s:g}: expected a number of samples "
                "(spp) instead of a time"
            )
        if self.verify_spp is not None and not self.verify:
            raise LightpaintError(
                f"verify is False and verify_spp {self.verify_spp}: expected either no "
                "verification, or its samples"
            )
        if self.resolution is not None:
            check_resolution(self.resolution)

    def corrects_noise(self, *, is_known: bool) -> bool:
        """Return True if noise is removed from the equations.

        is_known: whether the basis knows its noise.
        """
        if self.noise_correction is None:
            return is_known and not self.literal
        return self.noise_correction

    @property
    def checks_as_basis(self) -> bool:
        """True if the verification takes as many samples as the basis, whatever their films."""
        return self.spp is None and (
            self.time_s is not None or self.error is not None or self.quality is not None
        )

    @property
    def basis_spp(self) -> int | None:
        """Samples per pixel that the basis is rendered with at first; None for the scene's own."""
        if self.error is not None:
            return PILOT_SPP
        return samples(self.quality, spp=self.spp, time_s=self.time_s)


class SettingsByName(TypedDict, total=False):
    """The fields of `Settings` for `**settings`, so that type checkers know their names.

    `transform` is missing: functions that accept a partial one have an argument for it.
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
    error: float | None
    seed: int
    resolution: str | None
    quality: Quality | None
    use_cache: bool
    exact_spp: bool
    noise_correction: bool | None
    refine: int
    suggest: int
    sun: int | None
    move_lights: bool
    animate: bool
    cd_per_unit: float | None
    verify: bool
    verify_spp: int | None
    report: bool
    force: bool
    command: str
