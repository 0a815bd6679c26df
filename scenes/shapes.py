"""Shapes for the example scenes: triangle meshes from formulas, in numpy alone.

Every function returns a `Mesh`; `write_ply` puts one on disk in the binary form that Mitsuba
reads fastest, and `write_png` does the same for a texture. Lengths are in metres, y is up.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


@dataclass(frozen=True)
class Mesh:
    """Triangles with smooth shading.

    points, normals: (v, 3), metres and unit vectors; faces: (f, 3) vertex indices,
    counter-clockwise seen from outside; uv: (v, 2) texture coordinates, or None.
    """

    points: Floats
    normals: Floats
    faces: Ints
    uv: Floats | None = None

    def placed(self, at: ArrayLike = (0, 0, 0), *, turn: float = 0.0, scale: float = 1.0) -> Mesh:
        """The mesh scaled, turned about y by `turn` degrees (+z towards +x), moved to `at`."""
        c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
        rotation = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        points = scale * self.points @ rotation.T + np.asarray(at, float)
        return Mesh(points, self.normals @ rotation.T, self.faces, self.uv)

    def mirrored(self) -> Mesh:
        """The mesh with left and right (x) exchanged."""
        flip = np.array([-1.0, 1.0, 1.0])
        return Mesh(self.points * flip, self.normals * flip, self.faces[:, ::-1], self.uv)


def join(meshes: Sequence[Mesh]) -> Mesh:
    """Several meshes as one; either all have texture coordinates or the result has none."""
    starts = np.cumsum([0] + [len(m.points) for m in meshes[:-1]])
    faces = [m.faces + start for m, start in zip(meshes, starts, strict=True)]
    uvs = [m.uv for m in meshes if m.uv is not None]
    return Mesh(
        np.concatenate([m.points for m in meshes]),
        np.concatenate([m.normals for m in meshes]),
        np.concatenate(faces).astype(np.int32),
        np.concatenate(uvs) if len(uvs) == len(meshes) else None,
    )


def grid_faces(rows: int, columns: int) -> Ints:
    """Two triangles per cell of a (rows, columns) grid of vertices; returns (f, 3)."""
    corner = np.arange(rows * columns, dtype=np.int32).reshape(rows, columns)
    a, b = corner[:-1, :-1], corner[:-1, 1:]
    c, d = corner[1:, 1:], corner[1:, :-1]
    cells = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], -2)
    return cells.reshape(-1, 3)


def sheet(points: Floats, uv: Floats | None = None) -> Mesh:
    """A smooth surface through a grid of points, shaded by the grid's own gradients.

    points: (rows, columns, 3); uv: (rows, columns, 2). The front is where columns run to the
    right and rows run up.
    """
    normals = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
    flat_uv = None if uv is None else uv.reshape(-1, 2)
    faces = grid_faces(*points.shape[:2])
    return Mesh(points.reshape(-1, 3), normals.reshape(-1, 3), faces, flat_uv)


def facets(quads: ArrayLike, uv: ArrayLike | None = None) -> Mesh:
    """Flat four-sided faces. quads: (q, 4, 3), counter-clockwise from outside; uv: (q, 4, 2)."""
    corners = np.asarray(quads, float)
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-12)
    first = 4 * np.arange(len(corners), dtype=np.int32)[:, None, None]
    faces = (first + np.array([[0, 1, 2], [0, 2, 3]], np.int32)).reshape(-1, 3)
    flat_uv = None if uv is None else np.asarray(uv, float).reshape(-1, 2)
    return Mesh(corners.reshape(-1, 3), np.repeat(normal, 4, axis=0), faces, flat_uv)


def rounded_box(size: Sequence[float], *, radius: float, steps: int = 2) -> Mesh:
    """A box standing on y = 0 whose edges are rounded with `radius`.

    Each face is a grid on the cube [-1, 1]^3. A grid point is drawn to the nearest point of
    the inner box (the box less `radius` on every side) and pushed out again along the normal.
    """
    half = np.asarray(size, float) / 2
    inner = half - radius
    # Grid lines: `steps` over each rounded edge, none over the flat middle.
    bend = np.tan(np.linspace(0, np.pi / 4, steps + 1))
    line = np.concatenate([-bend[::-1], bend])
    u, v = np.meshgrid(line, line, indexing="ij")
    side = np.repeat([-1.0, 1.0], steps + 1)
    su, sv = np.meshgrid(side, side, indexing="ij")
    points: list[Floats] = []
    normals: list[Floats] = []
    faces: list[Ints] = []
    for axis, sign in product(range(3), (-1.0, 1.0)):
        first, second = (axis + 1) % 3, (axis + 2) % 3
        out, centre = np.zeros((*u.shape, 3)), np.zeros((*u.shape, 3))
        out[..., axis], out[..., first], out[..., second] = sign, u, v
        centre[..., axis] = sign * inner[axis]
        centre[..., first], centre[..., second] = su * inner[first], sv * inner[second]
        normal = out / np.linalg.norm(out, axis=-1, keepdims=True)
        # grid_faces walks (first, second) the wrong way round for an outward +axis face.
        quads = grid_faces(*u.shape)
        faces.append((quads[:, ::-1] if sign > 0 else quads) + len(points) * u.size)
        points.append((centre + radius * normal).reshape(-1, 3))
        normals.append(normal.reshape(-1, 3))
    lifted = np.concatenate(points) + np.array([0.0, half[1], 0.0])
    return Mesh(lifted, np.concatenate(normals), np.concatenate(faces))


def curve(knots: ArrayLike, count: int) -> Floats:
    """`count` points on the Catmull-Rom curve through knots (k, d); returns (count, d)."""
    through = np.asarray(knots, float)
    before, after = 2 * through[:1] - through[1:2], 2 * through[-1:] - through[-2:-1]
    padded = np.concatenate([before, through, after])
    place = np.linspace(0, len(through) - 1, count)
    k = np.minimum(place.astype(int), len(through) - 2)
    t = (place - k)[:, None]
    p0, p1, p2, p3 = padded[k], padded[k + 1], padded[k + 2], padded[k + 3]
    cubic = 2 * p0 - 5 * p1 + 4 * p2 - p3 + t * (3 * (p1 - p2) + p3 - p0)
    through_knots: Floats = p1 + 0.5 * t * (p2 - p0 + t * cubic)
    return through_knots


def lathe(profile: ArrayLike, *, rings: int = 33, turns: int = 32) -> Mesh:
    """Turn a profile about the y axis.

    profile: (p, 2) of (radius, height), from the top down; smoothed by `curve` to `rings`
    points. Normals are the curve's own, so that the shading is smooth.
    """
    outline = curve(profile, rings)
    tangent = np.gradient(outline, axis=0)
    across = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
    angle = np.linspace(0, 2 * np.pi, turns + 1)
    radial = np.stack([np.cos(angle), np.zeros_like(angle), np.sin(angle)], axis=1)
    up = np.array([0.0, 1.0, 0.0])

    def spin(plane: Floats) -> Floats:
        """(rings, 2) in the profile's plane -> (rings * (turns + 1), 3)."""
        ring: Floats = plane[:, :1, None] * radial + plane[:, 1:, None] * up
        return ring.reshape(-1, 3)

    return Mesh(spin(outline), spin(across), grid_faces(rings, turns + 1))


