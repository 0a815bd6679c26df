"""The pictures of a result as people see them: each denoised once, for all places that show it."""

from dataclasses import dataclass, field

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.images.denoiser import DENOISED_KEY, Features, denoised, how_denoised
from lightpaint.report.basis_memo import planes_of

#: More lights than this have their thumbnails as they are, which hundreds of them need not wait
#: for: a thumbnail is small, and averages much of its noise.
MOST_THUMBNAILS = 64


@dataclass(frozen=True)
class Encoder(ViewTransform):
    """A view transform that encodes each picture once, in however many places it is shown.

    kept: by the identity of a picture, itself and its display values. Pictures must not change.
    """

    kept: dict[int, tuple[Floats, Floats]] = field(default_factory=dict, compare=False, repr=False)

    def encode(self, image: Floats) -> Floats:
        """As of `ViewTransform`; not to be written to."""
        if id(image) not in self.kept:
            shown = super().encode(image)
            shown.flags.writeable = False
            self.kept[id(image)] = image, shown
        return self.kept[id(image)][1]


@dataclass(frozen=True)
class CleanLooks:
    """Current look, prediction and verification, (h, w, 3) linear.

    verified: None where there is none. texts: what a PNG of them says of itself; none where they
    are as they were rendered. encoders: what has encoded them.
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
        """Without their grain.

        weights: (n, 3), of which `predicted` is the sum. larger: of a verification that has another
        size than the basis.
        """
        features = basis.features
        if verified is not None:
            verified = denoised(verified, larger or features)
        raw = "predicted.exr" + ("" if verified is None else ", verified.exr")
        texts = how_denoised(features, raw=raw)
        if (planes := planes_of(basis)) is None:
            shown = denoised(basis.present_look, features), denoised(predicted, features)
        else:
            shown = planes.present, planes.mix(weights)
        return cls(*shown, verified, texts)

    @classmethod
    def raw(cls, basis: Basis, predicted: Floats, verified: Floats | None) -> "CleanLooks":
        """As they were rendered."""
        present = basis.present_look
        return cls(present, predicted, verified, {})

    def through(self, transform: ViewTransform) -> Encoder:
        """That view, which encodes what all these places show once."""
        return self.encoders.setdefault(transform, Encoder(transform.name, transform.stops))

    @property
    def is_clean(self) -> bool:
        """Whether they were denoised."""
        return bool(self.texts)

    @property
    def how(self) -> str:
        """By what they were denoised, for people."""
        return self.texts.get(DENOISED_KEY, "").partition(";")[0]
