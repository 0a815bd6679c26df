"""Pictures that were painted over a look without a template are known as such."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lightpaint.colour.display.view_transform import TransformChoice, ViewTransform
from lightpaint.images.formats.exr import write_rgb
from lightpaint.images.picture import read_picture
from lightpaint.target.target_reader import read_over_look, view_of_look

OPEN = TransformChoice()


def look(seed: int = 0) -> np.ndarray:
    """Return a picture of soft colours, with black beside it and a lamp in it."""
    rng = np.random.default_rng(seed)
    rough = rng.lognormal(-1.5, 0.7, (12, 16, 3)).astype(np.float32)
    image = np.kron(rough, np.ones((6, 6, 1), np.float32))
    image[:, :20] = 0
    image[30:36, 60:66] = 20
    return image


def saved(path: Path, image: np.ndarray, view: ViewTransform, **options: object) -> Path:
    """Return the path of the picture as a program shows it, in 8 bits."""
    Image.fromarray(np.round(255 * view.encode(image)).astype(np.uint8)).save(path, **options)
    return path


def painted(image: np.ndarray) -> np.ndarray:
    """Return it with a warm stroke over two fifths of what is lit."""
    stroke = image.copy()
    stroke[40:] *= (3, 2, 1)
    return stroke


@pytest.mark.parametrize("name", ["srgb", "filmic", "agx"])
@pytest.mark.parametrize("stops", [0.0, -1.5, 0.37])
def test_view_and_exposure_are_found(tmp_path: Path, name: str, stops: float):
    view = ViewTransform(name, stops)
    path = saved(tmp_path / "a.png", painted(look()), view)
    assert view_of_look(path, read_picture(path), look(), OPEN) == view


@pytest.mark.parametrize("ending", ["png", "jpg", "tif"])
def test_only_what_was_painted_counts(tmp_path: Path, ending: str):
    path = saved(
        tmp_path / f"a.{ending}", painted(look()), ViewTransform("filmic", 1.0), quality=95
    )
    target = read_over_look(path, look(), "the look of a shot", layer=None, transform=OPEN)
    assert target is not None
    assert (target.over_look, target.through_view, target.everything) == (True, True, False)
    assert target.transform == ViewTransform("filmic", 1.0)
    # A JPEG's blocks bleed.
    assert not target.importance[:32].any()
    assert target.importance[48:, 28:].mean() > 0.9
    assert target.notes[-1].endswith(
        "what differs from the look of a shot through filmic at +1.0 stops"
    )


def test_light_is_compared_as_light(tmp_path: Path):
    write_rgb(tmp_path / "a.exr", painted(look()))
    target = read_over_look(tmp_path / "a.exr", look(), "it", layer=None, transform=OPEN)
    assert target is not None
    assert (target.over_look, target.through_view, target.transform) == (True, False, None)
    assert not target.importance[:40].any()


def test_what_is_asked_holds(tmp_path: Path):
    path = saved(tmp_path / "a.png", painted(look()), ViewTransform("agx", 1.0))
    picture = read_picture(path)
    assert view_of_look(path, picture, look(), TransformChoice("srgb")) is None
    assert view_of_look(path, picture, look(), TransformChoice("agx", 0.0)) is None
    assert view_of_look(path, picture, look(), TransformChoice("agx")) == ViewTransform("agx", 1.0)
    assert view_of_look(path, picture, look(), TransformChoice(stops=1.0)) == ViewTransform(
        "agx", 1.0
    )


def test_another_picture_is_not_taken_for_it(tmp_path: Path):
    """Black that both have says nothing, nor does one that has another size."""
    path = saved(tmp_path / "a.png", look(seed=1), ViewTransform())
    assert view_of_look(path, read_picture(path), look(), OPEN) is None
    assert view_of_look(path, read_picture(path), np.zeros_like(look()), OPEN) is None
    assert view_of_look(path, read_picture(path), look()[:-1], OPEN) is None


def test_the_look_itself_was_not_painted(tmp_path: Path):
    path = saved(tmp_path / "a.png", look(), ViewTransform())
    assert read_over_look(path, look(), "it", layer=None, transform=OPEN) is None
