"""Files of luminaires: their candela are those that were written, whatever they list of them."""

import math
import random
from pathlib import Path

import numpy as np
import pytest
from webs import Distribution, batwing, cosine, ies_text, ldt_text, street, trough, write_web

from lightpaint.arrays import Doubles
from lightpaint.errors import SceneError
from lightpaint.luminaires import web_file
from lightpaint.luminaires.web import PhotometricWeb, turned
from lightpaint.luminaires.web_file import flux_remark, read_web, unread_remark

#: Files hold ten digits.
IN_FILE = 1e-8


def _read(folder: Path, text: str, suffix: str = "ies") -> PhotometricWeb:
    return read_web(write_web(folder / f"lamp.{suffix}", text))


def _direction(plane: Doubles | float, gamma: Doubles | float) -> Doubles:
    c, g = np.radians(plane), np.radians(gamma)
    return np.stack([np.sin(g) * np.cos(c), np.sin(g) * np.sin(c), -np.cos(g) + 0 * c], -1)


def _mirrored(light: Distribution, *, about_c90: bool) -> Distribution:
    """A distribution that is equal on both sides of the plane C0 or C90."""

    def both_sides(plane: Doubles, gamma: Doubles) -> Doubles:
        image = 180 - plane if about_c90 else -plane
        return light(plane, gamma) + light(image, gamma)

    return both_sides


SYMMETRIES: dict[str, tuple[Distribution, list[float], int]] = {
    "axial": (batwing, [0.0], 1),
    "quadrants": (trough, np.arange(0, 91, 15).tolist(), 4),
    "C0-C180": (_mirrored(street, about_c90=False), np.arange(0, 181, 15).tolist(), 2),
    "C90-C270": (_mirrored(street, about_c90=True), np.arange(90, 271, 15).tolist(), 3),
    "none": (street, np.arange(0, 361, 15).tolist(), 0),
}


@pytest.mark.parametrize("suffix", ["ies", "ldt"])
@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_candela_in_all_directions_are_those_of_the_file(
    tmp_path: Path, symmetry: str, suffix: str
) -> None:
    light, planes, code = SYMMETRIES[symmetry]
    gammas = np.arange(0, 180.1, 5).tolist()
    text = ies_text(light, planes, gammas) if suffix == "ies" else ldt_text(light, code)
    web = _read(tmp_path, text, suffix)
    assert web.symmetry == symmetry
    for plane in range(0, 360, 15):
        for gamma in gammas:
            expected = float(light(np.array(float(plane)), np.array(gamma)))
            # At the poles all planes meet, and a file of several ones has a value for each.
            if 0 < gamma < 180:
                found = float(web.candela(_direction(plane, gamma)))
                assert found == pytest.approx(expected, rel=1e-6, abs=1e-6), (plane, gamma)


def test_between_angles_candela_are_linear_and_beyond_them_dark(tmp_path: Path) -> None:
    web = _read(tmp_path, ies_text(trough, [0, 30, 90], [0, 10, 40, 90]))
    table = web.table
    found = web.candela(np.array([_direction(*x) for x in ((15, 20), (345, 20), (0, 90.5))]))
    third = (1 - 1 / 3) * table[:2, 1] + table[:2, 2] / 3
    assert found == pytest.approx([third.mean(), third.mean(), 0], rel=1e-9)


def test_an_even_grid_is_the_same_web(tmp_path: Path) -> None:
    web = _read(tmp_path, ies_text(street, [0, 22.5, 90, 210, 360], [0, 2.25, 6, 45, 93.75]))
    grid = web.even_grid()
    assert grid.shape == (49, 126)  # of 7.5 and of 0.75 degrees
    planes, gammas = np.linspace(0, 360, 49), np.linspace(0, 93.75, 126)
    directions = _direction(planes[:, None], gammas[None, :])
    # Those at the nadir have no plane.
    assert grid[:, 1:] == pytest.approx(web.candela(directions)[:, 1:], rel=1e-9)


