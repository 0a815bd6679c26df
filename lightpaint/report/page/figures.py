"""The pictures of the report: the wipe, the maps, thumbnails. Pictures are data: URIs."""

import base64
import io
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from markupsafe import Markup
from PIL import Image

from lightpaint.arrays import Floats, largest
from lightpaint.colour import ViewTransform, encode_display, to_8_bit
from lightpaint.images import denoised, resampled
from lightpaint.images.formats import png_bytes
from lightpaint.lighting import Solution
from lightpaint.relit.verification import LIMIT, Verification
from lightpaint.report import answer_pictures
from lightpaint.report.page.html import html, piece
from lightpaint.report.phrases import spoken_percent
from lightpaint.threads import parallel_map

#: Ends of the importance map's legend, as `importance_picture` shows a mid grey.
UNCOUNTED_COLOR, COUNTED_COLOR = "#393939", "#e8d8a2"

#: Where a verification cannot tell, in display values: darker than no difference.
UNMEASURED = 0.22

#: Colours of a signed quantity from its lower to its upper end, for the legend.
SIGNED = [f"rgb({red} {green} {blue})" for red, green, blue in to_8_bit(answer_pictures.DIVERGING)]

#: A picture whose PNG is larger than this many bytes goes into the page as JPEG.
MAX_PNG_BYTES = 150_000

#: Lines of a picture in a row that tell how well they pack.
STRIP_LINES = 8

#: JPEG quality of noisy pictures, which take up most of the file.
RAW_QUALITY = 75

#: Width of the lights' pictures in the table, in pixels.
THUMBNAIL_WIDTH = 144
#: Pixels in a row that one of such a picture averages, from which on it is not denoised.
CLEAN_REDUCTION = 4


@dataclass(frozen=True)
class PagePicture:
    """A picture of the page, (h, w, 3) in 8 bits. alt: its content in words.

    raw: the same without denoising, if `pixels` were denoised.
    """

    name: str
    alt: str
    pixels: npt.NDArray[np.uint8]
    raw: npt.NDArray[np.uint8] | None = None

    @property
    def height(self) -> int:
        """Its height in pixels."""
        return len(self.pixels)

    @property
    def width(self) -> int:
        """Its width in pixels."""
        return int(self.pixels.shape[1])


def data_uri(
    image_8_bit: npt.NDArray[np.uint8], *, largest_png: int = MAX_PNG_BYTES, quality: int = 91
) -> str:
    """Return an (h, w, 3) picture as a data: URI: lossless while it is small, else a good JPEG."""
    data, kind = _small_png(image_8_bit, largest_png), "png"
    if data is None:
        buffer = io.BytesIO()
        Image.fromarray(image_8_bit).save(buffer, "JPEG", quality=quality, subsampling=0)
        data, kind = buffer.getvalue(), "jpeg"
    return f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}"