def ball(radius: float, *, rings: int = 33, turns: int = 48) -> Mesh:
    """A sphere resting on y = 0."""
    theta = np.linspace(0, np.pi, rings)
    mesh = lathe(np.stack([np.sin(theta), np.cos(theta)], axis=1), rings=rings, turns=turns)
    outward = mesh.points / np.linalg.norm(mesh.points, axis=1, keepdims=True)
    return Mesh(radius * outward + np.array([0.0, radius, 0.0]), outward, mesh.faces)


def tube(path: Floats, radii: Floats, *, sides: int = 8) -> Mesh:
    """A pipe along a path (k, 3).

    radii: (k,) or, for a cross-section that is not round, (k, sides + 1) over the angle. The
    ring is carried along without twisting (parallel transport).
    """
    tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    side = np.cross(tangent[0], np.eye(3)[np.argmin(np.abs(tangent[0]))])
    frames = []
    for forward in tangent:
        side = side - forward * (side @ forward)
        side = side / np.linalg.norm(side)
        frames.append((side, np.cross(side, forward)))
    angle = np.linspace(0, 2 * np.pi, sides + 1)
    first = np.array([f[0] for f in frames])[:, None]
    second = np.array([f[1] for f in frames])[:, None]
    around = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
    radius = radii[:, None] if radii.ndim == 1 else radii
    points = path[:, None] + radius[..., None] * around
    return Mesh(points.reshape(-1, 3), around.reshape(-1, 3), grid_faces(len(path), sides + 1))