@pytest.mark.parametrize(("light", "planes"), [(cosine, [0.0]), (trough, [0.0, 45.0, 90.0])])
def test_flux_is_the_integral_over_the_sphere(
    tmp_path: Path, light: Distribution, planes: list[float]
) -> None:
    web = _read(tmp_path, ies_text(light, planes))
    # The midpoint rule in steps of 0.05 and 1 degrees errs by less than a part in a million.
    gamma = np.arange(0.025, 90, 0.05)
    candela = web.candela(_direction(np.arange(360.0)[:, None], gamma[None, :]))
    steps = math.radians(0.05) * math.radians(1)
    integral = float((candela @ np.sin(np.radians(gamma))).sum() * steps)
    assert web.flux == pytest.approx(integral, rel=2e-5)


def test_a_cosine_lamp_of_1000_cd_has_1000_pi_lumens(tmp_path: Path) -> None:
    fine = _read(tmp_path, ies_text(cosine, [0], np.linspace(0, 90, 1001)))
    assert fine.flux == pytest.approx(1000 * math.pi, rel=1e-6)  # a chord errs by h²/12


@pytest.mark.parametrize(
    ("edition", "expected"),
    [
        ("IESNA:LM-63-2002", 3 * 0.9 * 0.5),
        ("IESNA:LM-63-1995", 3 * 0.9 * 0.5),
        ("IESNA91", 3 * 0.9 * 0.5),
        ("", 3 * 0.9 * 0.5),  # 1986 has no first line
        ("IES:LM-63-2019", 3 * 0.9),  # where the third factor says where the file comes from
    ],
)
def test_each_factor_counts_once(tmp_path: Path, edition: str, expected: float) -> None:
    text = ies_text(
        cosine, edition=edition, lamps="2 1500", multiplier=3, factors=(0.9, 0.5), watts=31
    )
    web = _read(tmp_path, text)
    assert web.peak == pytest.approx(1000 * expected, rel=IN_FILE)
    assert (web.stated_lumens, web.of_lamps, web.watts) == (3000, True, 31)


def test_an_absolute_file_states_no_lumens(tmp_path: Path) -> None:
    web = _read(tmp_path, ies_text(cosine, lamps="1 -1"))
    assert web.stated_lumens is None
    assert flux_remark(web, "lamp.ies") is None


#: Geometry of the lamp, number of angles, angles, and factors.
TILTED = "TILT=INCLUDE\r\n1\r\n3\r\n0 45 90\r\n1.0 0.95 0.8"


def test_factors_of_a_tilted_lamp_are_for_the_angle_at_which_it_hangs(tmp_path: Path) -> None:
    """LM-63: angles from hanging straight down, and a factor of all candela at each."""
    web = _read(tmp_path, ies_text(cosine, tilt=TILTED))
    assert web.peak == pytest.approx(1000)
    found = [web.factor_at(x) for x in (0, 22.5, 45, 60, 90, 120)]
    assert found == pytest.approx([1, 0.975, 0.95, 0.9, 0.8, 0.8])
    assert _read(tmp_path, ies_text(cosine)).factor_at(45) == 1


@pytest.mark.parametrize(
    ("tilt", "reason"),
    [
        ("TILT=INCLUDE\n1\n2\n45 0\n1 1", "its tilt angles do not rise"),
        ("TILT=INCLUDE\n1\n2\n0 90\n1 -1", "it has a negative factor of a tilt angle"),
    ],
)
def test_wrong_factors_of_a_tilted_lamp_are_refused(tmp_path: Path, tilt: str, reason: str) -> None:
    with pytest.raises(SceneError, match=reason):
        _read(tmp_path, ies_text(cosine, tilt=tilt))


