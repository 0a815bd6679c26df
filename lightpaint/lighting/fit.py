"""What it is to be close to a painting, and how the closest lighting is found."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

from lightpaint.colour.transform import ViewTransform
from lightpaint.expected import Check, a, check_fields, number, one_of
from lightpaint.lighting.algebra.optimum import Method

#: Whether pixels count in which the camera sees an emitter: where somebody said what was painted
#: (by alpha, mask or template), wherever they are painted, or never.
Emitters = Literal["auto", "count", "skip"]


@dataclass(frozen=True)
class Fit:
    """How close is measured, and how the closest is found.

    Attributes:
        unpainted: Weight of what is not painted, against the current look.
        method: `polished`, to a certified optimum, or `gauss-seidel`, the paper's iteration alone,
            which may run out of sweeps; the certificate of the answer then says that it has not
            converged.
        transform: The view transform through which the two are compared; None for linear light.
        emitters: Whether pixels in which the camera sees an emitter count: `auto`, where somebody
            said what was painted; `count`, always, which holds the emitters themselves to how
            bright they are painted; `skip`, never.

    Raises:
        LightpaintError: For a value that means nothing.

    Examples:
        >>> lp.Fit(unpainted=0.1)
        Fit(unpainted=0.1, method='polished', transform=None, emitters='auto')
    """

    unpainted: float = 0.0
    method: Method = "polished"
    transform: ViewTransform | None = None
    emitters: Emitters = "auto"

    expected: ClassVar[Mapping[str, Check]] = {
        "unpainted": number("a weight", may_be_zero=True),
        "method": one_of(Method),
        "transform": a(ViewTransform, "a ViewTransform, like ViewTransform('agx', 1.0)"),
        "emitters": one_of(Emitters),
    }

    def __post_init__(self) -> None:
        check_fields(self, self.expected)
