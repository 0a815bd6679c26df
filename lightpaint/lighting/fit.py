"""Options of a fit: the measure of closeness, and the method that finds the closest lighting."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Literal, TypeVar

from lightpaint.colour import ViewTransform
from lightpaint.errors import LightpaintError, TargetError
from lightpaint.keywords import keywords
from lightpaint.lighting.algebra import Method
from lightpaint.sentences import Hint
from lightpaint.validation import Option, a, check_fields, number

if TYPE_CHECKING:
    from lightpaint.target import Target

#: The space of the comparison with the painting: light, or display values.
Space = Literal["linear", "display"]

#: The colours that lamps may take: any; their own unless the painting clearly needs others; whites;
#: their own.
Colors = Literal["free", "gentle", "white", "own"]

#: Weight of all unpainted pixels relative to all painted ones, for a painting over the current
#: look: benchmarks/intent.py compares other values.
DEFAULT_HOLD = 4.0

F = TypeVar("F", bound="Fit")

#: Whether pixels with a visible emitter count: if alpha, mask or template mark them as painted,
#: wherever they are painted, or never.
Emitters = Literal["auto", "count", "skip"]

_TRANSFORM = a(ViewTransform, "a ViewTransform, like ViewTransform('agx', 1.0)")


@keywords()
@dataclass(frozen=True)
class Fit:
    """Options of a fit: the measure of closeness, and the method that finds the closest lighting.

    None is resolved by how the target was painted. Over the current look: the fit holds the rest to
    it, and lamps keep their colour. Through a view of a display: lamps keep their colour, and the
    fit compares display values. A float EXR with its own mask and nothing under it is fitted
    literally, as light, each channel separately.

    Attributes:
        space: `linear`, or `display` to come closest in display values.
        hold: Total weight of unpainted pixels, which are held to the current look, relative to the
            weight of painted ones. 0 releases them.
        colors: `free`, in display values within the hues that are white, painted or the lamps' own;
            `gentle`, to change a lamp's colour only as far as another is painted where it shines,
            and only to whites and painted colours; `white`, on Planck's locus between 2200 and
            9000 K; `own`, to dim lamps and leave each the colour it has.
        unpainted: Instead of `hold`, the weight of each unpainted pixel.
        literal: Whether every target is fitted literally, except for options set here.
        method: `polished`, to a certified optimum, or `gauss-seidel`, the paper's iteration alone,
            which may run out of sweeps; the certificate of the answer then says that it has not
            converged.
        transform: The view transform of a comparison in `display`; None for the transform of the
            painting or, if it holds light, sRGB at a fitting exposure.
        emitters: Whether pixels with a visible emitter count: `auto`, if alpha, mask or template
            mark them as painted; `count`, always, which holds the emitters themselves to their
            painted brightness; `skip`, never.

    Raises:
        LightpaintError: For an invalid value.

    Examples:
        >>> lp.Fit(hold=0.5, colors="white").hold
        0.5
    """

    space: Annotated[
        Space | None,
        Option(
            "--space",
            "compare linear light, or display values through --view, as the eye sees them",
            default="display for paintings through a view, of 8 or 16 bits, else linear",
            theme="What the painting means",
        ),
    ] = None
    hold: Annotated[
        float | None,
        number(about="a weight", may_be_zero=True),
        Option(
            "--hold H",
            "how strongly unpainted pixels keep the current look: the weight of all of them, "
            "relative to all painted ones; 0 ignores them",
            default="4 if the current look was painted over, else 0",
            theme="What the painting means",
        ),
    ] = None
    colors: Annotated[
        Colors | None,
        Option(
            "--colors",
            "colours that lights may take. free: any; gentle: their current ones, unless the "
            "painting needs others; white: 2200 to 9000 K; own: their current ones, so that lights "
            "only dim",
            default="gentle if the current look was painted over, or painted through a view, else "
            "free",
            theme="What the painting means",
        ),
    ] = None
    unpainted: Annotated[
        float,
        number(about="a weight", may_be_zero=True),
        Option(
            "--unpainted W",
            "weight of each unpainted pixel, instead of --hold",
            default="%(default)s",
            theme="What the painting means",
        ),
    ] = 0.0
    literal: Annotated[
        bool,
        Option(
            "--literal",
            "fit the painting exactly as it is, as in the paper: linear light, no hold, any "
            "colour and no noise correction, unless other options set these",
            theme="What the painting means",
        ),
    ] = False
    method: Annotated[
        Method,
        Option(
            "--method",
            "gauss-seidel: only the iteration of the paper, which converges slowly; if it stops "
            "before the optimum, it says so",
            default="%(default)s",
            theme="What the painting means",
        ),
    ] = "polished"
    transform: Annotated[ViewTransform | None, _TRANSFORM] = None
    emitters: Annotated[
        Emitters,
        Option(
            "--emitters",
            "whether painted pixels that show an emitter count. auto: only if alpha, mask or "
            "template mark them as painted; count: always, which fits emitters to their painted "
            "brightness; skip: never",
            default="%(default)s",
            theme="What the painting means",
        ),
    ] = "auto"

    def reads_wishes(self, *, is_sketch: bool) -> bool:
        """Return whether wishes have contrasts, and the paint says which colours it means.

        is_sketch: whether it was painted over the current look or through a view of a display, and
        not given as light. The fit is resolved.
        """
        return not self.literal and (is_sketch or self.colors == "gentle")

    def keeps_to_hues(self, *, is_sketch: bool) -> bool:
        """Return whether lights take no colours but whites, their own and painted ones.

        As a display shows it, a lamp that makes up for others with a colour that nobody painted
        stands out as such. is_sketch: as for `reads_wishes`.
        """
        is_shown = is_sketch and self.transform is not None and not self.literal
        return self.colors == "gentle" or (self.colors == "free" and is_shown)

    @property
    def brightness(self) -> float:
        """The factor by which the view transform brightens squares of light."""
        return 1.0 if self.transform is None else float(4.0**self.transform.stops)

    def __post_init__(self) -> None:
        check_fields(self)
        if self.unpainted and self.hold:
            raise LightpaintError(
                f"unpainted is {self.unpainted:g} and hold {self.hold:g}: expected one of them, "
                "the weight of each pixel or the weight of all together"
            )


def resolve_for_targets(fit: F, targets: "Sequence[Target]") -> F:
    """Resolve all open options of `fit` by the way `targets` were painted.

    Raises TargetError if they were painted through different transforms, and `fit` chooses none.
    """
    return resolve_fit(
        fit,
        over_look=any(target.over_look for target in targets),
        through_view=any(target.through_view for target in targets),
        display=lambda: _common_transform(targets),
    )


def resolve_fit(
    fit: F,
    *,
    over_look: bool = False,
    through_view: bool = False,
    display: Callable[[], ViewTransform] = ViewTransform,
) -> F:
    """Resolve all open options of `fit` by the way of painting.

    over_look: over the current look. through_view: through a view of a display. display: returns
    the view transform; called if it matters.
    """
    over_look = over_look and not fit.literal
    on_display = through_view and not fit.literal
    is_displayed = on_display or (fit.transform is not None and not fit.literal)
    space: Space = fit.space or ("display" if is_displayed else "linear")
    return replace(
        fit,
        space=space,
        hold=fit.hold if fit.hold is not None else DEFAULT_HOLD * (over_look and not fit.unpainted),
        colors=fit.colors or ("gentle" if over_look or on_display else "free"),
        transform=None if space == "linear" else fit.transform or display(),
    )


def _common_transform(targets: "Sequence[Target]") -> ViewTransform:
    """Return the one view that all targets were painted through."""
    from lightpaint.colour import choose_exposure

    transforms = {target.transform for target in targets if target.transform is not None}
    if len(transforms) > 1:
        names = " and ".join(sorted(f"{x.name} at {x.stops:+g} stops" for x in transforms))
        raise TargetError(
            f"the paintings were painted through {names}: choose one of them with ",
            Hint("transform"),
        )
    return next(iter(transforms), None) or ViewTransform("srgb", choose_exposure(targets[0].image))
