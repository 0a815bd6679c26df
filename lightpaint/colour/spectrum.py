"""Spectra of lights on a grid of 5 nm, and their colours; and spectra as people name them: a black
body, an illuminant of the CIE, an emitter of a GDTF, a file of a measurement.

Files are tables of two columns, nanometres and power, IES TM-27 (.spdx), or GDTF, of which one
emitter is named.

A spectrum is its power per nanometre at WAVELENGTHS, straight between these and dark beyond. That
is the grid on which CIE 13.3 and TM-30 are defined, and finer than LEDs are wide. Only its shape
counts: it is scaled to luminance 1.

A picture of spectra is linear Rec.709, for the eye by a matrix of CIE 1931 XYZ. A camera has no
such matrix, since two spectra of one colour differ to it; its input transform is the matrix which
comes closest. As the Academy recommends (P-2013-001, 2015): white balance first, then the 3 x 3
matrix that keeps white and shows the colours of a set of surfaces with the least differences in
L*a*b*. Surfaces are the 190 of RAWtoACES, and the light is D65, the white of Rec.709.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property, lru_cache
from pathlib import Path
from xml.etree.ElementTree import Element
from xml.parsers import expat

import numpy as np

from lightpaint.arrays import RGB, Doubles, Floats
from lightpaint.colour.color import C2, ciede2000, lab, matching_functions
from lightpaint.colour.primaries import REC709, colour_science, rgb_to_xyz
from lightpaint.display_text import some_names
from lightpaint.errors import ColorError, RigError
from lightpaint.files import one_line, read_bytes
from lightpaint.storage.rig_archive import RigArchive

#: Nanometres of a spectrum, and the distance between two.
STEP = 5
WAVELENGTHS = np.arange(380, 780 + STEP, STEP)

#: Digits of a power in files, of which a measurement has three, and of a sensitivity.
DIGITS = 6

#: Largest error of X, Y and Z relative to the largest of them, above which the grid loses lines.
LOST = 0.01

#: Power per nanometre at each of WAVELENGTHS, for luminance 1.
Spectrum = tuple[float, ...]

_NAME = re.compile(r"(.+\.gdtf)(?::(.*))?", re.IGNORECASE)

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

#: Smallest of the singular values of the colours of surfaces, relative to the largest, below which
#: three channels are taken for fewer.
INDEPENDENT = 1e-3


def spectrum_of(waves: Floats, powers: Floats) -> Spectrum:
    """Return the spectrum of power (k,) at rising wavelengths (k,), straight between its points and
    dark beyond them.

    Where the grid would lose a line between its wavelengths, it holds means around these instead.
    Raises ColorError for a spectrum without power that eyes see.
    """
    values = np.interp(WAVELENGTHS, waves, powers, left=0, right=0)
    grid, observer = matching_functions()
    exact = np.interp(grid * 1e9, waves, powers, left=0, right=0) @ observer
    if np.abs(values @ _observer() - exact).max() > LOST * exact.max():
        fine = np.arange(WAVELENGTHS[0] - STEP, WAVELENGTHS[-1] + STEP + 0.05, 0.1)
        power = np.interp(fine, waves, powers, left=0, right=0)
        hats = np.maximum(0, 1 - np.abs(fine - WAVELENGTHS[:, None]) / STEP)
        values = hats @ power / hats.sum(axis=1)
    return scaled(values)


def scaled(values: Doubles) -> Spectrum:
    """Return powers (81,) as a spectrum. Raises ColorError if nobody sees them."""
    y = float((values @ _observer())[1])
    if not y > 0:
        raise ColorError("has no power that eyes see: leave this emitter out")
    return tuple(float(f"{x / y:.{DIGITS}g}") for x in values)


def xyz_of_powers(powers: Spectrum | Doubles) -> Doubles:
    """Return CIE 1931 XYZ (3,) of power per nanometre at WAVELENGTHS, in its unit."""
    return np.asarray(np.asarray(powers, np.float64) @ _observer())


def rgb_of_powers(powers: Spectrum | Doubles) -> Doubles:
    """Return linear Rec.709 (3,) of power per nanometre at WAVELENGTHS; may be negative."""
    return np.asarray(np.linalg.solve(rgb_to_xyz(REC709), xyz_of_powers(powers)))


def black_body(kelvin: float) -> Spectrum:
    """Return the spectrum of a black body."""
    metres = WAVELENGTHS * 1e-9
    return scaled(metres**-5.0 / np.expm1(C2 / (metres * kelvin)))


@cache
def _observer() -> Doubles:
    """Return the integrals (81, 3) of the colour matching functions with each power's hat."""
    waves, observer = matching_functions()
    nanometres = waves * 1e9
    hats = np.maximum(0, 1 - np.abs(nanometres - WAVELENGTHS[:, None]) / STEP)
    return np.asarray(hats @ observer)


def gdtf_and_emitter(name: str) -> tuple[str, str] | None:
    """Return the file and the emitter that a name like `spot.gdtf:Red` means; None for others.

    The emitter is "" where the name is the name of a file alone.
    """
    match = _NAME.fullmatch(name.strip())
    return None if match is None else (match[1], (match[2] or "").strip())