def test_decimal_commas_are_named(tmp_path: Path) -> None:
    """In LM-63 a comma stands between numbers, which are then twice as many."""
    head, body = ies_text(cosine).split("TILT=NONE")
    angles = "1 1000 1 3 1 1 2 0 0 0 1 1 20 0 45 90 0 "
    for numbers in ("1000,5 707,25 0,0", "1000 707,5 0"):
        with pytest.raises(
            SceneError, match=r"lamp\.ies: its numbers have decimal commas, as \d+,"
        ):
            _read(tmp_path, f"{head}TILT=NONE\n{angles}{numbers}")
    plain = _read(tmp_path, ies_text(cosine))
    for separator in (", ", ","):
        read = _read(tmp_path, f"{head}TILT=NONE\n{separator.join(body.split())}")
        np.testing.assert_array_equal(read.table, plain.table)


def test_what_follows_after_the_last_intensity_is_told(tmp_path: Path) -> None:
    whole = _read(tmp_path, ies_text(cosine))
    assert unread_remark(whole, "lamp.ies") is None
    assert _read(tmp_path, ies_text(cosine) + "\x1a").unread == 0  # the end of a file in DOS
    more = unread_remark(_read(tmp_path, ies_text(cosine) + "1 2 3"), "lamp.ies")
    assert more is not None
    assert more.startswith("lamp.ies: 3 numbers after the last intensity that it announces")
    one = unread_remark(_read(tmp_path, ldt_text(cosine, 1) + "7", "ldt"), "lamp.ldt")
    assert one is not None
    assert "1 number after" in one


@pytest.mark.parametrize(
    ("unit", "sizes", "expected"),
    [
        # Width is along C90, length along C0.
        (2, (0.3, 1.2, 0), (1.2, 0.3, 0, False)),
        (1, (1, 4, 0.5), (1.2192, 0.3048, 0.1524, False)),
        (2, (-0.2, -0.2, 0), (0.2, 0.2, 0, True)),
        (2, (-0.2, 0, 0), (0.2, 0.2, 0, True)),
        (2, (0, 0, 0), (0, 0, 0, False)),
    ],
)
def test_openings_in_feet_and_metres(
    tmp_path: Path,
    unit: int,
    sizes: tuple[float, float, float],
    expected: tuple[float, float, float, bool],
) -> None:
    opening = _read(tmp_path, ies_text(cosine, unit=unit, sizes=sizes)).opening
    found = (opening.along_c0, opening.along_c90, opening.height, opening.is_round)
    assert found == pytest.approx(expected)


def test_eulumdat_is_in_candela_per_kilolumen_and_latin_letters(tmp_path: Path) -> None:
    web = _read(tmp_path, ldt_text(cosine, 1, flux=4000, line_24="0,5"), "ldt")
    assert (web.name, web.watts) == ("Größe 3", 18.5)
    assert web.peak == pytest.approx(500)
    # Length is along C90, width along C0, and the sizes of the opening are millimetres.
    assert (web.opening.along_c0, web.opening.along_c90) == (0.25, 0.6)
    assert (web.stated_lumens, web.of_lamps) == (4000, True)


def test_a_remark_if_the_flux_is_not_what_the_file_states(tmp_path: Path) -> None:
    stated = _read(tmp_path, ldt_text(cosine, 1, flux=4000, line_23="78.5"), "ldt")
    assert not stated.of_lamps
    assert flux_remark(stated, "a.ldt") is None  # π/4 of the lamps' flux, in steps of 5 degrees
    wrong = _read(tmp_path, ldt_text(cosine, 1, flux=4000, line_23="60"), "ldt")
    remark = flux_remark(wrong, "a.ldt")
    assert remark is not None
    assert "131% of the 2,400 lm that it states for the luminaire" in remark


