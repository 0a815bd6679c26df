"""Spectra as people name them: a black body, an illuminant of the CIE, a file of a measurement.

Files are tables of two columns, nanometres and power, IES TM-27 (.spdx), or GDTF, of which one
emitter is named.
"""

import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from xml.parsers import expat

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.colour.primaries import colour_science
from lightpaint.colour.spectra.gdtf_emitters import gdtf_and_emitter, read_gdtf_emitter
from lightpaint.colour.spectra.spectrum import WAVELENGTHS, black_body, spectrum_of
from lightpaint.errors import ColorError
from lightpaint.file_reading import read_bytes, read_text
from lightpaint.files import one_line

#: Endings of files: tables, and TM-27.
TABLES, TM27 = (".csv", ".txt", ".dat", ".spd"), (".spdx", ".xml")

#: Longest file of a spectrum in bytes, and most points in it.
MAX_BYTES, MAX_POINTS = 2**20, 5000

#: Nanometres that a measurement has to cover, and the fewest points that it needs.
COVERED, FEWEST_POINTS = (400.0, 700.0), 5

#: Largest negative power that counts as noise of a measurement, relative to its largest power.
NOISE = 0.01

#: Kelvin of black bodies.
KELVINS = (500.0, 100_000.0)

#: Deepest nesting of XML.
MAX_NESTING = 32

_BLACK_BODY = re.compile(r"(\d+(?:\.\d+)?) ?k(?: ?black ?body)?", re.IGNORECASE)


def file_of_spectrum(name: str) -> str | None:
    """Return the file in which a spectrum of this name is; None for that of a light."""
    if found := gdtf_and_emitter(name):
        return found[0]
    return name if Path(name).suffix.lower() in (*TABLES, *TM27) else None


def named_spectrum(name: str, folder: Path) -> tuple[Doubles, Doubles]:
    """Return nanometres (k,), rising, and power (k,) of a spectrum by its name or file.

    name: `3200K blackbody`, an illuminant like `D65`, a file, or an emitter of a GDTF, like
    `spot.gdtf:Red`. folder: of relative paths. Raises ColorError, which says what is wrong without
    the name.
    """
    if found := gdtf_and_emitter(name):
        path = folder / found[0]
        return _curve(read_gdtf_emitter(path, found[1]), path)
    if file_of_spectrum(name):
        return read_spectrum(folder / name)
    if match := _BLACK_BODY.fullmatch(name.strip()):
        kelvin = float(match[1])
        if not KELVINS[0] <= kelvin <= KELVINS[1]:
            raise ColorError(f"{kelvin:g} K: expected {KELVINS[0]:g} to {KELVINS[1]:g}")
        return WAVELENGTHS.astype(np.float64), np.array(black_body(kelvin))
    illuminants = colour_science().SDS_ILLUMINANTS
    if name in illuminants:
        illuminant = illuminants[name]
        return np.array(illuminant.wavelengths), np.array(illuminant.values)
    raise ColorError(
        f"{one_line(repr(name))}: expected pairs of nanometres and power, a file "
        '("led.csv", "led.spdx"), an emitter of a GDTF ("spot.gdtf:Red"), a black body '
        '("3200K blackbody") or an illuminant of the CIE ("D65", "A", "FL2")'
    )


@cache
def daylight() -> Doubles:
    """Return D65, (81,) at WAVELENGTHS, for luminance 1."""
    return np.array(spectrum_of(*named_spectrum("D65", Path())))


def read_spectrum(path: Path) -> tuple[Doubles, Doubles]:
    """Return nanometres (k,), rising, and power (k,), >= 0, of a measurement in a file.

    Raises ColorError for a file that is missing, or is not a spectrum of visible light.
    """
    if path.suffix.lower() in TM27:
        points = _points_of_tm27(read_bytes(path, "spectrum", ColorError, limit=MAX_BYTES), path)
    else:
        text = read_text(path, "spectrum", ColorError, limit=MAX_BYTES)
        points = _points_of_table(text, path, "nanometres and power", 2)
    return _curve(points, path)


def _curve(points: Sequence[tuple[float, ...]], path: Path) -> tuple[Doubles, Doubles]:
    """Return nanometres (k,) and power (k,) of measured points, checked."""
    waves, powers = _measured(points, path, "the power")
    return waves, powers[:, 0]


