"""The sums of a one-pass render: of the whole film on the device or, of a large one, band by band.

The samples of a pixel are added in their order, whichever rows are traced at a time. So a film in
bands has the bits of one that is traced whole. Its sums lie in a file without a name, of which
memory holds a band, and its planes are made of them when they are asked for.
"""

import tempfile
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from lightpaint.arrays import Bools, Floats
from lightpaint.basis.file.file_planes import RowPlanes
from lightpaint.basis.file.temporary_array import TemporaryArray
from lightpaint.basis.render.half_sums import mean_and_half_difference
from lightpaint.basis.render.integrators import plane_count
from lightpaint.errors import SceneError
from lightpaint.scene.scene import Scene

if TYPE_CHECKING:
    from lightpaint.basis.render.tracer.one_pass import Tracer

#: Bytes of the sums of both halves up to which a film is traced whole, and bytes of a band of them.
WHOLE_MAX_BYTES, BAND_BYTES = 2**30, 2**27


def is_banded(scene: Scene) -> bool:
    """Return whether the sums of `scene` lie in a file while it is rendered in one pass."""
    height, width = scene.size
    return 2 * 12 * plane_count(scene) * height * width > WHOLE_MAX_BYTES


class FilmSums(ABC):
    """The sums of both halves of the samples of a film, whose rows are traced in bands.

    tracer: traces them. begun: samples per pixel of each half that come before.
    """

    def __init__(self, tracer: "Tracer", begun: int, band_rows: int) -> None:
        self._tracer, self._begun = tracer, begun
        height, self._width = tracer.scene.size
        tops = range(0, height, band_rows)
        self._bands = [range(top, min(top + band_rows, height)) for top in tops]
        #: Samples per pixel that are added, of each half and band.
        self._added = np.zeros((2, len(self._bands)), np.int64)

    @property
    def band_pixels(self) -> int:
        """Pixels that are traced at a time."""
        return len(self._bands[0]) * self._width

    @property
    def ahead(self) -> int:
        """Samples per pixel of a half that an interrupt has left some pixels ahead of others."""
        return int(self._added.max() - self._added.min())

    def add(self, first: int, spp: int, pause: Callable[[], None]) -> None:
        """Add samples of all pixels to both halves, except to pixels that have them already.

        first: samples of a half that come before. pause: called before each kernel.
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
        """Add samples of a band to a half."""

    @abstractmethod
    def seen(self) -> Bools:
        """Return where an emitter was seen, (h, w)."""


class WholeFilm(FilmSums):
    """Sums that the device holds, in a single band.

    start: those of both halves that they begin with, (planes, h, w, 3); None for zeros.
    """

    def __init__(
        self, tracer: "Tracer", begun: int, start: tuple[Floats, Floats] | None = None
    ) -> None:
        super().__init__(tracer, begun, tracer.scene.size[0])
        before = (None, None) if start is None else start
        self._halves = [tracer.planes(self._bands[0], sums) for sums in before]

    def _trace(self, half: int, rows: range, first: int, spp: int) -> None:
        self._tracer.add(self._halves[half], half, rows, first, spp)

    def seen(self) -> Bools:
        return np.asarray(np.add(*(planes.seen() for planes in self._halves)) > 0)

    def sums(self, *, is_last: bool) -> list[Floats]:
        """Return the sums of both halves, (planes, h, w, 3). is_last: whether they are released."""
        sums = []
        for half, planes in enumerate(self._halves):
            sums.append(planes.sums())
            if is_last:  # saves as much memory again
                self._halves[half] = self._tracer.planes(range(0))
        return sums


class BandedFilm(FilmSums):
    """Sums in a file, of which the device holds a band. start: as of `WholeFilm`.

    Raises SceneError if the disk has no room for them.
    """

    def __init__(
        self, tracer: "Tracer", begun: int, start: tuple[Floats, Floats] | None = None
    ) -> None:
        (height, width), planes = tracer.scene.size, plane_count(tracer.scene)
        super().__init__(tracer, begun, max(1, BAND_BYTES // (12 * planes * width)))
        self.sums = FileSums((2, planes, height, width, 3))
        self._seen = np.zeros((height, width), dtype=bool)
        for half, before in enumerate(start or ()):
            for rows in self._bands:
                self.sums.write(half, rows, before[:, rows.start : rows.stop])

    def _trace(self, half: int, rows: range, first: int, spp: int) -> None:
        planes = self._tracer.planes(rows, self.sums.read(half, rows))
        self._tracer.add(planes, half, rows, first, spp)
        self._seen[rows.start : rows.stop] |= planes.seen() > 0
        self.sums.write(half, rows, planes.sums())

    def seen(self) -> Bools:
        return self._seen.copy()

    def planes(self, spp: int) -> list[tuple["SumPlanes", "SumPlanes"]]:
        """Return images and half differences of all light and, where it is apart, indirect light.

        They are made of the sums as these are when they are asked for. spp: samples of a half.
        """
        sets = SumSets(self.sums, len(self._tracer.scene.lights), spp)
        return [(SumPlanes(sets, k), SumPlanes(sets, k + 1)) for k in range(0, sets.count, 2)]


class FileSums:
    """An array of zeros, (2, planes, h, w, 3) float32, in a temporary file.

    Memory releases the parts read and written at once. Raises SceneError if the disk has no room.
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        try:
            self._file = TemporaryArray(shape)
        except OSError as error:
            needed = 4 * int(np.prod(shape))
            raise SceneError(
                f"rendering needs {needed / 1e9:.1f} GB in {tempfile.gettempdir()} "
                f"({error.strerror or error}): set TMPDIR to a folder with more room, or use "
                "resolution=... or fewer lights"
            ) from error

    @property
    def array(self) -> Floats:
        """All sums, in their file."""
        return self._file.array

    def read(self, half: int, rows: range) -> Floats:
        """Return a copy of some rows of a half, (planes, rows, w, 3)."""
        block = np.array(self.array[half, :, rows.start : rows.stop])
        self._file.release()
        return block

    def write(self, half: int, rows: range, sums: Floats) -> None:
        """Write some rows of a half."""
        self.array[half, :, rows.start : rows.stop] = sums
        self._file.release()

    def halves(self, planes: slice, rows: slice) -> list[Floats]:
        """Return a copy of the sums of both halves of some planes and rows."""
        halves = [np.array(half[planes, rows]) for half in self.array]
        self._file.release()
        return halves


class SumSets:
    """The sets of planes computed from sums in a file.

    They are images and half differences of all light and, if separate, of indirect light.

    Callers request the planes of a light from one set after the other, so those of the last light
    are cached. lights: their number. spp: samples per pixel of each half.
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
            self._last = (-1, [])  # whose memory is free for the next
            planes = [rows[0] for rows in self.rows(slice(i, i + 1), slice(None))]
            self._last = (i, planes)
        return planes

    def rows(self, lights: slice, rows: slice) -> list[Floats]:
        """Return some rows of some lights in all sets, (lights, rows, w, 3) each."""
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
    """Planes made of the sums in a file when they are asked for. number: which of the sets."""

    def __init__(self, sets: SumSets, number: int) -> None:
        self._sets, self._number = sets, number

    @property
    def count(self) -> int:
        """n."""
        return self._sets.lights

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self._sets.size

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""
        return self._sets.of_light(i)[self._number]

    def rows(self, top: int, bottom: int) -> Floats:
        """Return some rows of all planes, (n, bottom - top, w, 3)."""
        rows = slice(max(top, 0), max(bottom, 0))
        return self._sets.rows(slice(0, self.count), rows)[self._number]
