"""Writing an answer into a folder: the lighting, the scene that has it, files for other programs.

Whoever has found a lighting leaves it by this: a run, a batch, a variation, a relight and the
painter. Pictures and reports of it are theirs.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from lightpaint.basis.lightgroups.read import LightGroups
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.answer.lighting_file import write_lighting
from lightpaint.pipeline.result_folder import ResultFolder
from lightpaint.relit.export.exports import EXPORTS, write_exports
from lightpaint.relit.relight import check_relightable, relight, settle
from lightpaint.scene.scene import Scene, load_scene

#: Files of an answer beside those that include it and those for other programs.
LIGHTING, RELIT = "lighting.json", "relit.xml"


@dataclass
class AnswerFolder:
    """A folder that an answer was written to, before it takes its place.

    Attributes:
        path: The folder.
        relit: The scene as it was relit there; None without a scene.
        has_moved_paths: Whether relative paths in relit.xml are others in its place: known at the
            end.
    """

    path: Path
    relit: Scene | None = None
    has_moved_paths: bool = False

    def seen_through(self, sensor: int) -> Scene:
        """Return the relit scene through a sensor; it is loaded anew for another one."""
        assert self.relit is not None
        if self.relit.sensor == sensor:
            return self.relit
        return loaded_relit(self.relit, self.relit.path, sensor)


def write_answer(
    folder: Path,
    lighting: Lighting,
    *,
    scene: Scene | None = None,
    groups: LightGroups | None = None,
    has_lighting: bool = False,
) -> Scene | None:
    """Write an answer to files that people and programs read; return the scene as it was relit.

    scene: that is to be relit. groups: light groups of another renderer, for which there are files
    for other programs. has_lighting: whether lighting.json is there already, or is not wanted.
    """
    if not has_lighting:
        write_lighting(folder / LIGHTING, lighting)
    if groups is not None:
        write_exports(folder, groups, lighting)
    return None if scene is None else relight(scene, lighting, folder / RELIT)


def answer_files(
    folder: Path,
    *,
    scene: Scene | None = None,
    groups: LightGroups | None = None,
    has_lighting: bool = False,
) -> list[Path]:
    """Return the files that `write_answer` writes at most.

    Raises what it would raise for some lighting, before anything is paid for.
    """
    files = [] if has_lighting else [folder / LIGHTING]
    if scene is not None:
        files += check_relightable(scene, folder / RELIT)
    if groups is not None:
        files += [folder / name for name in EXPORTS]
    return files


@contextmanager
def new_answer(
    results: ResultFolder,
    lighting: Lighting,
    *,
    scene: Scene | None = None,
    groups: LightGroups | None = None,
    has_lighting: bool = False,
) -> Iterator[AnswerFolder]:
    """Yield a folder with an answer, to which more may be written; it then appears all at once.

    Others as of `write_answer`. Raises OutputError as `ResultFolder.filled` does.
    """
    with results.filled() as folder:
        written = write_answer(
            folder, lighting, scene=scene, groups=groups, has_lighting=has_lighting
        )
        answer = AnswerFolder(folder, written)
        yield answer
        if scene is not None:
            home = results.folder / RELIT
            answer.has_moved_paths = settle(scene, lighting, folder / RELIT, home)


def loaded_relit(relit: Scene, path: Path, sensor: int) -> Scene:
    """Load a relit scene anew from `path`, with the parameters that it has."""
    return load_scene(path, sensor=sensor, parameters=relit.parameters, use_lights_file=False)
