"""Something to paint on: the current look, as linear EXR and as a picture to look at."""

from pathlib import Path

from lightpaint.images.display import choose_exposure, write_png
from lightpaint.images.exr import Floats, write_rgb


def write_template(path: Path, image: Floats) -> Path:
    """Write a linear image (h, w, 3) to `path` and, display-encoded, to a PNG beside it.

    Returns the path of the PNG.
    """
    write_rgb(path, image)
    picture = path.with_suffix(".png")
    write_png(picture, image, stops=choose_exposure(image))
    return picture
