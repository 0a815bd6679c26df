"""Spectra of the emitters of a GDTF (DIN SPEC 15800), by their names: `spot.gdtf:Red`."""

import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element

from lightpaint.display_text import some_names
from lightpaint.errors import ColorError, RigError
from lightpaint.files import one_line
from lightpaint.storage.rig_archive import RigArchive

_NAME = re.compile(r"(.+\.gdtf)(?::(.*))?", re.IGNORECASE)


def gdtf_and_emitter(name: str) -> tuple[str, str] | None:
    """Return the file and the emitter that a name like `spot.gdtf:Red` means; None for others.

    The emitter is "" where the name is that of a file alone.
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
    measured = {x.get("Name", ""): points for x in elements if (points := [*_measured(x, path)])}
    by_case = {x.casefold(): x for x in measured}
    if found := measured.get(name, measured.get(by_case.get(name.casefold(), ""), [])):
        return sorted(found)
    if not measured:
        raise ColorError(path, " has no emitter with a measured spectrum: name a table instead")
    mistake = f"has no measured emitter {one_line(repr(name))}" if name else "names no emitter"
    example = f"{path.name}:{next(iter(measured))}"
    raise ColorError(path, f' {mistake}: it has {some_names(measured)}; write "{example}"')


def _measured(emitter: Element, path: Path) -> Iterator[tuple[float, float]]:
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
