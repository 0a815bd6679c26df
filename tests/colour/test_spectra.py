"""Spectra of lights: known illuminants, files as instruments write them, and mistakes in these."""

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from rig_files import gdtf

from lightpaint.colour.color import kelvin_to_rgb, xy_of, xy_of_spectrum
from lightpaint.colour.lamp import Lamp, LampEmitter
from lightpaint.colour.primaries import colour_science
from lightpaint.colour.rendering_indices import color_rendering, fidelity
from lightpaint.colour.spectrum import (
    WAVELENGTHS,
    named_spectrum,
    read_spectrum,
    rgb_of_powers,
    spectrum_of,
    xyz_of_powers,
)
from lightpaint.errors import ColorError, ConstraintError
from lightpaint.lighting.constraints.constraint_table import Constraints, LightConstraint
from lightpaint.sentences import SourceKey

HERE = Path()

#: xy of CIE 15:2004 are of 1 nm, and rounded to four digits.
OF_TABLE = 2e-4


@pytest.mark.parametrize("name", ["A", "D65", "FL2", "FL4", "LED-B1"])
def test_illuminants_have_their_colour(name: str):
    xyz = xyz_of_powers(spectrum_of(*named_spectrum(name, HERE)))
    observer = "CIE 1931 2 Degree Standard Observer"
    expected = colour_science().CCS_ILLUMINANTS[observer][name]
    assert xy_of(xyz) == pytest.approx(expected, abs=OF_TABLE)
    assert xyz[1] == pytest.approx(1, abs=1e-5)  # powers have six digits


def test_d65_is_white_and_a_black_body_of_2856_k_is_illuminant_a():
    assert rgb_of_powers(spectrum_of(*named_spectrum("D65", HERE))) == pytest.approx(1, abs=1e-3)
    black = xyz_of_powers(spectrum_of(*named_spectrum("2856K blackbody", HERE)))
    a = xyz_of_powers(spectrum_of(*named_spectrum("A", HERE)))
    assert xy_of(black) == pytest.approx(xy_of(a), abs=1e-4)  # A has another c2


@pytest.mark.parametrize("width", [2.0, 5.0, 12.0, 30.0])
@pytest.mark.parametrize("step", [0.5, 1, 2, 5])
def test_leds_keep_their_colour_on_the_grid(width: float, step: float):
    """Of lines narrower than 5 nm the grid keeps the place, and widens them."""
    waves = np.arange(380, 780.1, step)
    for peak in (452.3, 521.0, 631.7):
        powers = np.exp(-0.5 * ((waves - peak) / width) ** 2)
        if width < step:
            continue  # is not a curve in these points
        found = xy_of(xyz_of_powers(spectrum_of(waves, powers)))
        assert found == pytest.approx(
            xy_of_spectrum(waves, powers), abs=0.012 if width < 5 else 3e-3
        )


def _table(line: str) -> str:
    waves = np.arange(390, 721, 10)
    return "\n".join(line.format(w, 1 + w / 1000) for w in waves)


TABLES = {
    "csv": "nm,power\n" + _table("{:g},{:g}"),
    "text": "# of an LED\n" + _table("{:g}\t{:.4f}"),
    "semicolons": "Wellenlaenge;Leistung\n" + _table("{:g};{:g}").replace(".", ","),
    "spaces": _table("  {:g}   {:e}"),
    "quotes": '"nm","power"\n' + _table('"{:g}","{:g}"'),
    "quoted decimal commas": _table('"{:g}","{:g}"').replace(".", ","),
    "falling": "\n".join(reversed(_table("{:g},{:g}").splitlines())),
}


@pytest.mark.parametrize("encoding", ["latin-1", "utf-16", "utf-8-sig"])
def test_tables_are_read_as_spreadsheets_encode_them(encoding: str, tmp_path: Path):
    text = "Wellenlänge;Leistung\r\n" + _table("{:g};{:g}").replace(".", ",")
    (tmp_path / "led.csv").write_bytes(text.encode(encoding))
    waves, powers = named_spectrum("led.csv", tmp_path)
    assert powers == pytest.approx(1 + waves / 1000, abs=1e-4)


