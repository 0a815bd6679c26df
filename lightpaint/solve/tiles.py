"""Normal equations that follow the brush (Schoeneman et al. 1993, Eq 7, 8, 9).

The picture is cut into tiles, and M, b and ‖Ψ‖² are sums over them. A stroke makes some tiles
dirty, whose sums are formed anew: its cost is that of the tiles it touches. Nothing is ever
subtracted, so that nothing drifts: undoing a stroke gives back the very same bits, and an
updated problem is bit for bit the one built from scratch.
"""

import numpy as np
import numpy.typing as npt

from lightpaint.errors import SizeError
from lightpaint.images.exr import Floats
from lightpaint.solve.normal_equations import NormalEquations
from lightpaint.solve.threads import one_thread

#: Pixels along the side of a tile.
SIDE = 32

#: Bytes that the sums of all tiles may take; tiles are larger if they would take more.
ROOM = 2**28


class TiledEquations:
    """The problem of one basis, target and importance, updated in place.

    images: (n, h, w, 3); target: (h, w, 3); importance: (h, w), >= 0. The images are not
    copied, target and importance are.

    The sums of the tiles are the leaves of a binary tree whose nodes are the sums of their
    two children: a dirty tile costs its own sum and one addition per level, and the order of
    summation does not depend on what has been painted when.
    """

    def __init__(
        self, images: Floats, target: Floats, importance: Floats, *, side: int | None = None
    ) -> None:
        self._images = images
        n, height, width, _ = images.shape
        if target.shape != (height, width, 3) or importance.shape != (height, width):
            raise SizeError(
                f"target {target.shape} and importance {importance.shape} do not fit basis images "
                f"of {(height, width)}"
            )
        self._target = np.array(target)
        self._importance = np.array(importance)
        self.side = side_for(n, height, width) if side is None else side
        self._rows, self._columns = -(-height // self.side), -(-width // self.side)
        self._leaves = 1 << max(self._rows * self._columns - 1, 0).bit_length()
        # A node is (3, n + 1, n + 1): the target goes along as one more image. Node 1 is the root.
        self._nodes = np.zeros((2 * self._leaves, 3, n + 1, n + 1))
        self.update((slice(0, height), slice(0, width)))

    @property
    def equations(self) -> NormalEquations:
        """M, b and ‖Ψ‖² as they are now."""
        root = self._nodes[1]
        n = root.shape[1] - 1
        return NormalEquations(
            root[:, :n, :n].copy(), root[:, :n, n].copy(), root[:, n, n].copy()
        )

    def update(
        self,
        region: tuple[slice, slice],
        target: npt.ArrayLike | None = None,
        importance: npt.ArrayLike | None = None,
    ) -> None:
        """Paint over a rectangle: what is given replaces the target or the importance there.

        region: slices of rows and columns. target: (rows, columns, 3) or one colour;
        importance: (rows, columns) or one number. Raises ValueError for a negative or
        infinite importance.
        """
        if importance is not None:
            given = np.asarray(importance)
            if not (np.isfinite(given).all() and (given >= 0).all()):
                raise ValueError("importance is a finite weight >= 0 of each pixel")
            self._importance[region] = given
        if target is not None:
            self._target[region] = target
        rows = _tiles(region[0], self._importance.shape[0], self.side)
        columns = _tiles(region[1], self._importance.shape[1], self.side)
        dirty = {self._leaves + r * self._columns + c for r in rows for c in columns}
        with one_thread():
            for node in sorted(dirty):
                self._sum(node)
        while dirty and min(dirty) > 1:
            dirty = {node // 2 for node in dirty}
            for node in dirty:
                np.add(self._nodes[2 * node], self._nodes[2 * node + 1], out=self._nodes[node])

    def _sum(self, node: int) -> None:
        """Σ D f g over one tile, of all pairs of images and target."""
        row, column = divmod(node - self._leaves, self._columns)
        top, left = row * self.side, column * self.side
        where = slice(top, top + self.side), slice(left, left + self.side)
        weights = self._importance[where].ravel()
        counted = np.flatnonzero(weights)
        if counted.size == 0:
            self._nodes[node] = 0
            return
        n = len(self._images)
        root = np.sqrt(weights[counted].astype(np.float64))
        lit = self._images[(slice(None), *where)].reshape(n, -1, 3)
        painted = self._target[where].reshape(-1, 3)
        if counted.size < weights.size:
            # Pixels without weight are not read: they may hold anything.
            lit, painted = lit[:, counted], painted[counted]
        block = np.empty((3, n + 1, counted.size))
        np.multiply(lit.transpose(2, 0, 1), root, out=block[:, :n])
        np.multiply(painted.T, root, out=block[:, n])
        for c in range(3):
            np.matmul(block[c], block[c].T, out=self._nodes[node, c])


def side_for(n: int, height: int, width: int) -> int:
    """Pixels along the side of a tile: `SIDE`, or as many more as keep all sums within `ROOM`."""
    node_bytes = 3 * (n + 1) ** 2 * 8
    side = SIDE
    # There are at most four nodes for each tile, inner ones and unused leaves included.
    while 4 * node_bytes * -(-height // side) * -(-width // side) > ROOM and side < max(
        height, width
    ):
        side *= 2
    return side


def _tiles(along: slice, length: int, side: int) -> range:
    """Numbers of the tiles that a slice of pixels touches."""
    start, stop, step = along.indices(length)
    if step < 0:
        raise ValueError("a region is painted from its first row and column on")
    return range(start // side, -(-stop // side)) if stop > start else range(0)
