"""The sums of a one-pass render, of the whole film on the device or, if it is large, band by band;
and the memory that a render needs.

The samples of a pixel are added in the same order whichever rows are traced together, so a film
traced in bands has the same bits as one traced whole, up to `BLOCK_SPP` samples. In bands, the sums
lie in a temporary file, memory holds one band at a time, and planes are computed from the sums on
request.
"""

import math
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from lightpaint.arrays import Bools, Floats
from lightpaint.basis.file.file_planes import RowPlanes, TemporaryArray
from lightpaint.basis.file.lit_planes import MIN_LIGHTS
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render.integrators import depth_limit, has_indirect_planes, plane_count
from lightpaint.basis.render.render_budget import BLOCK_SPP
from lightpaint.basis.render.rendered_basis import ONE_PASS, mean_and_half_difference, method_of
from lightpaint.errors import SceneError
from lightpaint.scene import SAMPLES_PER_PASS, Scene
from lightpaint.sentences import Hint

if TYPE_CHECKING:
    from lightpaint.basis.render.tracer.light_planes import LightPlanes
    from lightpaint.basis.render.tracer.one_pass import Tracer


#: Size of the sums of both halves, in bytes, up to which a film is traced whole; size of a band.
WHOLE_MAX_BYTES, BAND_BYTES = 2**30, 2**28

#: Bytes of a lit pixel of a light in memory, with its half difference; the share of the questions
#: to lights that find light no other has found, in halls of 256 and 1,000 lights (docs/scaling.md);
#: and the largest number of vertices after the first at which most paths still ask.
LIT_BYTES, FOUND_SHARE, USUAL_VERTICES = 16, 0.55, 6


def _is_banded(scene: Scene) -> bool:
    """Return whether a one-pass render of `scene` keeps its sums in a file."""
    height, width = scene.size
    return 2 * 12 * plane_count(scene) * height * width > WHOLE_MAX_BYTES


class FilmSums(ABC):
    """The sums of both halves of the samples of a film, traced in bands of rows.

    tracer: traces the samples. begun: samples per pixel of each half that were taken earlier.
    """

    def __init__(self, tracer: "Tracer", begun: int, band_rows: int) -> None:
        self._tracer, self._begun = tracer, begun
        height, self._width = tracer.scene.size
        tops = range(0, height, band_rows)
        self._bands = [range(top, min(top + band_rows, height)) for top in tops]
        #: Number of samples per pixel added so far, for each half and band.
        self._added = np.zeros((2, len(self._bands)), np.int64)

    @property
    def band_pixels(self) -> int:
        """Number of pixels that are traced at a time."""
        return len(self._bands[0]) * self._width

    @property
    def ahead(self) -> int:
        """Number of samples per pixel by which an interrupt left some pixels ahead of others."""
        return int(self._added.max() - self._added.min())

    def add(self, first: int, spp: int, pause: Callable[[], None]) -> None:
        """Add samples to both halves, skipping pixels that already have them.

        first: number of earlier samples of each half. pause: called before each kernel.
        """
        goal = first + spp - self._begun
        for half, added in enumerate(self._added):
            for k, rows in enumerate(self._bands):
                if (missing := goal - int(added[k])) > 0:
                    pause()
                    self._trace(half, rows, self._begun + goal - missing, missing)
                    added[k] = goal

    @abstractmethod
    def _trace(self, half: int, rows: range, first: int, spp: int) -> None:
        """Trace samples of a band and add them to a half."""

    @abstractmethod
    def seen(self) -> Bools:
        """Return the pixels in which an emitter was seen, (h, w)."""


class WholeFilm(FilmSums):
    """Sums on the device, in a single band.

    start: initial sums of both halves, (planes, h, w, 3); None for zeros.
    """

    def __init__(
        self, tracer: "Tracer", begun: int, start: tuple[Floats, Floats] | None = None
    ) -> None:
        super().__init__(tracer, begun, tracer.scene.size[0])
        start_sums = (None, None) if start is None else start
        self._halves = [self._planes(self._bands[0], sums) for sums in start_sums]
        if begun >= BLOCK_SPP:
            for planes in self._halves:
                planes.end_block()

    def _planes(self, rows: range, start: Floats | None = None) -> "LightPlanes":
        return self._tracer.planes(rows, start)

    def _trace(self, half: int, rows: range, first: int, spp: int) -> None:
        self._tracer.add(self._halves[half], half, rows, first, spp)

    def seen(self) -> Bools:
        return np.asarray(np.add(*(planes.seen() for planes in self._halves)) > 0)

    def sums(self, *, is_last: bool) -> list[Floats]:
        """Return the sums of both halves, (planes, h, w, 3). is_last: whether to release them."""
        sums = []
        for half, planes in enumerate(self._halves):
            sums.append(planes.sums(shares_memory=is_last))
            if is_last:  # halves the peak memory
                self._halves[half] = self._planes(range(0))
        return sums


