"""Writing an answer to a folder: the lighting, the relit scene, files for other programs.

Everything that finds a lighting writes it with these functions: a run, a batch, a variation, a
relight and the painter. They add their own pictures and reports.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from lightpaint.basis import LightGroups
from lightpaint.lighting import Lighting, write_lighting
from lightpaint.pipeline.results.result_folder import ResultFolder
from lightpaint.relit import EXPORTS, check_relightable, relight, settle, write_exports
from lightpaint.scene import Scene, load_scene

#: Files of every answer; a scene may add files that it includes, light groups those for other
#: programs.
LIGHTING, RELIT = "lighting.json", "relit.xml"


@dataclass
class AnswerFolder:
    """A hidden folder with an answer, before it replaces the real one.

    Attributes:
        path: The folder.
        relit: The relit scene in that folder; None without a scene.
        has_moved_paths: True if relative paths in relit.xml change when it moves to its final
            place; set at the end.
    """

    path: Path
    relit: Scene | None = None
    has_moved_paths: bool = False

    def seen_through(self, sensor: int) -> Scene:
        """Return the relit scene through a sensor, reloaded if that is a different one."""
        assert self.relit is not None
        if self.relit.sensor == sensor:
            return self.relit
        return reload_relit(self.relit, self.relit.path, sensor)


def write_answer(
    folder: Path,
    lighting: Lighting,
    *,
    scene: Scene | None = None,
    groups: LightGroups | None = None,
    has_lighting: bool = False,
) -> Scene | None:
    """Write an answer to files for people and programs; return the relit scene.

    scene: the scene to relight. groups: light groups of another renderer, which get files for other
    programs. has_lighting: True if lighting.json exists already, or is not needed. A lighting that
    says nothing of places gets the places of the scene.
    """
    lighting = with_places(lighting.of_lamps(), scene)
    if not has_lighting:
        write_lighting(folder / LIGHTING, lighting)
    if groups is not None:
        write_exports(folder, groups, lighting)
    return None if scene is None else relight(scene, lighting, folder / RELIT)


def with_places(lighting: Lighting, scene: Scene | None) -> Lighting:
    """Return a lighting that says where lights are, the places of `scene` if it does not, and what
    sees the scene with spectra.
    """
    if scene is not None and scene.is_spectral:
        lighting = replace(lighting, observer=scene.observer)
    if scene is None or lighting.places:
        return lighting
    return replace(lighting, places=scene.emitter_places, up=scene.up)


def answer_files(
    folder: Path,
    *,
    scene: Scene | None = None,
    groups: LightGroups | None = None,
    has_lighting: bool = False,
) -> list[Path]:
    """Return all files that `write_answer` may write.

    Raises the errors that `write_answer` would raise for any lighting, before any expensive work.
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
    """Yield a folder with an answer, to which more files may be added; it then appears all at once.

    The other arguments are as in `write_answer`. Raises OutputError as `ResultFolder.filled`
    does.
    """
    with results.filled() as folder:
        relit = write_answer(
            folder, lighting, scene=scene, groups=groups, has_lighting=has_lighting
        )
        answer = AnswerFolder(folder, relit)
        yield answer
        if scene is not None:
            home = results.folder / RELIT
            answer.has_moved_paths = settle(scene, lighting, folder / RELIT, home)


def reload_relit(relit: Scene, path: Path, sensor: int) -> Scene:
    """Load a relit scene again from `path`, with its parameters."""
    scene = load_scene(
        path,
        sensor=sensor,
        parameters=relit.parameters,
        use_lights_file=False,
        lamps=["*"],
    )
    return replace(scene, is_spectral=relit.is_spectral, observer=relit.observer)
