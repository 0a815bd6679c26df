"""The pictures of a result, each denoised once for all places that show it."""

from dataclasses import dataclass, field

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.denoised_mixes import (
    denoise_current_look,
    denoise_mix,
    denoise_mixes,
)
from lightpaint.colour import ViewTransform
from lightpaint.images import (
    DENOISED_KEY,
    LARGE_PICTURE,
    Features,
    by_bands,
    denoised,
    denoiser_text,
)
from lightpaint.report.basis_memo import cached_clean_planes


@dataclass(frozen=True)
class Encoder(ViewTransform):
    """A view transform that encodes each picture once, wherever it is shown.

    encoded: pictures and their display values, by the identity of the picture, which must not
    change.
    """

    encoded: dict[int, tuple[Floats, Floats]] = field(
        default_factory=dict, compare=False, repr=False
    )

    def encode(self, image: Floats) -> Floats:
        """Return the display values of `ViewTransform.encode`, read-only."""
        if image.size >= 3 * LARGE_PICTURE:  # which would be kept as long as the report is made
            return np.asarray(by_bands(super().encode, image))
        if isinstance(image.base, np.ndarray) and image.base.size > image.size:
            return super().encode(image)  # a band of a large picture
        if id(image) not in self.encoded:
            shown = super().encode(image)
            shown.flags.writeable = False
            self.encoded[id(image)] = image, shown
        return self.encoded[id(image)][1]


@dataclass(frozen=True)
class CleanLooks:
    """Current look, prediction and verification, (h, w, 3) linear.

    verified: None without one. texts: texts for a PNG of them; none for raw renders. encoders:
    by transform.
    """

    current: Floats
    predicted: Floats
    verified: Floats | None
    texts: dict[str, str]
    encoders: dict[ViewTransform, Encoder] = field(default_factory=dict, compare=False, repr=False)

    @classmethod
    def clean(
        cls,
        basis: Basis,
        weights: Doubles,
        predicted: Floats,
        verified: Floats | None,
        *,
        larger: Features | None = None,
    ) -> "CleanLooks":
        """Make the looks without their grain.

        weights: (n, 3), of which `predicted` is the sum. larger: of a verification that has another
        size than the basis.
        """
        features = basis.features
        if verified is not None:
            verified = denoised(verified, larger or features)
        raw = "predicted.exr" + ("" if verified is None else ", verified.exr")
        texts = denoiser_text(features, raw=raw)
        planes = cached_clean_planes(basis)
        if planes is None and basis.former is None:
            looks = [basis.current_look, predicted]
            now, answer = denoise_mixes(basis, [basis.current_weights, weights], mixed=looks)
            return cls(now, answer, verified, texts)
        if planes is None or basis.former is not None:
            now = denoise_current_look(basis)
        else:
            now = planes.current
        if planes is None or not planes.is_whole:
            answer = denoise_mix(basis, weights, mixed=predicted)
        else:
            answer = planes.mix(weights)
        return cls(now, answer, verified, texts)

    @classmethod
    def raw(cls, basis: Basis, predicted: Floats, verified: Floats | None) -> "CleanLooks":
        """Make the looks as rendered."""
        current = basis.current_look
        return cls(current, predicted, verified, {})

    def encoder(self, transform: ViewTransform) -> Encoder:
        """Return the encoder of a transform, which encodes each look once for all places."""
        return self.encoders.setdefault(transform, Encoder(transform.name, transform.stops))

    @property
    def is_clean(self) -> bool:
        """True if they were denoised."""
        return bool(self.texts)

    @property
    def denoiser(self) -> str:
        """Name of the denoiser, for people."""
        return self.texts.get(DENOISED_KEY, "").partition(";")[0]
