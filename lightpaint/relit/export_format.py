"""A format in which an answer can be exported: what it needs, and what it makes."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from lightpaint.basis.lightgroups.light_groups import LightGroups
from lightpaint.errors import LightpaintError
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.progress import Listener
from lightpaint.relit.export.program_axes import SkyMap
from lightpaint.relit.exported_lights import SlideImage, WallImage
from lightpaint.scene.scene import Scene
from lightpaint.sentences import Hint, Sentence

#: The map of an image light.
AnyMap = SkyMap | WallImage | SlideImage

#: A function that makes the text of a file.
Writer = Callable[[], str]


@dataclass(frozen=True)
class Source:
    """The source of a lighting: a scene, light groups, or neither.

    stage: USD stage with lights named as in the scene.
    """

    scene: Scene | None = None
    light_groups: LightGroups | None = None
    stage: Path | None = None

    @property
    def files(self) -> list[Path]:
        """The files from which the source was read."""
        files = [] if self.stage is None else [self.stage]
        if self.scene is not None:
            files += self.scene.read_files
        return files + (self.light_groups.files if self.light_groups is not None else [])


@dataclass(frozen=True)
class ExportContext:
    """The answer that is exported, its source, and where its files go.

    folder: folder of the files. listen: receives remarks on what a format leaves out. maps: of
    image lights, which are files beside these.
    """

    lighting: Lighting
    source: Source
    folder: Path
    listen: Listener
    maps: Sequence[AnyMap] = ()


class ExportFormat(ABC):
    """A format.

    Attributes:
        name: Its name in commands and manifests.
        file: Name of its file for a scene.
        file_of_groups: The same for light groups; None if it has nothing for these.
        needs_source: Whether it needs the scene or the light groups of the lighting.
        refers_to_maps: Whether its file refers to maps of image lights.
        keeps_lighting: Whether it gets the lighting as it is; in others, lights whose colours the
            painting does not tell keep those of the scene.
    """

    name: str
    file: str
    file_of_groups: str | None = None
    needs_source: bool = True
    refers_to_maps: bool = False
    keeps_lighting: bool = False

    @abstractmethod
    def of_scene(self, export: ExportContext) -> Writer:
        """Return the writer for the lights of a scene."""

    def of_groups(self, export: ExportContext) -> Writer:
        """Return the writer for the multipliers of light groups."""
        raise NotImplementedError(self.name)

    def name_for(self, source: Source) -> str:
        """Return the name of the file. Raises LightpaintError for a source that is not enough."""
        if source.light_groups is not None:
            if self.file_of_groups is None:
                raise LightpaintError(
                    f"{self.name} needs a scene: give it with ",
                    Hint("scene"),
                    ", and leave ",
                    Hint("light_groups"),
                    " out",
                )
        elif source.scene is None and self.needs_source:
            raise LightpaintError(self.needed_source)
        return self.file if source.light_groups is None else str(self.file_of_groups)

    @property
    def needed_source(self) -> Sentence:
        """The text of the error for a missing source."""
        return Sentence(f"{self.name} needs the scene: give it with ", Hint("scene"))
