"""A painter in a saved notebook, without a kernel: its last picture, and a mixer.

Where a notebook is not trusted, scripts are removed and the picture remains; elsewhere the mixer of
reports replaces it, in a frame of its own, so that neither its style nor the notebook's reaches the
other.
"""

from html import escape

import numpy as np

from lightpaint.basis.basis import Basis
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.colour.srgb import to_8_bit
from lightpaint.images.pixel_blocks import block_mean, fitting_factor
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.report.answer_pictures import target_picture
from lightpaint.report.page.figures import data_uri
from lightpaint.report.page.mixer import mixer_assets, mixer_html
from lightpaint.target.target import Target
from lightpaint.viewer.bundle import styles

#: Maximum number of pixels in all planes of the mixer: with their scripts these stay below 400 kB.
MAX_PLANE_PIXELS = 44_000

#: Maximum width of the picture in pixels, and of its PNG in bytes, beyond which it is a JPEG.
MAX_PICTURE_WIDTH, MAX_PICTURE_BYTES = 640, 20_000

#: Maximum heights on the screen, in pixels, of the frame and of the mix in it.
FRAME_HEIGHT, MIX_HEIGHT = 690, 320

#: The frame takes the height of its page; with a mixer in it, the picture above is superfluous.
FRAME_SCRIPT = """
const frame = window.frameElement
const fit = () => {
  const height = Math.ceil(document.body.getBoundingClientRect().height)
  frame.style.height = Math.min(height, HEIGHT) + 'px'
  if (document.querySelector('.mixer-mix')) frame.previousElementSibling.hidden = true
}
if (frame) new ResizeObserver(fit).observe(document.body)
"""


def static_view(
    basis: Basis, lighting: Lighting, target: Target | None, transform: ViewTransform
) -> str:
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
    page = _page(mixer, mix_width=max(1, MIX_HEIGHT * width // height))
    quoted = page.replace("&", "&amp;").replace("'", "&#39;")  # most quotes in it are double
    alt = f"{escape(basis.origin.sensor or 'The scene')}, as the painter showed it last"
    return (
        f'<div class="lightpaint-static"><img alt="{alt}" src="{source}" '
        f'style="display: block; width: 100%; max-width: {max(width, MIX_HEIGHT)}px">'
        f'<iframe title="Light mixer" loading="lazy" srcdoc=\'{quoted}\' '
        'style="display: block; width: 100%; height: 0; border: 0"></iframe></div>'
        "<style>.lightpaint-static > [hidden] { display: none !important }</style>"
    )


def _page(mixer: str, *, mix_width: int) -> str:
    """Return the page in the frame. mix_width: maximum width of the mix on the screen."""
    style = (
        "html { color-scheme: dark } * { box-sizing: border-box }"
        "body { margin: 0; padding: 14px 16px; border-radius: 6px; background: #262626;"
        "color: #ececec; font: 14px/1.5 system-ui, sans-serif }"
        "h2 { margin: 0 0 4px; font-size: 16px }"
        f".mixer > p {{ margin: 0 0 12px }} .mixer-stage {{ width: min(100%, {mix_width}px) }}"
        # Cells are narrower than reports; mix and lights still fit beside each other.
        "@media (min-width: 600px) { .mixer-view { display: block } .mixer-stage { position: "
        "relative } .mixer-wipe, .mixer-buttons { margin-top: 10px } .mixer-lights { max-height: "
        "520px } .mixer-body { grid-template-columns: minmax(0, 1.1fr) minmax(250px, 1fr) } }"
    )
    script = FRAME_SCRIPT.replace("HEIGHT", str(FRAME_HEIGHT))
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8"><title>Light mixer</title>'
        f"<style>{styles('viewer/mixer/wipe.css')}</style><body>{mixer}{mixer_assets()}"
        f"<style>{style}</style><script>{script}</script></body></html>"
    )