@pytest.mark.parametrize("kind", TABLES)
def test_tables_are_read_as_instruments_write_them(kind: str, tmp_path: Path):
    (tmp_path / "led.csv").write_text(TABLES[kind])
    waves, powers = named_spectrum("led.csv", tmp_path)
    assert waves[[0, -1]] == pytest.approx([390, 720])
    assert powers == pytest.approx(1 + waves / 1000, abs=1e-4)


TM27 = """<?xml version="1.0" encoding="utf-8"?>
<IESTM2714 xmlns="iestm2714" version="1.0">
  <Header><Manufacturer>A &amp; B</Manufacturer></Header>
  <SpectralDistribution><SpectralQuantity>flux</SpectralQuantity>
{}
  </SpectralDistribution>
</IESTM2714>
"""
DATA = _table('<SpectralData wavelength="{:.1f}">{:g}</SpectralData>')


def test_tm_27_is_read_as_colour_science_reads_it(tmp_path: Path):
    (tmp_path / "led.spdx").write_text(TM27.format(DATA))
    waves, powers = read_spectrum(tmp_path / "led.spdx")
    expected = colour_science().SpectralDistribution_IESTM2714(str(tmp_path / "led.spdx")).read()
    np.testing.assert_allclose(waves, expected.wavelengths)
    np.testing.assert_allclose(powers, expected.values)


#: Of spectrometers in files of fixtures, more than a table may have.
NOISE = 0.05


def _emitter(
    name: str, peak: float, *, level: int = 100, waves: range = range(380, 781, 10)
) -> str:
    """An emitter of a GDTF, whose weaker measurement has another spectrum."""
    measured = ""
    for physical, center in ((level / 2, 400.0), (level, peak)):
        # A spectrometer has noise, also below 0.
        energies = {w: np.exp(-(((w - center) / 20) ** 2)) - NOISE for w in reversed(waves)}
        points = "".join(
            f'<MeasurementPoint WaveLength="{w}" Energy="{x}"/>' for w, x in energies.items()
        )
        measured += f'<Measurement Physical="{physical}">{points}</Measurement>'
    return f'<Emitter Name="{name}">{measured}</Emitter>'


EMITTERS = _emitter("Red", 630) + _emitter("Deep Blue", 450) + '<Emitter Name="Amber"/>'


@pytest.mark.parametrize(("name", "peak"), [("Red", 630), ("deep blue", 450)])
def test_an_emitter_of_a_gdtf_has_a_name(name: str, peak: float, tmp_path: Path):
    """Its strongest measurement counts."""
    (tmp_path / "spot.gdtf").write_bytes(gdtf(described=f"<Emitters>{EMITTERS}</Emitters>"))
    waves, powers = named_spectrum(f"spot.gdtf:{name}", tmp_path)
    np.testing.assert_array_equal(waves, np.arange(380, 781, 10))
    expected = np.exp(-(((waves - peak) / 20) ** 2)) - NOISE
    np.testing.assert_allclose(powers, np.maximum(expected, 0), atol=1e-12)


NAMELESS = 'names no emitter: it has Red, Deep Blue; write "spot.gdtf:Red"'
NOT_A_NUMBER = EMITTERS.replace('WaveLength="400"', 'WaveLength="blue"')
WRONG_EMITTERS = {
    "unknown": ("spot.gdtf:Rot", EMITTERS, "no measured emitter 'Rot': it has Red, Deep Blue; "),
    "not measured": ("spot.gdtf:Amber", EMITTERS, "no measured emitter 'Amber': it has Red, D"),
    "no name": ("spot.gdtf", EMITTERS, NAMELESS),
    "a colon alone": ("spot.gdtf:", EMITTERS, NAMELESS),
    "none measured": ("spot.gdtf:Amber", '<Emitter Name="Amber"/>', "has no emitter with a meas"),
    "some nanometres": (
        "spot.gdtf:Red",
        _emitter("Red", 630, waves=range(600, 661, 10)),
        "covers 600 to 660 nm: expected 400 to 700",
    ),
    "no number": ("spot.gdtf:Red", NOT_A_NUMBER, "emitter 'Red' has a value that is not a number"),
    "no file": ("none.gdtf:Red", EMITTERS, "no such GDTF: "),
}


