"""What it is to be close to a painting, and how the closest lighting is found."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Literal, TypeVar

from lightpaint.colour.display.exposure import choose_exposure
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import LightpaintError, TargetError
from lightpaint.keywords import keywords
from lightpaint.lighting.algebra.optimum import Method
from lightpaint.target.target import Target
from lightpaint.validation import SWITCH, Check, a, check_fields, number, one_of

#: What is compared with the painting: light, or what a display shows of it.
Space = Literal["linear", "display"]

#: Which colours lamps may take: any; those they have unless the painting clearly asks for others;
#: whites only.
Colors = Literal["free", "gentle", "white"]

#: Weight of all that is not painted beside all that is, where it was painted over the current look:
#: benchmarks/intent.py has what others do.
HOLD = 3.0

F = TypeVar("F", bound="Fit")

#: Whether pixels count in which the camera sees an emitter: where somebody said what was painted
#: (by alpha, mask or template), wherever they are painted, or never.
Emitters = Literal["auto", "count", "skip"]


@keywords()
@dataclass(frozen=True)
class Fit:
    """How close is measured, and how the closest is found.

    What is None follows from how the target was painted. Over the current look: the rest is held to
    it, and lamps keep their colour. Through a view of a display: lamps keep their colour, and the
    two are compared as the display shows them. A float EXR with a mask of its own and nothing under
    it is taken at its word: light, each channel for itself.

    Attributes:
        space: `linear`, or `display` to come closest in what a display shows.
        hold: Weight of all that is not painted, against the current look, beside that of all that
            is. 0 lets it go.
        colors: `free`; `gentle`, to leave a lamp's present colour only as far as the painting gains
            by it, and for no colour but whites and what is painted; `white`, on Planck's locus
            between 2200 and 9000 K.
        unpainted: Instead of `hold`, the weight of each pixel that is not painted.
        literal: Whether every target is taken at its word, but for what is said here.
        method: `polished`, to a certified optimum, or `gauss-seidel`, the paper's iteration alone,
            which may run out of sweeps; the certificate of the answer then says that it has not
            converged.
        transform: The view transform through which the two are compared in `display`; None for that
            of the painting or, where it holds light, sRGB at an exposure that shows something.
        emitters: Whether pixels in which the camera sees an emitter count: `auto`, where somebody
            said what was painted; `count`, always, which holds the emitters themselves to how
            bright they are painted; `skip`, never.

    Raises:
        LightpaintError: For a value that means nothing.

    Examples:
        >>> lp.Fit(hold=0.5, colors="white").hold
        0.5
    """

    space: Space | None = None
    hold: float | None = None
    colors: Colors | None = None
    unpainted: float = 0.0
    literal: bool = False
    method: Method = "polished"
    transform: ViewTransform | None = None
    emitters: Emitters = "auto"

    expected: ClassVar[Mapping[str, Check]] = {
        "space": one_of(Space),
        "hold": number("a weight", may_be_zero=True),
        "colors": one_of(Colors),
        "unpainted": number("a weight", may_be_zero=True),
        "literal": SWITCH,
        "method": one_of(Method),
        "transform": a(ViewTransform, "a ViewTransform, like ViewTransform('agx', 1.0)"),
        "emitters": one_of(Emitters),
    }

    @property
    def brightness(self) -> float:
        """By how much the view transform brightens the squares of light."""
        return 1.0 if self.transform is None else float(4.0**self.transform.stops)

    def __post_init__(self) -> None:
        check_fields(self, self.expected)
        if self.unpainted and self.hold:
            raise LightpaintError(
                f"unpainted is {self.unpainted:g} and hold {self.hold:g}: expected one of them, "
                "the weight of each pixel or that of all together"
            )


def meant_by(fit: F, targets: Sequence[Target]) -> F:
    """`fit` with all that it leaves open decided, as `targets` were painted.

    Raises TargetError if they were seen through different transforms, and it does not say which
    counts.
    """
    return resolve_fit(
        fit,
        over_look=any(target.over_look for target in targets),
        through_view=any(target.through_view for target in targets),
        display=lambda: _display_of(targets),
    )


def resolve_fit(
    fit: F,
    *,
    over_look: bool = False,
    through_view: bool = False,
    display: Callable[[], ViewTransform] = ViewTransform,
) -> F:
    """Return `fit` with all that it leaves open decided, by how something is painted.

    over_look: over the current look. through_view: through a view of a display. display: the view
    transform, asked for where it matters.
    """
    over_look = over_look and not fit.literal
    on_display = through_view and not fit.literal
    is_seen = on_display or (fit.transform is not None and not fit.literal)
    space: Space = fit.space or ("display" if is_seen else "linear")
    return replace(
        fit,
        space=space,
        hold=fit.hold if fit.hold is not None else HOLD * (over_look and not fit.unpainted),
        colors=fit.colors or ("gentle" if over_look or on_display else "free"),
        transform=None if space == "linear" else fit.transform or display(),
    )


def _display_of(targets: Sequence[Target]) -> ViewTransform:
    """The one view that all were painted through."""
    seen = {target.transform for target in targets if target.transform is not None}
    if len(seen) > 1:
        told = " and ".join(sorted(f"{x.name} at {x.stops:+g} stops" for x in seen))
        raise TargetError(
            f"the paintings were seen through {told}: say with transform=... which of them is to "
            "be fitted"
        )
    return next(iter(seen), None) or ViewTransform("srgb", choose_exposure(targets[0].image))
