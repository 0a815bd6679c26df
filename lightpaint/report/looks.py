"""The pictures of a result as people see them: each denoised once, for all places that show it."""

from dataclasses import dataclass

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.images.denoise import DENOISED_KEY, Features, denoised, how_denoised

#: More lights than this have their thumbnails as they are, which hundreds of them need not wait
#: for: a thumbnail is small, and averages much of its noise.
MOST_THUMBNAILS = 64


@dataclass(frozen=True)
class Looks:
    """Current look, prediction and verification, (h, w, 3) linear.

    verified: None where there is none. texts: what a PNG of them says of itself; none where they
    are as they were rendered.
    """

    current: Floats
    predicted: Floats
    verified: Floats | None
    texts: dict[str, str]

    @classmethod
    def clean(
        cls,
        basis: Basis,
        predicted: Floats,
        verified: Floats | None,
        *,
        larger: Features | None = None,
    ) -> "Looks":
        """Without their grain. larger: of a verification that has another size than the basis."""
        present = basis.present_look
        features = basis.features
        if verified is not None:
            verified = denoised(verified, larger or features)
        raw = "predicted.exr" + ("" if verified is None else ", verified.exr")
        texts = how_denoised(features, raw=raw)
        return cls(denoised(present, features), denoised(predicted, features), verified, texts)

    @classmethod
    def raw(cls, basis: Basis, predicted: Floats, verified: Floats | None) -> "Looks":
        """As they were rendered."""
        present = basis.present_look
        return cls(present, predicted, verified, {})

    @property
    def is_clean(self) -> bool:
        """Whether they were denoised."""
        return bool(self.texts)

    @property
    def how(self) -> str:
        """By what they were denoised, for people."""
        return self.texts.get(DENOISED_KEY, "").partition(";")[0]