@pytest.mark.parametrize("case", WRONG_EMITTERS)
def test_mistakes_with_a_gdtf_are_one_line(case: str, tmp_path: Path):
    name, emitters, message = WRONG_EMITTERS[case]
    (tmp_path / "spot.gdtf").write_bytes(gdtf(described=f"<Emitters>{emitters}</Emitters>"))
    with pytest.raises(ColorError) as error:
        named_spectrum(name, tmp_path)
    assert message in str(error.value)
    assert "\n" not in str(error.value)
    (tmp_path / "spot.gdtf").write_text("no archive")
    with pytest.raises(ColorError, match="is not a GDTF" if "none" not in name else "no such"):
        named_spectrum(name, tmp_path)


def test_noise_below_zero_is_none(tmp_path: Path):
    (tmp_path / "led.csv").write_text(TABLES["csv"] + "\n730,-0.01")
    assert read_spectrum(tmp_path / "led.csv")[1].min() == 0


WRONG = {
    "a.csv": ("400,1\n500,1\n700,1", "has 3 points: expected 5"),
    "b.csv": (_table("{:g},{:g}").replace("390,", "790,", 1), "from 790 to 400 nm"),
    "c.csv": ("\n".join(f"{w},1" for w in range(450, 700, 10)), "covers 450 to 690 nm"),
    "d.csv": (TABLES["csv"] + "\n730,-0.5", "the power -0.5 at 730 nm"),
    "e.csv": (TABLES["csv"] + "\n730,many", "'730,many' in line 36"),
    "f.csv": (TABLES["csv"] + "\n730,nan", "not finite"),
    "g.spdx": ("<a><b></a>", "is not TM-27: mismatched tag"),
    "h.spdx": ("<!DOCTYPE a><a/>", "document type declaration"),
    "i.spdx": ("<a>" * 40, "nested more than 32 deep"),
    "j.spdx": (TM27.format(""), "is not TM-27: it has no SpectralData"),
    "k.csv": (None, "no such spectrum"),
    "D66": (None, "a file .* a black body .* or an illuminant"),
    "90K blackbody": (None, "90 K: expected 500 to 100000"),
}


@pytest.mark.parametrize("name", WRONG)
def test_mistakes_are_one_line(name: str, tmp_path: Path):
    text, message = WRONG[name]
    if text is not None:
        (tmp_path / name).write_text(text)
    table = {"emitters": [{"name": "red", "spectrum": name, "Y": 1}]}
    key = SourceKey(str(tmp_path / "hall.lights.toml"), "light", "par")
    with pytest.raises(ConstraintError, match=message) as error:
        LightConstraint.of(table, where=key)
    assert "\n" not in str(error.value)
    assert str(error.value).startswith(f"{key}.emitters.1.spectrum: ")


def test_a_spectrum_that_nobody_sees_is_none():
    with pytest.raises(ColorError, match="no power that eyes see"):
        spectrum_of(np.array([900.0, 950]), np.ones(2))


def test_an_emitter_keeps_its_spectrum():
    pairs = [[w, 1] for w in range(380, 781, 40)]
    table = {"emitters": [{"name": "even", "spectrum": pairs, "Y": 2}]}
    [emitter] = LightConstraint.of(table).emitters
    assert emitter.spectrum is not None
    assert len(emitter.spectrum) == len(WAVELENGTHS)
    assert np.ptp(emitter.spectrum) == 0
    assert Constraints.of({"par": table})


def _rendering_of(name: str):
    found = color_rendering(np.array(spectrum_of(*named_spectrum(name, HERE))))
    assert found is not None
    return found


#: Ra of CIE 15:2004, in whole numbers; Rf and Rg of TM-30-18's calculator.
KNOWN = {"A": (100, 100, 100), "D65": (100, 100, 100), "FL2": (64, 70.1, 86.4)}


