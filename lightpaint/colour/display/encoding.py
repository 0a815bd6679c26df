"""The interface of encodings, which view transforms are made of."""

from typing import Protocol

from lightpaint.arrays import Floats


class Encoding(Protocol):
    """An encoding of linear Rec.709 as display values, without exposure. Arrays are (..., 3)."""

    @property
    def white(self) -> float:
        """Light of the grey that the display shows as white."""

    def encode(self, image: Floats) -> Floats:
        """Return linear light as display values in [0, 1]."""

    def decode(self, image_display: Floats) -> Floats:
        """Return display values in [0, 1] as linear light."""

    def encode_planes(self, planes: Floats) -> Floats:
        """Return `encode` of linear light with channels first, (3, p)."""

    def with_slopes(self, planes: Floats) -> tuple[Floats, Floats]:
        """Return display values (3, p) for linear light (3, p), and their derivatives.

        Derivatives are (3, 3, p), of display value i by linear channel j, and 0 where clipped. If
        channels do not mix, they are (3, p).
        """
