"""The storage of a process that works on a batch: parts of bases on disk, the rest in memory."""

import gc
import hashlib
import re
import shutil
import tempfile
import time
import zipfile
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis import Basis, read_basis
from lightpaint.basis.cache import PARTS, folder, is_trusted_owner
from lightpaint.basis.render import Part, PartRenderer
from lightpaint.batch.manifest.keys import Final
from lightpaint.batch.work import work_items
from lightpaint.errors import BasisError, OutputError
from lightpaint.files import first_line
from lightpaint.images import read_estimate
from lightpaint.pipeline import BasisFile, GroupsFile, SceneFile
from lightpaint.placement import read_placement
from lightpaint.scene import Scene, Stream, pass_sum, passes_of
from lightpaint.scene.quality_presets import on_film
from lightpaint.scene.runtime.render_lock import tracing
from lightpaint.target import Target
from lightpaint.version import __version__

#: Seconds after which leftover parts of a basis are deleted.
LEFTOVER_S = 7 * 86_400.0

#: Names of folders with the parts of one basis.
_NAME = re.compile("[0-9a-f]{32}")


class Spool:
    """Rendered parts of one basis. If the disk cannot store them, the render continues."""

    def __init__(
        self, scene: Scene, parts: Sequence[Part], *, seed: int, start: Basis | None
    ) -> None:
        start_origin = None if start is None else start.origin
        identity = (
            __version__,
            scene.identity,
            scene.sensor,
            seed,
            scene.size,
            start_origin,
            list(parts),
        )
        name = hashlib.sha256(repr(identity).encode()).hexdigest()[:32]
        try:
            self.folder = folder() / PARTS / name
            self._delete_leftovers()
            self.folder.mkdir(parents=True, exist_ok=True)
            if not is_trusted_owner(self.folder.stat()):
                raise PermissionError(f"{self.folder} is somebody else's")
        except (OSError, OutputError):
            self.folder = Path(tempfile.mkdtemp(prefix="lightpaint-"))

    @property
    def guide_file(self) -> Path:
        """Path of the guide's table."""
        return self.folder / "learned.npz"

    def guide_table(self) -> Floats | None:
        """Return the table of the emitter guide; None before it is trained."""
        try:
            return read_guide_table(str(self.guide_file))
        except BasisError:
            return None

    def keep_guide_table(self, table: Floats) -> None:
        """Store the table of the emitter guide. Raises OSError."""
        _write(self.guide_file, is_compressed=True, learned=table)

    def part(self, part: Part) -> tuple[Floats, Floats] | None:
        """Return the sums of a part; None if they are not stored, or damaged."""
        try:
            with np.load(self._file(part), allow_pickle=False) as arrays:
                return arrays["planes"], arrays["seen"]
        except (OSError, ValueError, KeyError, zipfile.BadZipFile):
            return None

    def keep_part(self, part: Part, planes: Floats, first_hits: Floats) -> None:
        """Store the sums of a part, if the disk can take them."""
        with suppress(OSError):
            _write(self._file(part), planes=planes, seen=first_hits)

    def drop(self) -> None:
        """Delete all parts once the basis is complete."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def _file(self, part: Part) -> Path:
        light = "" if part.light is None else f"-{part.light}-{part.half}"
        return self.folder / f"{part.top}-{part.first}{light}.npz"

    def _delete_leftovers(self) -> None:
        for leftover in self.folder.parent.glob("*"):
            if _NAME.fullmatch(leftover.name) is None:
                continue
            with suppress(OSError):
                if time.time() - leftover.stat().st_mtime > LEFTOVER_S:
                    shutil.rmtree(leftover, ignore_errors=True)


def read_guide_table(file: str) -> Floats:
    """Return the table of the emitter guide that `file` holds. Raises BasisError."""
    try:
        with np.load(file, allow_pickle=False) as arrays:
            table: Floats = arrays["learned"]
            return table
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise BasisError(f"cannot read {file}: {first_line(error)}") from error


def _write(file: Path, *, is_compressed: bool = False, **arrays: Any) -> None:
    """Write all arrays to `file`, or nothing."""
    temporary = file.with_name(f".{file.name}.half")
    with temporary.open("wb") as stream:
        (np.savez_compressed if is_compressed else np.savez)(stream, **arrays)
    temporary.replace(file)


class PassRenderer:
    """A renderer of passes of one relit scene, which stays loaded until `close`.

    The sums of all ranges of passes equal the sums of one render to the last bit.
    """

    def __init__(self, scene: Scene, final: Final) -> None:
        self._scene, self._final = scene, final
        self._passes = passes_of(scene, final.spp)
        with scene.variant():
            self._loaded_scene: Any = scene.load()

    def sum(self, passes: range) -> dict[int, Doubles]:
        """Return the undivided sums, (h, w, 3), of the given passes for each half, by the half."""
        sums: dict[int, Doubles] = {}
        seed, stream = self._final.seed, Stream.VERIFICATION
        with self._scene.variant(), tracing() as let_others_through:
            for k in passes:
                half, spp = self._passes[k]
                pass_total = pass_sum(
                    self._loaded_scene, self._scene, k, spp, seed=seed, stream=stream
                )
                sums[half] = sums[half] + pass_total if half in sums else pass_total
                let_others_through()
        return sums

    def close(self) -> None:
        """Release the scene."""
        self._loaded_scene = None
        gc.collect()


class WorkerCache:
    """Scenes and bases that several looks share; this process loads or renders each once."""

    def __init__(self) -> None:
        self._scenes: dict[str, SceneFile] = {}
        self._sources: dict[str, BasisFile | GroupsFile] = {}
        self._bases: dict[str, Basis] = {}
        self._renderer: PartRenderer | PassRenderer | None = None
        self._renderer_key = ""
        self._targets: dict[str, Target] = {}

    def scene(self, file: SceneFile) -> SceneFile:
        """Return the shared scene file that equals `file`; its first use loads it."""
        return self._scenes.setdefault(repr(file), file)

    def source(self, file: BasisFile | GroupsFile) -> BasisFile | GroupsFile:
        """Return the shared basis or light groups that equal `file`; the first use reads them."""
        return self._sources.setdefault(repr(file), file)

    def basis(self, key: str) -> Basis | None:
        """Return the basis of a key, if it is stored here. key: of `key_of_scene`."""
        return self._bases.get(key)

    def put(self, key: str, basis: Basis) -> None:
        """Store the basis of a key."""
        self._bases[key] = basis

    def load(self, key: str, file: str, former_look_file: str = "") -> None:
        """Load the basis of a key from a file that was written for workers.

        former_look_file: the picture before lights were moved; "" if none was.
        """
        if file and key not in self._bases:
            basis = read_basis(file)
            look = read_estimate(Path(former_look_file))[0] if former_look_file else None
            self._bases[key] = replace(basis, former=look)

    def film(self, film: work_items.SceneFilm) -> Scene:
        """Return the scene on a film."""
        scene = on_film(self.scene(film.scene).content, film.quality, film.resolution)
        if film.places:
            [scene] = read_placement(Path(film.places)).hung_in([scene]).scenes
        return scene.only(film.light_names) if film.light_names else scene

    def renderer(self, item: work_items.PartOfBasis | work_items.SumsOfRows) -> PartRenderer:
        """Return the renderer of a part; it stays loaded until an item of another basis comes."""
        key = repr((item.film.key, item.seed, item.guide_file))
        if not isinstance(self._renderer, PartRenderer) or self._renderer_key != key:
            self.release_renderer()
            scene = self.film(item.film)
            guide_table = read_guide_table(item.guide_file) if item.guide_file else None
            self._renderer, self._renderer_key = PartRenderer(scene, item.seed, guide_table), key
        return self._renderer

    def frame(self, item: work_items.Passes) -> PassRenderer:
        """Return the renderer of passes; it stays loaded until another scene's item comes."""
        key = repr((item.relit, item.final, item.observer))
        if not isinstance(self._renderer, PassRenderer) or self._renderer_key != key:
            self.release_renderer()
            scene = self.film(work_items.SceneFilm(item.relit, None, item.final.resolution))
            if item.observer is not None:
                scene = replace(scene, is_spectral=True, observer=item.observer)
            self._renderer, self._renderer_key = PassRenderer(scene, item.final), key
        return self._renderer

    def target(self, request: work_items.PaintingOfSums, size: tuple[int, int]) -> Target:
        """Return a painting at the size of its basis, read once."""
        key = repr((request, size))
        if key not in self._targets:
            read = request.painting.without_content().content
            self._targets[key] = read.fitted_to(size, resize=request.resize)
        return self._targets[key]

    def release_renderer(self) -> None:
        """Release the renderer of parts or passes."""
        if self._renderer is not None:
            self._renderer.close()
        self._renderer = None
        self._targets = {}

    def keep_only(self, keys: Collection[str]) -> None:
        """Release all bases but the bases of these keys."""
        self._bases = {key: basis for key, basis in self._bases.items() if key in keys}
        self._sources = {
            k: x for k, x in self._sources.items() if work_items.key_of_basis(x) in keys
        }
