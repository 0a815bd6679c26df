"""A room and a painting of it, shipped with the package to try it out.

`gallery` and `evening.png` are links into `scenes/` and `targets/`; a built package has the files.
"""

from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path

from lightpaint.errors import OutputError
from lightpaint.files import write_bytes
from lightpaint.keywords import keywords

#: Files of the scene's folder that are copied; the scripts that make them are not.
PATTERNS = ("scene.xml", "meshes/*.ply", "textures/*.png")


@keywords()
@dataclass(frozen=True)
class Demo:
    """A copy of the demo in a folder of the user's.

    Attributes:
        scene: Mitsuba XML.
        painting: PNG, as a painter's program writes it.
        answer: Folder to solve into.

    Examples:
        >>> lp.write_demo("lightpaint-demo").answer
        PosixPath('lightpaint-demo/evening')
    """

    scene: Path
    painting: Path
    answer: Path


@keywords()
def write_demo(folder: str | Path) -> Demo:
    """Copy the demo into `folder`; equal files that are there already are left alone.

    Args:
        folder: Created if it does not exist.

    Returns:
        Paths of the files.

    Raises:
        OutputError: If a file there differs, or cannot be written.

    Examples:
        >>> demo = lp.write_demo("lightpaint-demo")
        >>> len(lp.load_scene(demo.scene).lights)
        12
    """
    folder = Path(folder)
    demo = Demo(folder / "gallery" / "scene.xml", folder / "evening.png", folder / "evening")
    with as_file(files(__name__)) as shipped:
        room = [file for x in PATTERNS for file in (shipped / "gallery").glob(x)]
        contents = {file.relative_to(shipped): file.read_bytes() for file in room}
        contents[Path("evening.png")] = (shipped / "evening.png").read_bytes()
    existing = {file: data for file, data in contents.items() if (folder / file).exists()}
    for file, data in existing.items():
        if not (folder / file).is_file() or (folder / file).read_bytes() != data:
            raise OutputError(
                f"{folder / file} differs from the demo's file: choose another folder, or move "
                "it away"
            )
    for file, data in contents.items():
        if file not in existing:
            write_bytes(folder / file, data)
    return demo
