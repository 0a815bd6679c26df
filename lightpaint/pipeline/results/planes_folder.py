"""The folder with what an answer gives on measuring planes: tables and false-colour pictures."""

from collections.abc import Mapping
from pathlib import Path

from lightpaint.arrays import Doubles
from lightpaint.photometry.glare import Glare
from lightpaint.photometry.illuminance import Illuminance
from lightpaint.photometry.planes_file import plane_names
from lightpaint.photometry.readings_file import readings_files, write_readings

#: The folder within that of the answer.
FOLDER = "planes"


def files_of_planes(folder: Path, planes: str | Path) -> list[Path]:
    """Return the files of measured planes in a result folder. planes: the path of their file."""
    names, cases = plane_names(planes)
    files = readings_files(names)
    return [folder / FOLDER / case / name for case in cases or ("",) for name in files]


def write_planes(
    folder: Path,
    illuminance: Illuminance,
    weights: Mapping[str, Doubles],
    origin: str,
    *,
    glare: Glare | None = None,
) -> None:
    """Write what weights (n, 3) by case give on planes, in a folder for each. origin: of the light,
    in words. glare: of all lights, if it was measured.
    """
    for case, lit in weights.items():
        place, words = folder / FOLDER / case, f"{origin}, {case}" if case else origin
        place.mkdir(parents=True, exist_ok=True)
        write_readings(place, illuminance, lit, words, glare=glare)
