"""Cameras as observers: their input transforms, against colour-science, and files of them."""

from pathlib import Path

import numpy as np
import pytest

from lightpaint.colour.color import ciede2000, lab
from lightpaint.colour.primaries import REC709, colour_science, rgb_to_xyz
from lightpaint.colour.spectrum import (
    EYE,
    WAVELENGTHS,
    named_spectrum,
    read_observer,
    rgb_of_powers,
    spectrum_of,
)
from lightpaint.errors import ColorError

WAVES = WAVELENGTHS.astype(np.float64)
D65 = np.array(spectrum_of(*named_spectrum("D65", Path())))


def _nikon():
    return colour_science().MSDS_CAMERA_SENSITIVITIES["Nikon 5100 (NPL)"].copy()


def _write(path: Path, waves: np.ndarray, curves: np.ndarray) -> Path:
    np.savetxt(path, np.column_stack([waves, curves]), delimiter=",", header="nm,R,G,B")
    return path


def _read(folder: Path, curves: np.ndarray | None = None, waves: np.ndarray | None = None):
    camera = _nikon()
    values = camera.values if curves is None else curves
    wavelengths = camera.wavelengths if waves is None else waves
    return read_observer(_write(folder / "d.csv", wavelengths, values))


def test_the_eye_sees_rec709():
    spectrum = np.exp(-0.5 * ((WAVES - 600) / 40) ** 2)
    # The eye's curves at 5 nm, against their integrals with straight lines between the powers.
    assert 5 * spectrum @ EYE.response(WAVES) == pytest.approx(rgb_of_powers(spectrum), rel=3e-3)


def test_to_a_camera_daylight_is_white(tmp_path: Path):
    response = _read(tmp_path).response(WAVES)
    y = EYE.curves(WAVES)[:, 1]
    # Sensitivities have six digits.
    assert D65 @ response / (D65 @ y) == pytest.approx([1, 1, 1], abs=1e-4)


def test_the_input_transform_is_that_of_the_academy(tmp_path: Path):
    """colour-science fits the same surfaces to ACES2065-1, under its white of 6000 K."""
    colour = colour_science()
    camera = _nikon().align(colour.SpectralShape(380, 780, 5))
    daylight = colour.SDS_ILLUMINANTS["D65"].copy().align(colour.SpectralShape(380, 780, 5))
    training = colour.characterisation.read_training_data_rawtoaces_v1()
    surfaces = np.array(training.values).T * np.array(daylight.values)
    matrix, balance = colour.matrix_idt(camera, daylight)[:2]
    raw = surfaces @ np.array(camera.values) / (np.array(daylight.values) @ np.array(camera.values))
    aces = raw @ np.asarray(matrix).T
    assert np.asarray(matrix).sum(axis=1) == pytest.approx([1, 1, 1])
    assert len(balance) == 3
    expected = colour.RGB_to_RGB(aces, "ACES2065-1", "ITU-R BT.709", "Bradford", None)
    observer = _read(tmp_path)
    y = EYE.curves(WAVES)[:, 1]
    found = surfaces @ observer.response(WAVES) / (np.array(daylight.values) @ y)
    # The two fit in different spaces of lightness and white.
    assert ciede2000(lab(found), lab(expected)).mean() < 0.5
    assert observer.color_error == pytest.approx(1.29, abs=0.05)


def test_a_camera_with_the_eyes_curves_is_the_eye(tmp_path: Path):
    """The curves mixed by any matrix: as Luther and Ives demand of a camera."""
    mixed = EYE.curves(WAVES) @ np.array([[0.6, 0.2, 0.0], [0.3, 0.9, 0.1], [0.1, 0.0, 0.8]])
    observer = _read(tmp_path, mixed, WAVES)
    red = np.exp(-0.5 * ((WAVES - 632) / 8) ** 2)
    expected = red @ EYE.response(WAVES)
    assert red @ observer.response(WAVES) == pytest.approx(expected, abs=1e-3 * expected.max())
    assert observer.color_error < 0.05


def test_the_scale_of_a_channel_and_its_place_do_not_count(tmp_path: Path):
    first = _read(tmp_path)
    other = _read(tmp_path, _nikon().values[:, [2, 0, 1]] * [3, 0.1, 40])
    # The fit ends within 1e-6 of the least differences.
    assert other.response(WAVES) == pytest.approx(first.response(WAVES), abs=1e-5)


WRONG = {
    "has no blue": (lambda w, c: (w, c[:, :2]), "expected nanometres, red, green and blue"),
    "has four": (lambda w, c: (w, c[:, [0, 1, 2, 0]]), "expected nanometres, red, green and blue"),
    "is short": (lambda w, c: (w[5:], c[5:]), "covers 430 to 780 nm: expected 400 to 700"),
    "is negative": (lambda w, c: (w, c - 0.1), "the sensitivity -0.1 at 390 nm"),
    "is coarse": (lambda w, c: (w[::25], c[::25]), "has 4 points: expected 5"),
    "sees one thing": (lambda w, c: (w, c[:, [1, 1, 1]]), "channels that see the same"),
    "is blind": (lambda w, c: (w, c * [1, 1, 0]), "a channel that is 0"),
}


@pytest.mark.parametrize("case", WRONG)
def test_mistakes_are_one_line(case: str, tmp_path: Path):
    change, message = WRONG[case]
    camera = _nikon()
    waves, curves = camera.wavelengths, np.array(camera.values)
    if case != "is coarse":
        waves, curves = waves[::2], curves[::2]
    waves, curves = change(waves, curves)
    path = _write(tmp_path / "camera.csv", waves, curves)
    with pytest.raises(ColorError, match=message) as error:
        read_observer(path)
    assert "\n" not in str(error.value)
    assert str(error.value).startswith(str(path))


def test_a_file_that_is_missing_is_named(tmp_path: Path):
    with pytest.raises(ColorError, match="no such observer"):
        read_observer(tmp_path / "none.csv")


def test_rec709_is_the_space_of_pictures():
    assert EYE.matrix @ rgb_to_xyz(REC709) == pytest.approx(np.eye(3), abs=1e-12)
