"""Something to paint on: the current look, as linear EXR and as a picture to look at."""

from pathlib import Path

from lightpaint.files import write_bytes
from lightpaint.images.bitmap import VIEW_KEY
from lightpaint.images.display import choose_exposure, png_bytes, to_8_bit
from lightpaint.images.exr import Floats, write_rgb
from lightpaint.images.view import View


def write_template(path: Path, image: Floats, *, view: View | None = None) -> Path:
    """Write a linear image (h, w, 3) to `path` and, through `view`, to a PNG beside it.

    Without a view it is shown as sRGB, at an exposure that shows something. The PNG says how;
    paint programs may drop that when they save, and `read_target` is then to be told. Returns
    the path of the PNG.
    """
    write_rgb(path, image)
    shown = view or View("srgb", choose_exposure(image))
    picture = path.with_suffix(".png")
    pixels = to_8_bit(shown.encode(image))
    write_bytes(picture, png_bytes(pixels, {VIEW_KEY: f"{shown.name} {shown.stops!r}"}))
    return picture