def test_turns_and_tilts() -> None:
    nadir, c0 = _direction(0, 0), _direction(0, 90)
    assert turned(c0, turn=30, tilt=0) == pytest.approx(_direction(30, 90))
    assert turned(nadir, turn=0, tilt=20) == pytest.approx(_direction(90, 20))
    assert turned(nadir, turn=30, tilt=20) == pytest.approx(_direction(120, 20))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (ies_text(cosine, kind=2), "its photometry is of type B: expected type C"),
        (ies_text(cosine, kind=3), "its photometry is of type A: expected type C"),
        (ies_text(cosine, tilt="TILT=lamp.tlt"), "its TILT is in another file, 'lamp.tlt'"),
        (ies_text(cosine, unit=3), "its unit of length is 3"),
        (ies_text(cosine, [0, 30]), "its horizontal angles go from 0 to 30"),
        (ies_text(cosine, gammas=[0, 10, 10, 90]), "its vertical angles do not rise"),
        (ies_text(cosine, multiplier=-1), "its factors multiply to -1"),
        (ies_text(lambda c, g: -cosine(c, g)), "it has a negative intensity"),
        (ies_text(lambda c, g: 0 * cosine(c, g)), "it is dark"),
        (ies_text(cosine)[:400], "it is cut off"),
        (ies_text(cosine).replace(" 37 ", " nan "), "'nan' is not a number"),
        (ies_text(cosine).replace(" 37 ", " 99999999 "), "expected a whole number from 1 to"),
        (ies_text(cosine, multiplier=1e29), "its intensities are up to 1e+32 cd"),
        ("hello", "it has no line TILT="),
    ],
)
def test_refused_ies_files_name_the_file_and_the_reason(
    tmp_path: Path, text: str, reason: str
) -> None:
    with pytest.raises(SceneError) as refusal:
        _read(tmp_path, text)
    assert str(refusal.value).startswith(f"{tmp_path / 'lamp.ies'}: ")
    assert reason in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (ldt_text(cosine, 1, line_3="7"), "its symmetry, line 3, is 7"),
        (ldt_text(cosine, 1, line_29="0"), "the flux of its lamps, line 29, is 0"),
        (ldt_text(cosine, 1, line_4="-3"), "it has -3 C-planes, line 4"),
        (ldt_text(cosine, 4).replace("\n90\r", "\n89\r", 1), "it has no C-plane at 0 or at 90"),
        ("\n".join(ldt_text(cosine, 4).splitlines()[:90]), "it is cut off"),
    ],
)
def test_refused_eulumdat_files_name_the_file_and_the_reason(
    tmp_path: Path, text: str, reason: str
) -> None:
    with pytest.raises(SceneError) as refusal:
        _read(tmp_path, text, "ldt")
    assert str(refusal.value).startswith(f"{tmp_path / 'lamp.ldt'}: ")
    assert reason in str(refusal.value)


def test_other_files_and_long_ones_are_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(SceneError, match=r"is neither \.ies nor \.ldt"):
        _read(tmp_path, ies_text(cosine), "txt")
    monkeypatch.setattr(web_file, "MAX_BYTES", 100)
    with pytest.raises(SceneError, match="no photometric file has more than 100"):
        _read(tmp_path, ies_text(cosine))


@pytest.mark.parametrize("suffix", ["ies", "ldt"])
def test_damaged_files_are_read_or_refused_in_one_line(tmp_path: Path, suffix: str) -> None:
    whole = ies_text(street, [0, 90, 180, 270, 360]) if suffix == "ies" else ldt_text(street, 0)
    numbers = random.Random(3)
    for _ in range(300):
        text = list(whole)
        for _ in range(numbers.randint(1, 4)):
            text[numbers.randrange(min(len(text), 500))] = chr(numbers.randint(1, 255))
        reasons: list[str] = []
        try:
            web = _read(tmp_path, "".join(text), suffix)
            assert np.isfinite(web.table).all()
            assert web.flux > 0
        except SceneError as refusal:
            reasons.append(str(refusal))
        assert all(x.startswith(str(tmp_path)) and "\n" not in x for x in reasons)