class BandedFilm(FilmSums):
    """Sums in a file, of which the device holds one band. start: as in `WholeFilm`.

    Raises SceneError if the disk is full.
    """

    def __init__(
        self, tracer: "Tracer", begun: int, start: tuple[Floats, Floats] | None = None
    ) -> None:
        (height, width), planes = tracer.scene.size, plane_count(tracer.scene)
        super().__init__(tracer, begun, max(1, BAND_BYTES // (12 * planes * width)))
        self.sums = FileSums((2, planes, height, width, 3))
        self._seen = np.zeros((height, width), dtype=bool)
        for half, earlier_sums in enumerate(start or ()):
            for rows in self._bands:
                self.sums.write(half, rows, earlier_sums[:, rows.start : rows.stop])

    def _trace(self, half: int, rows: range, first: int, spp: int) -> None:
        start = self.sums.read(half, rows)
        planes = self._tracer.planes(rows, start)
        if first >= BLOCK_SPP:
            planes.end_block()
        self._tracer.add(planes, half, rows, first, spp)
        self._seen[rows.start : rows.stop] |= planes.seen() > 0
        self.sums.write(half, rows, planes.sums(shares_memory=True))

    def seen(self) -> Bools:
        return self._seen.copy()

    def planes(self, spp: int) -> list[tuple["SumPlanes", "SumPlanes"]]:
        """Return pairs of images and half differences: of all light and, if it is split, of
        indirect light.

        They are computed from the sums on request. spp: samples per pixel of each half.
        """
        return planes_of_sums(self.sums, len(self._tracer.scene.lights), spp)


class FileSums:
    """A float32 array, (2, planes, h, w, 3), initially zero, in a temporary file that is deleted
    with it.

    Raises SceneError if the disk is full.
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        try:
            self._file = TemporaryArray(shape)
        except OSError as error:
            needed_bytes = 4 * int(np.prod(shape))
            raise SceneError(
                f"rendering needs {needed_bytes / 1e9:.1f} GB in {tempfile.gettempdir()} "
                f"({error.strerror or error}): set TMPDIR to a folder with more room, or use ",
                Hint("resolution"),
                " or fewer lights",
            ) from error
        self._is_written = np.zeros((shape[0], shape[2]), dtype=bool)

    @property
    def array(self) -> Floats:
        """All sums, mapped from the file."""
        return self._file.array

    def read(self, half: int, rows: range) -> Floats | None:
        """Return a copy of some rows of one half, (planes, rows, w, 3); None if they are zero."""
        if not self._is_written[half, rows.start : rows.stop].any():
            return None
        return self._block(half, range(self.array.shape[1]), rows)

    def _block(self, half: int, planes: range, rows: range) -> Floats:
        block = np.empty((len(planes), len(rows), *self.array.shape[3:]), np.float32)
        for plane, into in zip(planes, block, strict=True):
            self._file.read(self._place(half, plane, rows), into)
        return block

    def _place(self, half: int, plane: int, rows: range) -> int:
        """Return the index of the first number of some rows, in row-major order."""
        _, planes, height, width, channels = self.array.shape
        return int(((half * planes + plane) * height + rows.start) * width * channels)

    def write(self, half: int, rows: range, sums: Floats) -> None:
        """Write some rows of one half, (planes, rows, w, 3)."""
        self._is_written[half, rows.start : rows.stop] = True
        for plane, of_plane in enumerate(sums):
            self._file.write(self._place(half, plane, rows), of_plane)

    def halves(self, planes: slice, rows: slice) -> list[Floats]:
        """Return a copy of the sums of both halves for some planes and rows."""
        _, count, height, _, _ = self.array.shape
        its_planes, its_rows = range(*planes.indices(count)), range(*rows.indices(height))
        return [self._block(half, its_planes, its_rows) for half in (0, 1)]


class SumSets:
    """The sets of planes computed from sums in a file: images and half differences of all light
    and, if it is split, of indirect light.

    The planes of the last light are kept, since callers request the same light from all sets in
    turn. lights: number of lights. spp: samples per pixel of each half.
    """

    def __init__(self, sums: FileSums, lights: int, spp: int) -> None:
        self._sums, self.lights, self._spp = sums, lights, spp
        _, planes, height, width, _ = sums.array.shape
        self.size = height, width
        #: Number of sets.
        self.count = 4 if planes > lights else 2
        self._last: tuple[int, list[Floats]] = (-1, [])

    def of_light(self, i: int) -> list[Floats]:
        """Return the planes of light i in all sets, (h, w, 3) each."""
        last, planes = self._last
        if last != i:
            del planes
            self._last = (-1, [])  # releases memory for the next ones
            planes = [rows[0] for rows in self.rows(slice(i, i + 1), slice(None))]
            self._last = (i, planes)
        return planes

    def rows(self, lights: slice, rows: slice) -> list[Floats]:
        """Return some rows of some lights from all sets, (lights, rows, w, 3) each."""
        total = self._sums.halves(lights, rows)
        if self.count == 2:
            return [*mean_and_half_difference(total, (self._spp, self._spp))]
        its_indirect = slice(self.lights + lights.start, self.lights + lights.stop)
        indirect = self._sums.halves(its_indirect, rows)
        for half, part in zip(total, indirect, strict=True):
            half += part
        pairs = [
            mean_and_half_difference(half, (self._spp, self._spp)) for half in (total, indirect)
        ]
        return [plane for pair in pairs for plane in pair]


class SumPlanes(RowPlanes):
    """Planes computed on request from sums in a file. number: index of the set."""

    def __init__(self, sets: SumSets, number: int) -> None:
        self._sets, self._number = sets, number
        self.count, self.size = sets.lights, sets.size

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""
        return self._sets.of_light(i)[self._number]

    def rows(self, top: int, bottom: int) -> Floats:
        """Return rows `top` to `bottom` of all planes, (n, bottom - top, w, 3)."""
        rows = slice(max(top, 0), max(bottom, 0))
        return self._sets.rows(slice(0, self.count), rows)[self._number]


def planes_of_sums(sums: FileSums, lights: int, spp: int) -> list[tuple[SumPlanes, SumPlanes]]:
    """Return pairs of images and half differences, computed on request: of all light and, if it is
    split, of indirect light. lights: number of lights. spp: samples per pixel of each half.
    """
    sets = SumSets(sums, lights, spp)
    return [(SumPlanes(sets, k), SumPlanes(sets, k + 1)) for k in range(0, sets.count, 2)]


def renders_in_bands(scene: Scene, start: Basis | None = None) -> bool:
    """Return whether `render_basis` keeps the sums of the film in a file and only a band in memory.

    start: the basis to continue. Without its exact sums, whole planes are needed.
    """
    can_be_read = start is None or start.sums is not None
    return can_be_read and method_of(scene) == ONE_PASS and _is_banded(scene)


def memory_needed(scene: Scene, *, in_bands: bool = False) -> int:
    """Return the peak memory of rendering a basis, in bytes, for any number of samples.

    in_bands: from `renders_in_bands`.
    """
    height, width = scene.size
    images = len(scene.lights) * height * width * 3 * 4
    if in_bands:
        # Half floats of images and half differences, and of indirect light; the remainder is for a
        # band.
        return images * plane_count(scene) // len(scene.lights) + 8 * BAND_BYTES
    # Sums of two halves, the images and half differences computed from them, and a copy of both
    # when they are written to a file; passes are small in comparison.
    sets = 12 if has_indirect_planes(scene) else 6
    return sets * images + 512 * SAMPLES_PER_PASS


def memory_expected(scene: Scene, spp: int) -> int:
    """Return about how many bytes rendering a basis takes; `memory_needed` is the upper bound.

    In memory, many lights are dark in most pixels: each path asks some of them alone. spp: samples
    per pixel.
    """
    from lightpaint.basis.render.tracer.one_pass import FIRST_EMITTER_SAMPLES, later_emitter_samples

    bound = memory_needed(scene, in_bands=renders_in_bands(scene))
    count, (height, width) = len(scene.lights), scene.size
    if count < MIN_LIGHTS or not renders_in_bands(scene):
        return bound
    later = min(max(depth_limit(scene.integrator) - 2, 0), USUAL_VERTICES)
    asked = spp * (FIRST_EMITTER_SAMPLES + later_emitter_samples(count) * later)
    lit = 1 - math.exp(-FOUND_SHARE * asked / count)
    return min(bound, round(count * height * width * LIT_BYTES * lit) + 3 * BAND_BYTES)


def check_memory(scene: Scene, *, in_bands: bool = False) -> None:
    """Raise SceneError if a basis of `scene` does not fit, before the system kills the process."""
    needed_bytes, free_bytes = memory_needed(scene, in_bands=in_bands), _free_memory()
    if free_bytes is not None and needed_bytes > free_bytes:
        height, width = scene.size
        raise SceneError(
            f"{len(scene.lights)} lights at {width}x{height} need {needed_bytes / 1e9:.1f} GB, and "
            f"{free_bytes / 1e9:.1f} GB are free: use ",
            Hint("resolution"),
            " or fewer lights",
        )


def _free_memory() -> int | None:
    """Return the bytes available without swapping; None where unknown (outside Linux)."""
    try:
        with open("/proc/meminfo", encoding="ascii") as lines:
            available = [line.split()[1] for line in lines if line.startswith("MemAvailable:")]
    except OSError:
        return None
    return int(available[0]) * 1024 if available else None