def _small_png(image_8_bit: npt.NDArray[np.uint8], largest: int) -> bytes | None:
    """Return a picture as a PNG of at most that many bytes; None if it is larger."""
    # Every fourth strip tells whether it will be too large.
    quarter = image_8_bit[np.arange(len(image_8_bit)) // STRIP_LINES % 4 == 0]
    if largest == 0 or len(png_bytes(quarter)) > 0.3 * largest:
        return None
    data = png_bytes(image_8_bit)
    return data if len(data) <= largest else None


def thumbnail(
    image: Floats, emitters_seen: npt.NDArray[np.bool_], *, is_clean: bool = False
) -> tuple[Floats, float]:
    """Return a small display-encoded picture of one light, and its exposure in stops.

    image: (h, w, 3) linear. The 98th percentile of its light, without visible emitters, becomes
    white. The picture is reduced in linear light. is_clean: whether to denoise the result.
    """
    width = image.shape[1]
    stops = exposure_of(image, emitters_seen)
    if width > THUMBNAIL_WIDTH:
        image = resized(image, THUMBNAIL_WIDTH / width)
    if is_clean:
        image = denoised(image)
    return encode_display(image, stops=stops), stops


def resized(image: Floats, factor: float) -> Floats:
    """Return an (h, w, 3) picture at `factor` of its size, box-filtered; no side is less than a
    pixel.
    """
    height, width = (max(1, round(side * factor)) for side in image.shape[:2])
    return resampled(image, (height, width))


def exposure_of(image: Floats, emitters_seen: npt.NDArray[np.bool_]) -> float:
    """Return the stops that make a light's 98th percentile white, without visible emitters."""
    bright = largest(image)
    brightest = bright[(bright > 0) & ~emitters_seen]
    brightest = brightest if brightest.size else bright[bright > 0]
    return float(np.round(-np.log2(np.percentile(brightest, 98)), 1)) if brightest.size else 0.0


def _raw_uri(look: PagePicture) -> str:
    if look.raw is None:
        return ""
    return data_uri(look.raw, largest_png=0, quality=RAW_QUALITY)


def wipe(looks: list[PagePicture]) -> Markup:
    """Return two of the looks over each other, with a movable border between them."""
    # The verification may be larger than the rest, which the page then enlarges.
    height, width = max(look.pixels.shape[:2] for look in looks)
    # The prediction first: it is the answer, and less noisy than the render that checks it.
    left, right = (
        next(k for k, x in enumerate(looks) if x.name == n) for n in ("painting", "answer")
    )
    return html(
        "wipe",
        looks=looks,
        sources=parallel_map(lambda look: data_uri(look.pixels), looks),
        raw_sources=parallel_map(_raw_uri, looks),
        width=width,
        height=height,
        left=left,
        right=right,
    )


def maps(
    solution: Solution,
    predicted: Floats,
    current: Floats,
    *,
    verification: Verification | None,
    transform: ViewTransform,
    missed: answer_pictures.Residual | None = None,
) -> Markup:
    """Return false-colour pictures: the error, the importance, and where the render disagrees.

    predicted: (h, w, 3) linear, as rendered; current: background of pixels that do not count.
    missed: the result of `residual_of`.
    """
    missed = missed or answer_pictures.residual_of(solution, predicted, transform=transform)
    picture = answer_pictures.residual_picture(
        missed, solution, current, transform=transform, finish=to_8_bit
    )
    figures = [
        figure(
            PagePicture("Residual", "False-colour map of the residual.", picture),
            f"Luminance, answer − painting, as rendered{missed.spoken}. Grey, dim pixels do "
            "not count.",
            signed_scale(missed.limit),
        ),
        _importance_map(solution.importance, current, transform=transform),
    ]
    if verification is not None:
        figures.append(_verification_map(verification))
    return Markup().join(figures)


def _importance_map(importance: Floats, current: Floats, *, transform: ViewTransform) -> Markup:
    """Return the figure of how much each pixel counts. importance: (h, w)."""
    picture = answer_pictures.importance_picture(
        importance, current, transform=transform, finish=to_8_bit
    )
    return figure(
        PagePicture("Importance", "Map of how much each pixel counts.", picture),
        f"How much each pixel counts: {importance.mean():.2g} on average, "
        f"{importance.max():.3g} at most.",
        scale([UNCOUNTED_COLOR, COUNTED_COLOR], "hatched: does not count", "yellow: counts fully"),
    )


def _verification_map(verification: Verification) -> Markup:
    """Return the figure of where the render disagrees with the answer."""
    picture, share = verification_picture(verification)
    unmeasured_text = (
        f" Dark grey, {spoken_percent(share)} of the picture: too few samples of the render found "
        "light there to tell."
        if share
        else ""
    )
    return figure(
        PagePicture("Verification", "False-colour map of z.", picture),
        "Answer − render in standard errors, mean of the channels. Noise alone looks like even "
        f"grain; an orange or blue shape in it is an error.{unmeasured_text}",
        scale(SIGNED, f"−{LIMIT:g} answer darker", "0", f"answer brighter +{LIMIT:g}"),
    )


def verification_picture(verification: Verification) -> tuple[npt.NDArray[np.uint8], float]:
    """Return the map of where a render disagrees, (h, w, 3), and the share that it cannot tell.

    What it cannot tell is grey, unless the render disagrees as a whole: then every difference is
    shown.
    """
    z = verification.z.mean(axis=-1, dtype=np.float64)
    colours, is_measured = answer_pictures.diverging(z / LIMIT), verification.is_measured
    if is_measured is None or not verification.agrees:
        return to_8_bit(colours), 0.0
    colours[~is_measured] = UNMEASURED
    return to_8_bit(colours), float(1 - is_measured.mean())


def figure(picture: PagePicture, caption: str, legend: Markup | str = "") -> Markup:
    """Return a map with its legend, from `scale`, and its caption."""
    return piece("figure", picture, data_uri(picture.pixels), caption, legend)


def signed_scale(limit: float) -> Markup:
    """Return the legend of errors that are too dark or too bright, up to `limit`."""
    return scale(SIGNED, f"−{limit:g} too dark", "0", f"too bright +{limit:g}")


def scale(colors: list[str], *ends: str) -> Markup:
    """Return the legend of a map: its colours from left to right, and their meaning in words."""
    return piece("scale", colors, ends)
