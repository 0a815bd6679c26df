"""A painter in a saved notebook, without a kernel: its last picture, and a mixer.

Where a notebook is not trusted, scripts are removed and the picture remains; elsewhere the mixer of
reports replaces it, in a frame of its own, so that neither its style nor the notebook's reaches the
other.
"""

import numpy as np
from markupsafe import Markup

from lightpaint.basis.basis import Basis
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.colour.srgb import to_8_bit
from lightpaint.images.pixel_blocks import block_mean, fitting_factor
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.report.answer_pictures import target_picture
from lightpaint.report.page.figures import data_uri
from lightpaint.report.page.html import html
from lightpaint.report.page.mixer import mixer_assets, mixer_html
from lightpaint.target.target import Target
from lightpaint.viewer.bundle import styles

#: Maximum number of pixels in all planes of the mixer: with their scripts these stay below 400 kB.
MAX_PLANE_PIXELS = 44_000

#: Maximum width of the picture in pixels, and of its PNG in bytes, beyond which it is a JPEG.
MAX_PICTURE_WIDTH, MAX_PICTURE_BYTES = 640, 20_000

#: Maximum heights on the screen, in pixels, of the frame and of the mix in it.
FRAME_HEIGHT, MIX_HEIGHT = 690, 320


def static_view(
    basis: Basis, lighting: Lighting, target: Target | None, transform: ViewTransform
) -> Markup:
    """Return a view under a lighting as HTML: a picture, and a mixer that starts from it.

    target: the painting, for the wipe of the mixer; None if nothing is painted.
    """
    light = basis.mix(lighting.weights_for(basis))
    factor = fitting_factor(basis.size, -(-basis.size[1] // MAX_PICTURE_WIDTH))
    pixels = to_8_bit(np.clip(transform.encode(block_mean(light, factor)), 0, 1))
    source = data_uri(pixels, largest_png=MAX_PICTURE_BYTES, quality=85)
    painting = None
    if target is not None:
        painting = target_picture(target, basis.current_look, transform=transform)
    mixer = mixer_html(basis, lighting, painting, transform=transform, max_pixels=MAX_PLANE_PIXELS)
    height, width = basis.size
    page = html(
        "paint/notebook/static_page",
        mixer=mixer,
        assets=mixer_assets(),
        wipe_style=Markup(styles("viewer/mixer/wipe.css")),
        mix_width=max(1, MIX_HEIGHT * width // height),
        frame_height=FRAME_HEIGHT,
    )
    return html(
        "paint/notebook/static_view",
        name=basis.origin.sensor or "The scene",
        source=source,
        width=max(width, MIX_HEIGHT),
        # Most quotes in it are double.
        page=Markup(page.replace("&", "&amp;").replace("'", "&#39;")),
    )
