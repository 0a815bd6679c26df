"""The files of a scene: which it reads, what was changed in them, and what stands in them."""

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path

from lightpaint.arrays import Floats
from lightpaint.scene.lights.emitters import Emitter
from lightpaint.scene.lights.lights_file import lights_file_beside
from lightpaint.scene.properties.emission import read_emitted_image
from lightpaint.scene.scene_inspection import shape_names
from lightpaint.scene.scene_tree import ParsedScene


class SceneFiles:
    """The files of a `Scene`, which has these attributes and describes them."""

    path: Path
    files: tuple[Path, ...]
    lights_file: Path | None
    parsed: ParsedScene

    @property
    def moved_elements(self) -> tuple[tuple[Path, int, Mapping[str, str]], ...]:
        """Elements in the files that `moved` changed.

        For each: its file, the byte offset of its `<`, and the child elements to set, as XML by
        name.
        """
        nodes = self.parsed.state.nodes
        return tuple(
            (self.files[nodes[k].file_index], int(nodes[k].offset) - 1, children)
            for k, children in self.parsed.moved.items()
        )

    @property
    def originals(self) -> tuple[Path, ...]:
        """All files of the scene: XML, meshes, textures, tables."""
        return (*self.files, *self.parsed.assets())

    @property
    def read_files(self) -> tuple[Path, ...]:
        """`originals`, and the lights file if there is one."""
        return (*self.originals, *([] if self.lights_file is None else [self.lights_file]))

    @property
    def places(self) -> frozenset[Path]:
        """Paths of its files, and of files that would change the scene if they existed."""
        lights_path = self.lights_file or lights_file_beside(self.path)
        return frozenset({*self.parsed.places(), lights_path})

    @cached_property
    def shape_names(self) -> tuple[str, ...]:
        """Names of the shapes, in the order of a loaded scene."""
        return shape_names(self.parsed)

    @property
    def replaced_integrators(self) -> tuple[tuple[Path, int], ...]:
        """The integrators that `instead` replaces: file, and byte offset of the element."""
        return tuple((self.files[file], offset) for file, offset in self.parsed.replaced)

    def emitted_image(self, emitter: Emitter) -> Floats:
        """Return the image that `emitter` emits, (h, w, 3) linear Rec.709, without its scale."""
        assert emitter.kind is not None
        return read_emitted_image(*self.parsed.image_file(emitter.node, emitter.kind.parameter))