@pytest.mark.parametrize("name", KNOWN)
def test_known_illuminants_have_their_rendering(name: str):
    found, (ra, rf, rg) = _rendering_of(name), KNOWN[name]
    assert found.ra == pytest.approx(ra, abs=0.5)
    assert found.rf == pytest.approx(rf, abs=0.1)
    assert found.rg == pytest.approx(rg, abs=0.1)


def test_colours_have_no_rendering():
    red = np.exp(-0.5 * ((WAVELENGTHS - 630) / 12.0) ** 2)
    assert color_rendering(red) is None
    assert color_rendering(0 * red) is None


def _rgbw(**fields: object) -> Lamp:
    peaks = {"red": (630, 10), "green": (525, 15), "blue": (455, 10), "white": (575, 60)}
    waves = np.arange(380, 781.0)
    emitters = []
    for name, (peak, width) in peaks.items():
        spectrum = spectrum_of(waves, np.exp(-0.5 * ((waves - peak) / width) ** 2))
        color = tuple(rgb_of_powers(spectrum).tolist())
        emitters.append(LampEmitter(name, color, watts=10, spectrum=spectrum))
    return Lamp(tuple(emitters), **fields)


def test_the_mix_of_the_best_rf_is_that_of_a_fine_search():
    """RGBW leaves one dimension, along which all mixes are tried."""
    lamp = _rgbw(prefer="rf")
    white = kelvin_to_rgb(3200.0)
    emission = 0.6 * np.asarray(white)
    found = lamp.drives_for(emission)
    assert lamp.mix(found) == pytest.approx(emission, abs=1e-6)
    assert lamp.powers_at_full is not None
    free = np.linalg.svd(lamp.columns.T)[2][-1]
    tried = [found + t * free for t in np.linspace(-1, 1, 201)]
    tried = [x for x in tried if x.min() >= -1e-9 and x.max() <= 1 + 1e-9]
    best = max(fidelity(x @ lamp.powers_at_full) for x in tried)
    rf = fidelity(found @ lamp.powers_at_full)
    assert rf > best - 1  # places of the search are an eighth of the way apart
    assert rf > fidelity(_rgbw().drives_for(emission) @ lamp.powers_at_full) - 1e-9


def test_of_coloured_light_the_best_rf_is_the_least_power():
    emission = _rgbw().mix(np.array([0.5, 0.0, 0.3, 0.0]))
    assert _rgbw(prefer="rf").drives_for(emission) == pytest.approx(_rgbw().drives_for(emission))


#: Ra of the illuminants FL1 to FL12 of CIE 15:2004.
FLUORESCENT = (76, 64, 57, 51, 72, 59, 90, 95, 90, 81, 83, 83)


def test_threads_get_the_numbers_of_one():
    """colour-science alone leaves wrong ones for good, once two threads have asked at a time."""
    spectra = [spectrum_of(*named_spectrum(f"FL{k}", HERE)) for k in range(1, 13)]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda x: color_rendering(np.array(x)), spectra))
    assert [None if x is None else x.ra for x in found] == pytest.approx(FLUORESCENT, abs=0.6)


LUXPY = json.loads(Path(__file__).with_name("luxpy_figures.json").read_text())["lights"]


@pytest.mark.parametrize("name", LUXPY)
def test_luxpy_has_the_same_rendering(name: str):
    """Another implementation, by `luxpy_figures.py`: lamps, daylight and mixes of LEDs."""
    expected = LUXPY[name]
    found = color_rendering(np.array(expected["powers"]))
    assert found is not None
    # luxpy's Ra is the mean of eight whole numbers, each of which is off by up to .5.
    assert found.ra == pytest.approx(expected["ra"], abs=0.5)
    # CIE 13.3 takes the reference at the colour temperature, whose formulas differ by a few kelvin.
    assert found.r9 == pytest.approx(expected["r9"], abs=0.3)
    assert found.rf == pytest.approx(expected["rf"], abs=3e-3)
    assert found.rg == pytest.approx(expected["rg"], abs=3e-3)
