"""The folder with what an answer gives on measuring planes: tables and false-colour pictures."""

from pathlib import Path

from lightpaint.arrays import Doubles
from lightpaint.photometry.illuminance import Illuminance
from lightpaint.photometry.planes_file import plane_names
from lightpaint.photometry.readings_file import readings_files, write_readings

#: The folder within that of the answer.
FOLDER = "planes"


def files_of_planes(folder: Path, planes: str | Path) -> list[Path]:
    """Return the files of measured planes in a result folder. planes: the path of their file."""
    return [folder / FOLDER / name for name in readings_files(plane_names(planes))]


def write_planes(folder: Path, illuminance: Illuminance, weights: Doubles, origin: str) -> None:
    """Write what weights (n, 3) give on planes. origin: of the light, in words."""
    (folder / FOLDER).mkdir(exist_ok=True)
    write_readings(folder / FOLDER, illuminance, weights, origin)