def read_gdtf_emitter(path: Path, name: str) -> list[tuple[float, float]]:
    """Return the spectrum of an emitter at its highest level: nanometres, rising, and power.

    Negative energies are noise, and count as 0, as where `lightpaint rig` reads them.

    Raises ColorError for a file that is not a GDTF, and for a name, even "", that none of its
    measured emitters has; it lists those.
    """
    try:
        with RigArchive(path, str(path), "GDTF") as archive:
            root = archive.xml("description.xml")
    except RigError as error:
        raise ColorError(error.sentence) from None
    elements = root.findall("FixtureType/PhysicalDescriptions/Emitters/Emitter")
    measured = {x.get("Name", ""): points for x in elements if (points := [*_points_of(x, path)])}
    by_case = {x.casefold(): x for x in measured}
    if found := measured.get(name, measured.get(by_case.get(name.casefold(), ""), [])):
        return sorted(found)
    if not measured:
        raise ColorError(path, " has no emitter with a measured spectrum: name a table instead")
    mistake = f"has no measured emitter {one_line(repr(name))}" if name else "names no emitter"
    example = f"{path.name}:{next(iter(measured))}"
    raise ColorError(path, f' {mistake}: it has {some_names(measured)}; write "{example}"')


def _points_of(emitter: Element, path: Path) -> Iterator[tuple[float, float]]:
    """Yield nanometres and power of the measurement at the highest level; nothing without one."""
    try:
        levels = {float(x.get("Physical", "0")): x for x in emitter.iterfind("Measurement")}
        points = levels[max(levels)].iterfind("MeasurementPoint") if levels else ()
        for point in points:
            yield float(point.get("WaveLength", "")), max(float(point.get("Energy", "")), 0.0)
    except ValueError as error:
        name = one_line(repr(emitter.get("Name", "")))
        raise ColorError(
            path, f": emitter {name} has a value that is not a number: {one_line(str(error))}"
        ) from None


def file_of_spectrum(name: str) -> str | None:
    """Return the file in which a spectrum of this name is; None for the spectrum of a light."""
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
        points = _points_of_table(_table_text(path, "spectrum"), path, "nanometres and power", 2)
    return _curve(points, path)


def _curve(points: Sequence[tuple[float, ...]], path: Path) -> tuple[Doubles, Doubles]:
    """Return nanometres (k,) and power (k,) of measured points, checked."""
    waves, powers = _measured(points, path, "the power")
    return waves, powers[:, 0]


def read_sensitivities(path: Path) -> tuple[Doubles, Doubles]:
    """Return nanometres (k,), rising, and the sensitivities (k, 3), >= 0, of a camera's channels.

    Raises ColorError for a file that is missing, or has no three curves of visible light.
    """
    points = _points_of_table(
        _table_text(path, "observer"), path, "nanometres, red, green and blue", 4
    )
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
    """Return nanometres (k,), rising, and values (k, n) of measured points, checked, without their
    noise.

    points: with rising or falling wavelengths. what: the values in words. Raises ColorError, which
    says what is wrong without a name.
    """
    if not FEWEST_POINTS <= len(points) <= MAX_POINTS:
        raise ColorError(f"has {len(points)} points: expected {FEWEST_POINTS} to {MAX_POINTS}")
    table = np.array(points, np.float64)
    if not np.isfinite(table).all():
        raise ColorError("has a number that is not finite")
    if (np.diff(table[:, 0]) < 0).all():  # as some instruments scan
        table = table[::-1]
    waves, values = table[:, 0], table[:, 1:]
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


def _table_text(path: Path, kind: str) -> str:
    """Return the text of a table in UTF-8, in UTF-16 or, as spreadsheets export it, in Latin-1."""
    data = read_bytes(path, kind, ColorError, limit=MAX_BYTES)
    encoding = "utf-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig"
    try:
        return data.decode(encoding)
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _points_of_table(text: str, path: Path, what: str, width: int) -> list[tuple[float, ...]]:
    """Return the points of a table, whose first lines may be a heading.

    what: its columns in words. width: their number.
    """
    points: list[tuple[float, ...]] = []
    wrong = ""
    for number, line in enumerate(text.splitlines(), 1):
        # A comma inside quotes, or between digits of a semicolon's or tab's table, is a decimal.
        line = re.sub(r'"([^"]*)"', lambda quoted: quoted[1].replace(",", "."), line)
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


