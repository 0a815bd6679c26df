"""Settings of a solve, beyond scene and painting."""

from dataclasses import dataclass
from typing import Annotated, TypedDict

from lightpaint import validation
from lightpaint.errors import LightpaintError
from lightpaint.keywords import keywords
from lightpaint.lighting import Colors, Emitters, Fit, Method, Space
from lightpaint.scene.quality_presets import Quality, samples
from lightpaint.sentences import Hint

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
        space: `linear` or `display`; None decides by the painting. It and the next six are as in
            `Fit`.
        hold: Weight of all unpainted pixels relative to all painted ones; None decides by the
            painting.
        colors: `free`, `gentle`, `white` or `own`; None decides by the painting.
        unpainted: Weight of each unpainted pixel, instead of `hold`.
        literal: True to fit the target exactly as given and leave noise in the equations, unless
            another setting says otherwise.
        method: `polished`, to a certified optimum, or `gauss-seidel`, the paper's sweeps alone.
        transform: View transform of `space`; None for the transform of the painting or, if it holds
            light, sRGB at a metered exposure.
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
        spectral: Whether to render with the spectra of the lamps' emitters, in the lights file, and
            find a drive for each; needs a scene.
        observer: Path of a table with the sensitivities of a camera, which sees the picture in
            place of the eye; with `spectral`.
        move_lights: Whether to move the lights that may move.
        animate: True to find a lighting for each painted frame of a shot, and lights that change
            smoothly between them, instead of one lighting for all.
        cd_per_unit: cd/m² that a radiance of 1 stands for, for luminous quantities in the results.
        planes: Path of a planes file, with wishes for illuminance: the answer meets
            these, and comes as close to the painting as it then can. Needs a scene.
        watts: Largest power of all lamps together, in place of the limit of the planes file.
        ignore_wishes: Whether only the painting counts: planes are measured and reported, and
            neither their wishes nor limits of power bind the answer.
        verify: Whether to render the relit scene and compare it with the prediction, with at most
            as many samples as the basis, so that it takes no longer.
        verify_spp: Samples per pixel of the verification on the whole film, instead of that limit.
        error_bars: Whether to estimate how far noise may move each light, which of thousands of
            lights takes minutes.
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

    resize: Annotated[
        bool,
        validation.Option(
            "--resize",
            "resample a target whose size differs from the basis",
            default="refuse it",
            theme="Painting",
        ),
    ] = False
    # The noise is estimated from two halves of the samples.
    spp: Annotated[
        int | None,
        validation.whole(2, validation.MAX_SPP),
        validation.Option(
            "--spp N", "samples per pixel", default="the scene's", theme="How much to render"
        ),
    ] = None
    time_s: Annotated[
        float | None,
        validation.number("seconds"),
        validation.Option(
            "--time SECONDS",
            "seconds to render the basis, instead of --spp. They include compilation, but not "
            "the verification; samples of earlier runs are added",
            theme="How much to render",
        ),
    ] = None
    error: Annotated[
        float | None,
        validation.between(MIN_ERROR, 1, "a share"),
        validation.Option(
            "--error SHARE",
            "render until no visible light has a larger error than this, like 2%%, instead of "
            "--spp: 16 samples per pixel come first, then more where the painting needs them; "
            "--time limits the seconds",
            theme="How much to render",
            parse=validation.parse_share,
        ),
    ] = None
    seed: Annotated[
        int,
        validation.whole(0),
        validation.Option(
            "--seed S", "random seed", default="%(default)s", theme="How much to render"
        ),
    ] = 0
    resolution: Annotated[
        str | None,
        validation.a(str, "a part of the film like '1/4' or '320x180'"),
        validation.Option(
            "--resolution 1/N|WxH",
            "render one pixel for each square block of film pixels, like 1/4 or 320x180; "
            "incomplete blocks at the right and bottom edges are left out",
            default="the whole film",
            theme="How much to render",
        ),
    ] = None
    quality: Annotated[
        Quality | None,
        validation.Option(
            "--quality",
            "preview: 32 samples per pixel on about 30,000 pixels, each of which is a block of "
            "film pixels; final: 256 on the whole film. --spp, --time and --resolution take "
            "precedence",
            theme="How much to render",
        ),
    ] = None
    use_cache: Annotated[
        bool,
        validation.Option(
            "--no-cache",
            "do not use bases of earlier runs, and do not keep this one",
            default="do both",
            theme="How much to render",
        ),
    ] = True
    exact_spp: Annotated[
        bool,
        validation.Option(
            "--exact-spp",
            "use exactly the requested samples per pixel, even if the cache has a basis with more",
            default="use that one",
            theme="How much to render",
        ),
    ] = False
    noise_correction: Annotated[
        bool | None,
        validation.Option(
            "--correct-noise",
            "subtract the power of the noise from the equations as far as that helps, so that "
            "the answer is closer to one from many samples",
            default="if the noise is known",
            theme="What the painting means",
        ),
    ] = None
    refine: Annotated[
        int,
        validation.whole(0, MAX_REFINE),
        validation.Option(
            "--refine K",
            "render the solved scene K times, with as many samples as the basis, and improve the "
            "answer each time",
            default="%(default)s",
            theme="What the painting means",
        ),
    ] = 0
    suggest: Annotated[
        int,
        validation.whole(0, MAX_SUGGEST),
        validation.Option(
            "--suggest N",
            "suggest up to N (3) new point lights that would help most, with XML to paste, and "
            "the best turn of one spot of the scene; takes about half a minute",
            theme="Shots, looks and advice",
            bare=3,
            least=1,
        ),
    ] = 0
    sun: Annotated[
        int | None,
        validation.whole(0, validation.MAX_TEXELS),
        validation.Option(
            "--sun N",
            "find a sun in a sky that is split: split its texels again where the painting gains "
            "most by it, into N (72) more at most, 24 at a time",
            default="as the lights file says",
            theme="Lights",
            bare=72,
        ),
    ] = None
    spectral: Annotated[
        bool,
        validation.Option(
            "--spectral",
            "render with the spectra of the emitters in the lights file, one picture for each, "
            "which shows what LEDs do to colours; takes about three times as long",
            default="render in RGB",
            theme="Lights",
        ),
    ] = False
    observer: Annotated[
        str | None,
        validation.a(str, "the path of a table of sensitivities"),
        validation.Option(
            "--observer FILE",
            "with --spectral: the camera that sees the picture, by a table of nanometres and the "
            "sensitivities of red, green and blue",
            default="the eye",
            theme="Lights",
        ),
    ] = None
    move_lights: Annotated[
        bool,
        validation.Option(
            "--no-move",
            "keep all lights in place, even if the lights file lets them move",
            theme="Lights",
        ),
    ] = True
    animate: Annotated[
        bool,
        validation.Option(
            "--animate",
            "of a shot with several painted frames: find a lighting for each, and lights that "
            "change smoothly between them",
            default="one lighting for all frames",
            theme="Shots, looks and advice",
        ),
    ] = False
    cd_per_unit: Annotated[
        float | None,
        validation.number("cd/m²"),
        validation.Option(
            "--unit CD/M2",
            "luminance in cd/m² of a radiance of 1 in the scene, to show lumen, candela and lux",
            default="relative numbers without units",
            theme="Lights",
        ),
    ] = None
    planes: Annotated[
        str | None,
        validation.a(str, "the path of a planes file"),
        validation.Option(
            "--planes FILE",
            "measuring planes, with the illuminance that is wished for: the lighting that comes "
            "closest to the painting and meets it (docs/photometry.md)",
            default="no requirements",
            theme="Lights",
        ),
    ] = None
    watts: Annotated[
        float | None,
        validation.number("W"),
        validation.Option(
            "--watts W",
            "largest power of all lamps together, whose emitters have watts in the lights file",
            default="no limit, or the limit of the planes file",
            theme="Lights",
        ),
    ] = None
    ignore_wishes: Annotated[
        bool,
        validation.Option(
            "--ignore-wishes",
            "only the painting counts: the report says what planes and power come to, and their "
            "wishes and limits do not bind",
            default="the answer meets them",
            theme="Lights",
        ),
    ] = False
    verify: Annotated[
        bool,
        validation.Option(
            "--no-verify",
            "do not render the relit scene",
            default="render it with at most the samples of the basis, and only a part of the film "
            "if they do not suffice for all of it",
            theme="Verification",
        ),
    ] = True
    verify_spp: Annotated[
        int | None,
        validation.whole(2, validation.MAX_SPP),
        validation.Option(
            "--verify-spp N",
            "samples per pixel of the verification, which then covers the whole film, however "
            "long it takes",
            theme="Verification",
        ),
    ] = None
    error_bars: Annotated[
        bool,
        validation.Option(
            "--no-error-bars",
            "do not estimate how far noise may move each light, which of thousands of lights "
            "takes minutes",
            default="estimate it",
            theme="Results",
        ),
    ] = True
    report: Annotated[
        bool,
        validation.Option(
            "--no-report",
            "write neither report.html nor comparison.png, only the numbers",
            default="write them",
            theme="Results",
        ),
    ] = True
    force: Annotated[
        bool,
        validation.Option(
            "--force",
            "replace results of another painting, and results changed by hand",
            default="refuse",
            theme="Results",
        ),
    ] = False
    command: Annotated[str, validation.a(str, "the text of a shell command")] = ""

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
        if self.observer is not None and not self.spectral:
            raise LightpaintError(
                f"observer is {self.observer!r}, and a camera sees spectra alone: also pass ",
                Hint("spectral", True),
            )
        if self.resolution is not None:
            from lightpaint.scene import check_resolution

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
    spectral: bool
    observer: str | None
    move_lights: bool
    animate: bool
    cd_per_unit: float | None
    planes: str | None
    watts: float | None
    ignore_wishes: bool
    verify: bool
    verify_spp: int | None
    error_bars: bool
    report: bool
    force: bool
    command: str