def surface_nets(
    field: Callable[[Floats], Floats], lower: ArrayLike, upper: ArrayLike, *, cell: float
) -> Mesh:
    """The zero surface of a signed distance (naive surface nets, Gibson 1998).

    field: maps (..., 3) points to (...) distances, negative inside. One vertex in every grid
    cell the surface crosses, one quad around every grid edge it crosses; the vertices then
    slide onto the surface along the gradient, which also gives the normals.
    """
    lower, upper = np.asarray(lower, float), np.asarray(upper, float)
    axes = [np.arange(lo, hi + cell, cell) for lo, hi in zip(lower, upper, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    distance = field(grid)
    inside = distance < 0
    cells = tuple(n - 1 for n in distance.shape)

    # A vertex where the corners of a cell disagree.
    def corner(values: NDArray[np.bool_], offset: Sequence[int]) -> NDArray[np.bool_]:
        return values[tuple(slice(o, o + n) for o, n in zip(offset, cells, strict=True))]

    number_inside = sum(corner(inside, o).astype(int) for o in product((0, 1), repeat=3))
    active = (number_inside > 0) & (number_inside < 8)
    index = np.full(cells, -1, np.int32)
    index[active] = np.arange(np.count_nonzero(active), dtype=np.int32)
    points = grid[:-1, :-1, :-1][active] + 0.5 * cell

    # A quad around every edge whose two ends disagree, facing the end that is outside.
    faces = []
    for axis in range(3):
        one, two = (axis + 1) % 3, (axis + 2) % 3
        start, end = np.take(inside, range(cells[axis]), axis), np.roll(inside, -1, axis)
        crossing = start != np.take(end, range(cells[axis]), axis)
        edge = np.argwhere(crossing)
        edge = edge[(edge[:, one] > 0) & (edge[:, two] > 0)]
        edge = edge[(edge[:, one] < cells[one]) & (edge[:, two] < cells[two])]
        around = []
        for back_one, back_two in ((1, 1), (0, 1), (0, 0), (1, 0)):
            neighbour = edge.copy()
            neighbour[:, one] -= back_one
            neighbour[:, two] -= back_two
            around.append(index[tuple(neighbour.T)])
        quad = np.stack(around, axis=1)
        leaves = inside[tuple(edge.T)]
        quad = np.where(leaves[:, None], quad, quad[:, ::-1])
        faces += [quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]]

    step = 1e-3 * np.eye(3)
    gradient = np.zeros_like(points)
    for _ in range(4):
        ahead = np.stack([field(points + h) - field(points - h) for h in step], axis=-1)
        gradient = ahead / 2e-3
        length_squared = np.maximum((gradient**2).sum(-1), 0.05)
        move = field(points) / length_squared
        points = points - np.clip(move, -cell, cell)[:, None] * gradient
    normals = gradient / np.maximum(np.linalg.norm(gradient, axis=-1, keepdims=True), 1e-9)
    return Mesh(points, normals, np.concatenate(faces).astype(np.int32))


def write_ply(path: Path, mesh: Mesh) -> None:
    """Write a binary little-endian PLY of triangles with normals (and u, v if there are any)."""
    names = ["x", "y", "z", "nx", "ny", "nz"] + ([] if mesh.uv is None else ["u", "v"])
    columns = [mesh.points, mesh.normals] + ([] if mesh.uv is None else [mesh.uv])
    header = "\n".join(
        [
            "ply",
            "format binary_little_endian 1.0",
            f"element vertex {len(mesh.points)}",
            *(f"property float {name}" for name in names),
            f"element face {len(mesh.faces)}",
            "property list uchar int vertex_indices",
            "end_header\n",
        ]
    )
    # Rounding to 2^-20 m drops the last bits, in which machines may differ.
    vertices = (np.round(np.concatenate(columns, axis=1) * 2**20) / 2**20).astype("<f4")
    faces = np.empty(len(mesh.faces), dtype=[("count", "u1"), ("index", "<i4", 3)])
    faces["count"], faces["index"] = 3, mesh.faces
    path.write_bytes(header.encode("ascii") + vertices.tobytes() + faces.tobytes())


def write_png(path: Path, image: NDArray[np.uint8]) -> None:
    """Write an 8-bit sRGB PNG. image: (h, w, 3)."""
    height, width, _ = image.shape

    def chunk(kind: bytes, body: bytes) -> bytes:
        checked = kind + body
        return struct.pack(">I", len(body)) + checked + struct.pack(">I", zlib.crc32(checked))

    # Filter type 2 (difference to the row above) packs grain that runs down the picture.
    above = np.concatenate([np.zeros_like(image[:1]), image[:-1]])
    rows = (image - above).reshape(height, -1)
    filtered = np.concatenate([np.full((height, 1), 2, np.uint8), rows], axis=1)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
        + chunk(b"IDAT", zlib.compress(filtered.tobytes(), 9))
        + chunk(b"IEND", b"")
    )