@dataclass(frozen=True)
class Observer:
    """An observer of a picture of spectra.

    name: for people. sensitivities: (81, 3) at WAVELENGTHS, the response of a camera's channels to
    power, 1 at the largest of each; empty for the eye.
    """

    name: str = "CIE 1931 2°"
    sensitivities: tuple[RGB, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        if self.sensitivities and len(self.sensitivities) != len(WAVELENGTHS):
            raise ColorError(
                f"an observer has {len(self.sensitivities)} wavelengths: expected "
                f"{len(WAVELENGTHS)}"
            )

    @property
    def is_camera(self) -> bool:
        """True unless it is the eye."""
        return bool(self.sensitivities)

    def curves(self, waves: Doubles) -> Doubles:
        """Return its curves (k, 3), >= 0, at wavelengths (k,) in nm: the CIE's for the eye."""
        grid, values = WAVELENGTHS.astype(np.float64), np.array(self.sensitivities)
        if not self.is_camera:
            metres, values = matching_functions()
            grid = metres * 1e9
        found = np.stack([np.interp(waves, grid, x, left=0, right=0) for x in values.T], axis=-1)
        return np.asarray(np.maximum(found, 0))  # a value of the CIE's table is −3e-22

    @cached_property
    def matrix(self) -> Doubles:
        """(3, 3) from integrals over its curves to linear Rec.709, for luminance."""
        if not self.is_camera:
            return np.asarray(np.linalg.inv(rgb_to_xyz(REC709)))
        return _input_transform(self.sensitivities)

    def response(self, waves: Doubles) -> Doubles:
        """Return the linear Rec.709 (k, 3) of light of 1 nm at wavelengths (k,). D65 of luminance 1
        is white (1, 1, 1).
        """
        return np.asarray(self.curves(waves) @ self.matrix.T)

    @cached_property
    def color_error(self) -> float:
        """Mean CIEDE2000 of the colours of the surfaces in D65 to what the eye sees."""
        surfaces, seen = _surfaces_in_d65()
        found = surfaces @ self.response(WAVELENGTHS.astype(np.float64))
        return float(ciede2000(lab(found), lab(seen)).mean())


#: The CIE's standard observer of 1931, 2 degrees.
EYE = Observer()


def read_observer(path: Path) -> Observer:
    """Return the camera whose sensitivities a table has: nanometres, red, green and blue.

    Values are responses per power of light, not per photon; the scale of a channel does not count.
    Raises ColorError for a file without such curves.
    """
    waves, values = read_sensitivities(path)
    if not (largest := values.max(axis=0)).all():
        raise ColorError(path, " has a channel that is 0: expected red, green and blue")
    curves = [np.interp(WAVELENGTHS, waves, x, left=0, right=0) for x in (values / largest).T]
    rows = np.stack(curves, axis=1).tolist()
    sensitivities = tuple((_rounded(r), _rounded(g), _rounded(b)) for r, g, b in rows)
    observer = Observer(path.name, sensitivities)
    try:
        _ = observer.matrix
    except ColorError as error:
        raise ColorError(path, error.sentence) from None
    return observer


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


@lru_cache(8)
def _input_transform(sensitivities: tuple[RGB, ...]) -> Doubles:
    """Return the matrix (3, 3) of a camera, by the Academy's procedure (P-2013-001).

    Raises ColorError if a channel sees what another sees.
    """
    from scipy.optimize import least_squares

    surfaces, seen = _surfaces_in_d65()
    d65, curves = _d65(), np.array(sensitivities)
    white = d65 @ curves
    raw = surfaces @ curves / white
    spread = np.linalg.svd(raw, compute_uv=False)
    if spread[-1] < INDEPENDENT * spread[0]:
        raise ColorError(
            " has channels that see the same: expected three different curves, of red, green and "
            "blue"
        )

    def matrix_of(parameters: Doubles) -> Doubles:
        # Rows that sum to 1 keep white.
        first = parameters.reshape(3, 2)
        return np.asarray(np.column_stack([first, 1 - first.sum(axis=1)]))

    def difference(parameters: Doubles) -> Doubles:
        return np.asarray(np.ravel(lab(raw @ matrix_of(parameters).T) - lab(seen)))

    # The linear least-squares answer under that condition is the start.
    reduced = raw[:, :2] - raw[:, 2:]
    start = np.linalg.lstsq(reduced, seen - raw[:, 2:], rcond=None)[0].T.ravel()
    found = least_squares(difference, start, xtol=1e-12, ftol=1e-12).x
    return np.asarray(matrix_of(found) / white)


@lru_cache(1)
def _surfaces_in_d65() -> tuple[Doubles, Doubles]:
    """Return the light of surfaces in D65 of luminance 1, (k, 81), for each nanometre's share of a
    sum over WAVELENGTHS; and their linear Rec.709 (k, 3) to the eye, with D65 as (1, 1, 1).
    """
    training = colour_science().characterisation.read_training_data_rawtoaces_v1()
    surfaces = np.array(training.values, np.float64).T * _d65()
    response = EYE.response(WAVELENGTHS.astype(np.float64))
    return surfaces, surfaces @ response / (_d65() @ response)


def _d65() -> Doubles:
    """Return D65 as shares (81,) of a sum over WAVELENGTHS, of luminance 1."""
    powers = np.array(spectrum_of(*named_spectrum("D65", Path())))
    y = EYE.curves(WAVELENGTHS.astype(np.float64))[:, 1]
    return np.asarray(powers / (powers @ y))