def read_sensitivities(path: Path) -> tuple[Doubles, Doubles]:
    """Return nanometres (k,), rising, and the sensitivities (k, 3), >= 0, of a camera's channels.

    Raises ColorError for a file that is missing, or has no three curves of visible light.
    """
    text = read_text(path, "observer", ColorError, limit=MAX_BYTES)
    points = _points_of_table(text, path, "nanometres, red, green and blue", 4)
    return _measured(points, path, "the sensitivity")


def _measured(
    points: Sequence[tuple[float, ...]], path: Path, what: str
) -> tuple[Doubles, Doubles]:
    """Return nanometres (k,) and values (k, n) of the points of a file, as `measured_points`."""
    try:
        return measured_points(points, what)
    except ColorError as error:
        raise ColorError(path, " ", error) from None


def measured_points(
    points: Sequence[tuple[float, ...]], what: str = "the power"
) -> tuple[Doubles, Doubles]:
    """Return nanometres (k,) and values (k, n) of measured points, checked, without their noise.

    what: the values in words. Raises ColorError, which says what is wrong without a name.
    """
    if not FEWEST_POINTS <= len(points) <= MAX_POINTS:
        raise ColorError(f"has {len(points)} points: expected {FEWEST_POINTS} to {MAX_POINTS}")
    table = np.array(points, np.float64)
    waves, values = table[:, 0], table[:, 1:]
    if not np.isfinite(table).all():
        raise ColorError("has a number that is not finite")
    if (falls := np.flatnonzero(np.diff(waves) <= 0)).size:
        k = int(falls[0])
        raise ColorError(f"goes from {waves[k]:g} to {waves[k + 1]:g} nm: wavelengths have to rise")
    low, high = COVERED
    if waves[0] > low or waves[-1] < high:
        raise ColorError(
            f"covers {waves[0]:g} to {waves[-1]:g} nm: expected {low:g} to {high:g} at least"
        )
    if values.min() < -NOISE * values.max():
        k = int(values.min(axis=1).argmin())
        raise ColorError(
            f"has {what} {values[k].min():g} at {waves[k]:g} nm: there is none below 0, apart "
            f"from noise of {100 * NOISE:g} % of the largest"
        )
    return waves, np.maximum(values, 0)


def _points_of_table(text: str, path: Path, what: str, width: int) -> list[tuple[float, ...]]:
    """Return the points of a table, whose first lines may be a heading.

    what: its columns in words. width: their number.
    """
    points: list[tuple[float, ...]] = []
    wrong = ""
    for number, line in enumerate(text.splitlines(), 1):
        # A comma between digits of a semicolon's or tab's table is a decimal one.
        if ";" in line or "\t" in line:
            line = line.replace(",", ".")
        cells = re.split(r"[,;\s]+", line.split("#")[0].strip(" ,;\t"))
        if cells == [""]:
            continue
        if len(cells) == width and _are_numbers(cells):
            points.append(tuple(map(float, cells)))
        elif points or (_are_numbers(cells) and not wrong):
            wrong = f" has {one_line(repr(line))} in line {number}: expected {what}"
            if points:
                raise ColorError(path, wrong)
    if wrong and not points:
        raise ColorError(path, wrong)
    return points


def _are_numbers(cells: Sequence[str]) -> bool:
    try:
        list(map(float, cells))
    except ValueError:
        return False
    return True


def _points_of_tm27(data: bytes, path: Path) -> list[tuple[float, ...]]:
    """Return the points of IES TM-27. A document type, which entities need, is refused."""
    parser = expat.ParserCreate()
    parser.buffer_text = True
    points: list[tuple[float, ...]] = []
    open_waves: list[str] = []
    texts: list[str] = []
    depth = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > MAX_NESTING:
            raise ColorError(path, f" is nested more than {MAX_NESTING} deep")
        if tag.rpartition(":")[2] == "SpectralData":
            open_waves.append(attributes.get("wavelength", ""))
            texts.clear()

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        if tag.rpartition(":")[2] == "SpectralData":
            points.append((float(open_waves.pop()), float("".join(texts))))

    def refuse(*_: object) -> None:
        raise ColorError(path, " has a document type declaration: it is not read")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = texts.append
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, ValueError) as error:
        raise ColorError(path, f" is not TM-27: {one_line(str(error))}") from None
    if not points:
        raise ColorError(path, " is not TM-27: it has no SpectralData")
    return points
