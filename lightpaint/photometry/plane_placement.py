"""Places the points of measuring planes in a scene: over floors, on walls, between corners.

The spacing of a grid follows EN 12464-1, whose largest size of a cell is p = 0.2 · 5^lg d metres
for a side of d metres, unless another spacing is given. Points are the centres of cells.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices, Position
from lightpaint.display_text import with_similar_name
from lightpaint.errors import SceneError
from lightpaint.photometry.illuminance import MeasuringPlane, Wishes
from lightpaint.photometry.room_rays import RoomRays

#: Maximum number of points of a plane, and of cells that are tried for it.
MAX_POINTS, MAX_CELLS = 20_000, 200_000

#: Largest spacing of a grid by EN 12464-1, in metres.
LARGEST_SPACING = 10.0

#: Distance in metres within which something over a surface covers its points.
COVER_M = 0.05
#: Directions in which the distance to walls is measured, and their least height in metres.
WALL_DIRECTIONS, WALL_M = 16, 1.5

#: Rays along each axis that find which way a surface faces.
FACING_RAYS = 256
#: Distance in metres above a shape at which rays towards it start.
STEP_M = 0.01

#: Cosine of normal and up below which a plane is upright, and sine below which it is level.
UPRIGHT, LEVEL_SINE = 1e-3, 0.01

CYLINDRICAL = "cylindrical"


@dataclass(frozen=True)
class PlaneRequest:
    """A measuring plane as a planes file describes it.

    where: the key in the file, for errors. shapes: ids of shapes whose upper sides are a floor.
    walls: ids of surfaces on which the points lie. corners: (3 or 4, 3). points: (p, 3). Exactly
    one of these four is given. normal: the direction in which illuminance is measured, if it is not
    the normal of the plane. height, margin, grid: in metres.
    """

    name: str
    where: str
    shapes: tuple[str, ...] = ()
    walls: tuple[str, ...] = ()
    corners: Doubles | None = None
    points: Doubles | None = None
    normal: Position | Literal["cylindrical"] | None = None
    height: float = 0.0
    margin: float = 0.0
    grid: float | None = None
    wishes: Wishes = field(default_factory=Wishes)


@dataclass(frozen=True)
class _Cells:
    """Cells of a rectangle or a quadrilateral.

    points: (p, 3), their centres. normals: (p, 3). cells: (p, 2), row and column. sides: (p, 2, 3),
    of each cell, across and along; zero for listed points. spacing, area: metres between
    neighbours, and square metres of a cell. covered_by: ids of the shapes that cover points which
    were left out, one for each.
    """

    points: Doubles
    normals: Doubles
    cells: Indices
    sides: Doubles
    spacing: float
    area: float
    covered_by: tuple[str, ...] = ()

    def only(self, is_kept: Bools) -> "_Cells":
        """Return the cells that are kept."""
        return replace(
            self,
            points=self.points[is_kept],
            normals=self.normals[is_kept],
            cells=self.cells[is_kept],
            sides=self.sides[is_kept],
        )


def place_plane(request: PlaneRequest, room: RoomRays) -> MeasuringPlane:
    """Return the measuring plane with its points. Raises SceneError if no point is left."""
    if request.points is not None:
        grid = _listed(request.points, room)
    elif request.corners is not None:
        grid = _between_corners(request, room)
    elif request.shapes:
        grid = _over_floor(request, room)
    else:
        grid = _side_by_side([_on_wall(request, name, room) for name in request.walls])
    if (count := len(grid.points)) > MAX_POINTS:
        raise SceneError(
            f"{request.where} has {count} points: expected at most {MAX_POINTS}; give it a wider "
            "grid"
        )
    grid = _without_solids(request, grid, room)
    count = len(grid.points)
    cells = grid.cells - grid.cells.min(axis=0)
    rows, columns = (int(v) + 1 for v in cells.max(axis=0))
    normals, is_cylindrical = _directions_of(request, grid.normals, room)
    is_whole = request.points is None and rows * columns == count
    return MeasuringPlane(
        request.name,
        grid.points,
        normals,
        grid.spacing,
        count * grid.area,
        (rows, columns) if is_whole else None,
        cells,
        request.wishes,
        is_cylindrical,
        covered_by=grid.covered_by,
        sides=None if request.points is not None else grid.sides,
    )


def cell_counts(sides: tuple[float, float], grid: float | None) -> tuple[int, int]:
    """Return the numbers of cells along two sides in metres.

    grid: distance of the points in metres; None for the rule of EN 12464-1. There d is the longer
    side or, if that is twice the other or more, the shorter one, and it has d / p cells, rounded.
    """
    spacing = grid
    if spacing is None:
        longer, shorter = max(sides), min(sides)
        d = longer if longer < 2 * shorter else shorter
        largest = min(0.2 * 5 ** math.log10(d), LARGEST_SPACING)
        spacing = d / max(1, round(d / largest))
    first, second = (max(1, round(side / spacing)) for side in sides)
    return first, second


def _listed(points: Doubles, room: RoomRays) -> _Cells:
    """Return listed points, which are measured from above."""
    cells = np.stack([np.zeros(len(points), int), np.arange(len(points))], axis=1)
    ups = np.tile(room.up, (len(points), 1))
    return _Cells(points, ups, cells, np.zeros((len(points), 2, 3)), 0.0, 0.0)


def _rectangle(
    request: PlaneRequest, corner: Doubles, across: Doubles, along: Doubles, normal: Doubles
) -> _Cells:
    """Return the cells of a parallelogram. corner: of it. across, along: its sides."""
    sides = float(np.linalg.norm(across)), float(np.linalg.norm(along))
    columns, rows = cell_counts(sides, request.grid)
    if rows * columns > MAX_CELLS:
        raise SceneError(
            f"{request.where} has a grid of {columns}x{rows} cells: expected at most {MAX_CELLS}; "
            "give it a wider grid"
        )
    row, column = (x.ravel() for x in np.mgrid[:rows, :columns])
    u, v = (column + 0.5) / columns, (row + 0.5) / rows
    points = corner + np.outer(u, across) + np.outer(v, along)
    area = float(np.linalg.norm(np.cross(across, along))) / (rows * columns)
    spacing = max(sides[0] / columns, sides[1] / rows)
    cells = np.stack([row, column], axis=1)
    cell_sides = np.tile([across / columns, along / rows], (len(points), 1, 1))
    return _Cells(points, np.tile(normal, (len(points), 1)), cells, cell_sides, spacing, area)


def _between_corners(request: PlaneRequest, room: RoomRays) -> _Cells:
    """Return the grid of a parallelogram or a quadrilateral."""
    assert request.corners is not None
    a, b, c = request.corners[:3]
    d = request.corners[3] if len(request.corners) == 4 else a + c - b
    normal = np.cross(c - a, d - b)
    if not (length := float(np.linalg.norm(normal))) > 1e-9:
        raise SceneError(f"{request.where}.corners lie on one line: expected corners of an area")
    normal = _turned(normal / length, (a + b + c + d) / 4, room)
    # The lines between the middles of opposite sides are as long as these in the mean.
    across, along = (b + c - a - d) / 2, (c + d - a - b) / 2
    if abs((d - a) @ normal) + abs((c - a) @ normal) > 1e-3 * float(np.linalg.norm(c - a)):
        raise SceneError(f"{request.where}.corners do not lie in one plane")
    grid = _rectangle(request, a, across, along, normal)
    if len(request.corners) == 3:
        return grid
    # The cells of the square that is mapped to the corners, with the cells' mean area.
    rows, columns = grid.cells.max(axis=0) + 1
    v, u = ((grid.cells + 0.5) / (rows, columns)).T
    points = (
        np.outer((1 - u) * (1 - v), a)
        + np.outer(u * (1 - v), b)
        + np.outer(u * v, c)
        + np.outer((1 - u) * v, d)
    )
    # The derivatives of that map by column and row.
    across_cell = (np.outer(1 - v, b - a) + np.outer(v, c - d)) / columns
    along_cell = (np.outer(1 - u, d - a) + np.outer(u, c - b)) / rows
    area = 0.5 * float(np.linalg.norm(np.cross(c - a, d - b))) / len(points)
    sides = np.stack([across_cell, along_cell], axis=1)
    return replace(grid, points=points, sides=sides, area=area)


def _turned(normal: Doubles, middle: Doubles, room: RoomRays) -> Doubles:
    """Return the normal of a plane on its upper side or, if it is upright, towards the camera."""
    height = float(normal @ room.up)
    side = height if abs(height) > UPRIGHT else float((room.eye - middle) @ normal)
    return normal if side >= 0 else -normal


def _over_floor(request: PlaneRequest, room: RoomRays) -> _Cells:
    """Return the grid over the upper sides of shapes, as far as these are there."""
    shapes = [k for name in request.shapes for k in _shapes_named(request, "shape", name, room)]
    grid = _on_surface(request, shapes, room.up, room)
    lifted = grid.points + request.height * room.up
    _check_height(request, grid.points, lifted, room)
    return _kept_from_walls(request, replace(grid, points=lifted), room)


def _on_wall(request: PlaneRequest, name: str, room: RoomRays) -> _Cells:
    """Return the grid on a surface, on the side that the camera is on."""
    shapes = _shapes_named(request, "walls", name, room)
    low, high = room.box(shapes)
    normal = _facing(shapes, room)
    normal = normal if (room.eye - (low + high) / 2) @ normal >= 0 else -normal
    grid = _on_surface(request, shapes, normal, room)
    return _without_covered(grid, room)


def _facing(shapes: Sequence[int], room: RoomRays) -> Doubles:
    """Return the direction, up to its sign, that most of the surface of shapes faces, (3,)."""
    low, high = room.box(shapes)
    # Evenly spread places in the box, from which rays along all axes find the surface.
    steps = np.outer(np.arange(FACING_RAYS), (0.8191725134, 0.6710436067, 0.5497004779))
    places = low + (high - low) * ((0.5 + steps) % 1)
    normals = []
    for direction in np.concatenate([np.eye(3), -np.eye(3)]):
        is_hit, _, found = room.hits_of(shapes, places - 2 * room.size * direction, direction)
        normals.append(found[is_hit])
    every = np.concatenate(normals)
    return np.asarray(np.linalg.eigh(every.T @ every)[1][:, -1])


def _on_surface(
    request: PlaneRequest, shapes: Sequence[int], normal: Doubles, room: RoomRays
) -> _Cells:
    """Return the points of a grid on the side of shapes that faces `normal`."""
    across, along = _sides(normal, room.up)
    low, high = room.box(shapes)
    corners = np.array([[low[0], high[0]], [low[1], high[1]], [low[2], high[2]]])
    box = np.stack(np.meshgrid(*corners), axis=-1).reshape(-1, 3)
    u, v, w = box @ across, box @ along, box @ normal
    margin = request.margin
    widths = np.array([np.ptp(u), np.ptp(v)]) - 2 * margin
    if not (widths > 0).all():
        raise SceneError(
            f"{request.where}: a margin of {margin:g} leaves nothing of {np.ptp(u):.2f} x "
            f"{np.ptp(v):.2f} m"
        )
    corner = (u.min() + margin) * across + (v.min() + margin) * along
    corner = corner + (w.max() + STEP_M) * normal
    grid = _rectangle(request, corner, widths[0] * across, widths[1] * along, normal)
    is_hit, places, _ = room.hits_of(shapes, grid.points, -normal)
    if margin > 0:
        for angle in 2 * np.pi * np.arange(WALL_DIRECTIONS) / WALL_DIRECTIONS:
            offset = 0.999 * margin * (math.cos(angle) * across + math.sin(angle) * along)
            is_hit &= room.hits_of(shapes, grid.points + offset, -normal)[0]
    return replace(grid, points=places).only(is_hit)


def _sides(normal: Doubles, up: Doubles) -> tuple[Doubles, Doubles]:
    """Return the directions to the right and upwards in a picture of a plane, (3,) each.

    It is seen from the side of its normal: a wall as it stands, a floor along the scene's axes.
    """
    right = np.cross(up, normal)
    if float(np.linalg.norm(right)) < LEVEL_SINE:
        right = np.eye(3)[1 if abs(up[0]) > LEVEL_SINE else 0]
        right = right - (right @ normal) * normal
    right = right / np.linalg.norm(right)
    return right, np.cross(normal, right)


def _kept_from_walls(request: PlaneRequest, grid: _Cells, room: RoomRays) -> _Cells:
    """Return the points that are `margin` away from walls: upright parts of shapes that are at
    least `WALL_M` high.
    """
    grid = grid if request.height >= COVER_M else _without_covered(grid, room)
    if not request.margin or not len(grid.points):
        return grid
    across, along = _sides(room.up, room.up)
    heights = np.array([float(np.ptp(box @ room.up)) for box in room.boxes])
    walls = np.flatnonzero(heights >= WALL_M)
    is_far = np.ones(len(grid.points), bool)
    for angle in 2 * np.pi * np.arange(WALL_DIRECTIONS) / WALL_DIRECTIONS:
        direction = math.cos(angle) * across + math.sin(angle) * along
        origins = grid.points + STEP_M * room.up
        hits = room.first_hits(origins, np.tile(direction, (len(origins), 1)))
        is_wall = np.isin(hits.shape, walls) & (np.abs(hits.normal @ room.up) < 0.5)
        is_far &= ~(is_wall & (hits.distance < 0.999 * request.margin))
    return grid.only(is_far)


def _without_covered(grid: _Cells, room: RoomRays) -> _Cells:
    """Return the points of a surface that nothing covers closely."""
    if not len(grid.points):
        return grid
    hits = room.first_hits(grid.points + 1e-4 * grid.normals, grid.normals)
    is_covered = hits.distance <= COVER_M
    names = tuple(room.names[k] for k in hits.shape[is_covered].tolist())
    return replace(grid.only(~is_covered), covered_by=(*grid.covered_by, *names))


def _check_height(request: PlaneRequest, surface: Doubles, lifted: Doubles, room: RoomRays) -> None:
    """Raise SceneError if points lie above a ceiling, and above everything else, too."""
    top = float((room.bounds @ room.up).max())
    if not len(surface) or float((lifted @ room.up).min()) <= top + STEP_M:
        return
    ups = np.tile(room.up, (len(surface), 1))
    is_roofed = room.first_hits(surface + STEP_M * ups, ups).distance < request.height
    if is_roofed.mean() > 0.5:
        raise SceneError(
            f"{request.where}.height is {request.height:g}, outside of the room: the highest thing "
            f"in the scene is {top - float((surface @ room.up).min()):.2f} above the surface"
        )


def _without_solids(request: PlaneRequest, grid: _Cells, room: RoomRays) -> _Cells:
    """Return the points that lie in no solid. Raises SceneError if none is left."""
    if not len(grid.points):
        raise SceneError(
            f"{request.where} has no point: check its surface, its margin of {request.margin:g} "
            "and what stands there"
        )
    lifted = grid.points + 1e-3 * grid.normals
    is_inside = room.are_inside_solids(lifted, grid.normals)
    if is_inside.all():
        raise SceneError(
            f"{request.where} lies inside of a solid: all {len(grid.points)} points see only the "
            "back sides of surfaces"
        )
    return grid.only(~is_inside)


def _directions_of(request: PlaneRequest, normals: Doubles, room: RoomRays) -> tuple[Doubles, bool]:
    """Return the directions of measurement, (p, 3), and whether they are axes of cylinders."""
    if request.normal is None:
        return normals, False
    if request.normal == CYLINDRICAL:
        return np.tile(room.up, (len(normals), 1)), True
    direction = np.array(request.normal, float)
    return np.tile(direction / np.linalg.norm(direction), (len(normals), 1)), False


def _side_by_side(grids: Sequence[_Cells]) -> _Cells:
    """Return several grids as one, with their cells beside each other and a gap between."""
    column, cells = 0, []
    for grid in grids:
        cells.append(grid.cells + np.array([0, column]))
        column = int(cells[-1][:, 1].max(initial=column)) + 2
    areas = [np.full(len(grid.points), grid.area) for grid in grids]
    return _Cells(
        np.concatenate([grid.points for grid in grids]),
        np.concatenate([grid.normals for grid in grids]),
        np.concatenate(cells),
        np.concatenate([grid.sides for grid in grids]),
        max(grid.spacing for grid in grids),
        float(np.concatenate(areas).mean()) if sum(map(len, areas)) else 0.0,
        covered_by=tuple(name for grid in grids for name in grid.covered_by),
    )


def _shapes_named(request: PlaneRequest, key: str, name: str, room: RoomRays) -> list[int]:
    """Return the indices of shapes. Raises SceneError if there is none of that name."""
    if found := room.indices(name):
        return found
    known = sorted({x for x in room.names if x})
    listing = with_similar_name(f"the scene has {', '.join(known[:20])}", name, known)
    raise SceneError(f"{request.where}.{key}: no shape {name!r}: {listing}")
