"""Views of OpenColorIO configurations, against OpenColorIO's own processors and our curves."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from transform_slopes import slopes_of

from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.colour.primaries import encode_display
from lightpaint.errors import ViewError

ocio: Any = pytest.importorskip("PyOpenColorIO", reason="OpenColorIO")

DISPLAY = "sRGB - Display"


@pytest.fixture(autouse=True)
def _built_in(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OCIO", raising=False)


def _colours(seed: int = 0) -> Any:
    rng = np.random.default_rng(seed)
    return (np.exp2(rng.uniform(-6, 0, (50, 1))) * rng.uniform(0.3, 1, (50, 3))).astype(np.float32)


def test_the_default_view_by_name():
    transform = ViewTransform.parse("ocio")
    assert transform.name.startswith(f"ocio:{DISPLAY}/")
    assert ViewTransform.parse(transform.name) == transform


def test_encoding_is_the_librarys_own():
    config = ocio.Config.CreateFromBuiltinConfig("ocio://default")
    name = config.getDefaultView(DISPLAY)
    view = ocio.DisplayViewTransform("Linear Rec.709 (sRGB)", DISPLAY, name)
    cpu = config.getProcessor(view).getDefaultCPUProcessor()
    colours = _colours()
    expected = [cpu.applyRGB((2 * c).tolist()) for c in colours]
    actual = ViewTransform(f"ocio:{DISPLAY}/{name}", 1.0).encode(colours)
    # Pixel by pixel and many at once, the library rounds in another order.
    np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-5)


def test_the_plain_view_of_srgb_is_srgb():
    transform = ViewTransform(f"ocio:{DISPLAY}/Un-tone-mapped")
    colours = _colours()
    # By way of XYZ with matrices of some seven digits.
    np.testing.assert_allclose(transform.encode(colours), encode_display(colours), atol=2e-5)
    np.testing.assert_allclose(
        transform.decode(transform.encode(colours)), colours, rtol=1e-3, atol=1e-6
    )
    assert transform.white == pytest.approx(1, abs=1e-3)
    np.testing.assert_allclose(
        slopes_of(transform, colours), slopes_of(ViewTransform(), colours), rtol=2e-2, atol=2e-2
    )


def test_a_tone_mapped_view_has_a_way_back():
    transform = ViewTransform.parse("ocio")
    colours = _colours()
    # ACES 2.0's inverse is numerical in part.
    np.testing.assert_allclose(
        transform.decode(transform.encode(colours)), colours, rtol=2e-2, atol=1e-4
    )
    assert transform.white > 10


def _own(path: Path, transform: Any) -> None:
    """A configuration with one view, Film of Screen, made by `transform` from linear Rec.709."""
    config = ocio.Config()
    config.setMajorVersion(2)
    config.addColorSpace(ocio.ColorSpace(name="lin_rec709"))
    own_space = ocio.ColorSpace(name="Shown")
    own_space.setTransform(transform, ocio.COLORSPACE_DIR_FROM_REFERENCE)
    config.addColorSpace(own_space)
    config.setRole("scene_linear", "lin_rec709")
    config.setRole("default", "lin_rec709")
    config.addDisplayView("Screen", "Film/dark", "Shown")
    path.write_text(config.serialize())


def test_a_configuration_of_ones_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    _own(tmp_path / "own.ocio", ocio.ExponentTransform([2.0, 2.0, 2.0, 1.0]))
    monkeypatch.setenv("OCIO", str(tmp_path / "own.ocio"))
    transform = ViewTransform.parse("ocio")
    assert transform.name == "ocio:Screen/Film/dark"
    # The library's fast powers are good to five digits.
    np.testing.assert_allclose(transform.encode(np.full((1, 3), 0.5)), 0.25, atol=1e-5)
    np.testing.assert_allclose(transform.decode(np.full((1, 3), 0.25)), 0.5, atol=1e-5)


def test_a_view_without_a_way_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    flat = ocio.MatrixTransform([0.0] * 16, [0.5, 0.5, 0.5, 1.0])
    _own(tmp_path / "own.ocio", flat)
    monkeypatch.setenv("OCIO", str(tmp_path / "own.ocio"))
    with pytest.raises(ViewError, match=r"ocio:Screen/Film/dark cannot be inverted"):
        ViewTransform.parse("ocio")


def test_a_view_that_forgets_greys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    clipped = ocio.RangeTransform(0.4, 0.6, 0.4, 0.6)
    _own(tmp_path / "own.ocio", clipped)
    monkeypatch.setenv("OCIO", str(tmp_path / "own.ocio"))
    with pytest.raises(ViewError, match=r"cannot be inverted: a grey comes back 0\.35 off"):
        ViewTransform.parse("ocio")


def test_what_is_there_is_named():
    with pytest.raises(ViewError, match=rf"no view ocio:Cinema/Film: .*{DISPLAY}"):
        ViewTransform("ocio:Cinema/Film")
    with pytest.raises(ViewError, match=r"has no view 'Film': it has .*Un-tone-mapped"):
        ViewTransform(f"ocio:{DISPLAY}/Film")


@pytest.mark.parametrize("content", [None, "", "ocio_profile_version: 2\nroles: [", "\0\1\2"])
def test_no_configuration(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: str | None):
    if content is not None:
        (tmp_path / "own.ocio").write_text(content)
    monkeypatch.setenv("OCIO", str(tmp_path / "own.ocio"))
    with pytest.raises(ViewError, match=r"own\.ocio is not an OpenColorIO configuration"):
        ViewTransform.parse("ocio")


def test_without_the_extra(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "PyOpenColorIO", None)
    with pytest.raises(ViewError, match=r"pip install 'lightpaint\[ocio\]'"):
        ViewTransform.parse("ocio")
