"""The planes file: a TOML file beside the scene that says where illuminance is measured.

For `hall.xml` it is `hall.planes.toml`; docs/photometry.md has the details.
"""

from dataclasses import dataclass, field
from pathlib import Path

from lightpaint.photometry.measuring_plane import MeasuringPlane, PowerBudget
from lightpaint.scene.scene import Scene

SUFFIX = ".planes.toml"


@dataclass(frozen=True)
class PlanesFile:
    """The content of a planes file."""

    path: Path
    planes: tuple[MeasuringPlane, ...]
    power: PowerBudget = field(default_factory=PowerBudget)


def planes_file_beside(scene: Path) -> Path:
    """Return the path of the planes file of `scene`, whether it exists or not."""
    return scene.with_name(scene.stem + SUFFIX)


def read_planes(path: str | Path, scene: Scene) -> PlanesFile:
    """Read a planes file, and place its points in `scene`.

    Raises SceneError for an invalid file, and for a plane without a point.
    """
    raise NotImplementedError
