"""A bound that holds lights back, as data: its kind, and its cost."""

from dataclasses import dataclass
from typing import Literal

#: Kinds of bounds: light is not negative; a light is not adjusted; constraints.
Kind = Literal["zero", "kept", "lock", "off", "left out", "tie", "limits", "colour"]

#: The unit of a multiplier.
Per = Literal["emission", "luminance", "dimmer"]

#: The side of its whites to which a light would go; "" for neither.
Tint = Literal["", "greener", "pinker"]


@dataclass(frozen=True)
class Bound:
    """A bound that holds back one light, or several on one dimmer.

    held_by: the constraint in few words (`LightSetting.constraint`); else the kind.
    gain: decrease of the objective, all channels together, if only this bound were released. A
    fixed, locked, limited, coloured or tied light may then have any emission >= 0, an unselected
    light any that its constraints allow, and a light at zero negative emission. A pull towards the
    current lighting stays; it is not part of the objective, so the gain may be negative.
    multiplier: derivative of the objective by the bound: >= 0 at a lower limit, such as zero, and
    <= 0 at an upper one, such as `off`. Three channels per `emission`; one number per `luminance`
    of the emission; per unit of a `dimmer`, 1 being the current level, one number for each tied
    light moved separately, or one for all.
    tint: the side of its range of white to which the light would go.
    """

    lights: tuple[str, ...]
    kind: Kind
    held_by: str
    gain: float
    multiplier: tuple[float, ...]
    per: Per
    tint: Tint = ""

    @property
    def is_switched_off(self) -> bool:
        """True if the user, or a choice of few lights, switched the light off."""
        return self.kind in ("off", "left out")
