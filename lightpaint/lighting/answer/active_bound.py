"""One thing that holds lights back, as data: what it is, and what it costs."""

from dataclasses import dataclass
from typing import Literal

#: What holds: that light is not negative; that a light is not adjusted; what was asked of it.
Kind = Literal["zero", "kept", "lock", "off", "left out", "tie", "limits", "colour"]

#: What a multiplier is per unit of.
Per = Literal["emission", "luminance", "dimmer"]

#: To which side of its whites a light would go; "" for neither.
Tint = Literal["", "greener", "pinker"]


@dataclass(frozen=True)
class Bound:
    """What holds back one light, or several on one dimmer.

    held_by: what was asked of the light, in few words (`LightSetting.constraint`); else its kind.
    gain: by how much the objective, all channels together, would fall if this alone were let
    go. A kept, locked, limited, coloured or tied light then may have any emission >= 0, a
    light that is left out what else is asked of it, and one at zero takes light away. Where
    there is a pull towards the present it stays, is no part of the objective, and may make
    the gain negative.
    multiplier: by how much the objective would change at first, per unit by which that which
    holds rose: >= 0 at a lower limit, as zero is one, and <= 0 at an upper one, as `off` is.
    Of three channels where it is per `emission`; one number per `luminance` of the emission; and
    per unit of its `dimmer`, 1 being the present, one for each tied light moved by itself, or
    one number for all.
    tint: where a range of white holds a light, the side of it to which the light would go.
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
        """Whether it is off because somebody, or a choice of few lights, wants it so."""
        return self.kind in ("off", "left out")
