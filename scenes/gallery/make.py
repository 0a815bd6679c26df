"""Builds everything beside it that scene.xml refers to: meshes/*.ply and textures/*.png.

    python scenes/gallery/make.py

The room is in metres, y up. The back wall is at z = 0, the glazed front at z = 10, the left wall at
x = -3.4 and the window wall at x = 3.4; a doorway in the back wall leads to a smaller room, the
annex. Lights live in scene.xml, not here: lamp heads are built where scene.xml puts its spots.
Needs numpy only. Every random number comes from a fixed seed: two runs write the same bytes.
"""

from __future__ import annotations

import struct
import xml.etree.ElementTree as ET
import zlib
from collections.abc import Sequence
from itertools import pairwise, product
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

HERE = Path(__file__).parent
Array = NDArray[np.float64]
Hole = tuple[float, float, float, float]

LEFT, RIGHT, FRONT, HEIGHT = -3.4, 3.4, 10.0, 3.8
REVEAL = 0.45  # thickness of the window wall
DOOR = (1.3, 2.6, 2.7)  # left, right, head
DOOR_DEPTH = 0.3
ANNEX = (-0.6, 4.2, 3.3, -4.6)  # left, right, height, far end
WINDOWS = ((1.8, 2.9), (4.2, 5.3))  # from z, to z
SILL, WINDOW_HEAD = 0.35, 3.05
SKYLIGHT = (-1.15, 1.45, 1.75, 5.6)  # left, right, far, near
SHAFT = 0.75  # depth of the skylight above the ceiling

# ------------------------------------------------------------------------------------------------
# Meshes
# ------------------------------------------------------------------------------------------------


class Mesh:
    """Triangles with a normal and a texture coordinate at every vertex."""

    def __init__(self) -> None:
        """An empty mesh."""
        self.positions: list[Array] = []
        self.normals: list[Array] = []
        self.uvs: list[Array] = []
        self.faces: list[NDArray[np.int64]] = []
        self.size = 0

    def add(self, positions: Array, normals: Array, uvs: Array, faces: NDArray[np.int64]) -> None:
        """Append (n, 3) positions and normals, (n, 2) uvs and (m, 3) vertex indices."""
        self.positions.append(positions)
        self.normals.append(normals)
        self.uvs.append(uvs)
        self.faces.append(faces + self.size)
        self.size += len(positions)

    def facet(self, corners: ArrayLike, outward: ArrayLike, uvs: ArrayLike | None = None) -> None:
        """One flat convex polygon; it is turned so that its normal agrees with `outward`."""
        points = np.asarray(corners, float)
        coordinates = np.zeros((len(points), 2)) if uvs is None else np.asarray(uvs, float)
        normal = np.cross(points[1] - points[0], points[-1] - points[0])
        if normal @ np.asarray(outward, float) < 0:
            points, coordinates, normal = points[::-1], coordinates[::-1], -normal
        normals = np.tile(normal / np.linalg.norm(normal), (len(points), 1))
        fan = np.array([[0, k, k + 1] for k in range(1, len(points) - 1)])
        self.add(points, normals, coordinates, fan)

    def wall(
        self,
        origin: ArrayLike,
        u: ArrayLike,
        v: ArrayLike,
        outward: ArrayLike,
        holes: Sequence[Hole] = (),
    ) -> None:
        """A rectangle with sides u and v, less rectangular holes (u0, v0, u1, v1), in metres.

        Texture coordinates are metres along u and v.
        """
        corner, u_side, v_side = (np.asarray(a, float) for a in (origin, u, v))
        width, height = np.linalg.norm(u_side), np.linalg.norm(v_side)
        u_cuts = sorted({0.0, float(width), *(h[0] for h in holes), *(h[2] for h in holes)})
        v_cuts = sorted({0.0, float(height), *(h[1] for h in holes), *(h[3] for h in holes)})
        for (u0, u1), (v0, v1) in product(pairwise(u_cuts), pairwise(v_cuts)):
            mid_u, mid_v = (u0 + u1) / 2, (v0 + v1) / 2
            if any(h[0] < mid_u < h[2] and h[1] < mid_v < h[3] for h in holes):
                continue
            uvs = np.array([(u0, v0), (u1, v0), (u1, v1), (u0, v1)])
            points = corner + uvs[:, :1] * u_side / width + uvs[:, 1:] * v_side / height
            self.facet(points, outward, uvs)

    def box(self, low: ArrayLike, high: ArrayLike, bevel: float = 0.0) -> None:
        """An upright box; `bevel` metres are cut off every edge, so that edges catch the light."""
        centre = (np.asarray(low, float) + np.asarray(high, float)) / 2
        half = (np.asarray(high, float) - np.asarray(low, float)) / 2
        inner = half - bevel
        signs = np.array(list(product((-1, 1), repeat=3)), float)

        def corner(sign: Array, axis: int) -> Array:
            """The corner of the face across `axis` that lies towards `sign`."""
            reach = inner.copy()
            reach[axis] = half[axis]
            return centre + sign * reach

        around = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
        for axis, side in product(range(3), (-1, 1)):
            ring = [np.insert(np.array(s, float), axis, side) for s in around]
            outward = np.eye(3)[axis] * side
            points = [corner(s, axis) for s in ring]
            others = [a for a in range(3) if a != axis]
            self.facet(points, outward, [(p[others[1]], p[others[0]]) for p in points])
        if bevel == 0:
            return
        for axis in range(3):
            a, b = (k for k in range(3) if k != axis)
            for sa, sb in around:
                ends = [np.zeros(3), np.zeros(3)]
                for end, along in zip(ends, (-1, 1), strict=True):
                    end[[axis, a, b]] = along, sa, sb
                strip = [
                    corner(ends[0], a),
                    corner(ends[1], a),
                    corner(ends[1], b),
                    corner(ends[0], b),
                ]
                self.facet(strip, ends[0] + ends[1])
        for sign in signs:
            self.facet([corner(sign, axis) for axis in range(3)], sign)

    def surface(self, points: Array, *, closed: tuple[bool, bool] = (False, True)) -> None:
        """A smooth surface through (r, c, 3) points; `closed`: do (rows, columns) go round?"""
        rows, columns = points.shape[:2]
        index = np.arange(rows * columns).reshape(rows, columns)
        if closed[0]:
            index = np.concatenate([index, index[:1]])
        if closed[1]:
            index = np.concatenate([index, index[:, :1]], axis=1)
        a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
        faces = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)

        # The normal of a vertex is the area-weighted mean of its triangles' normals.
        flat = points.reshape(-1, 3)
        face_normals = np.cross(
            flat[faces[:, 1]] - flat[faces[:, 0]], flat[faces[:, 2]] - flat[faces[:, 0]]
        )
        keep = np.linalg.norm(face_normals, axis=1) > 1e-12
        faces, face_normals = faces[keep], face_normals[keep]
        normals = np.zeros_like(flat)
        for k in range(3):
            np.add.at(normals, faces[:, k], face_normals)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        v, u = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing="ij")
        self.add(flat, normals, np.column_stack([u.ravel(), v.ravel()]), faces)

    def lathe(self, profile: ArrayLike, centre: ArrayLike, segments: int = 32) -> None:
        """Turn (radius, height) pairs, listed upwards on the outside, about a vertical."""
        radius, height = np.asarray(profile, float).T
        angle = np.linspace(0, -2 * np.pi, segments, endpoint=False)
        ring = np.stack([np.cos(angle), np.zeros_like(angle), np.sin(angle)], axis=-1)
        points = radius[:, None, None] * ring + height[:, None, None] * np.array([0.0, 1.0, 0.0])
        self.surface(points + np.asarray(centre, float))

    def rod(self, start: ArrayLike, end: ArrayLike, radius: float, segments: int = 12) -> None:
        """A closed cylinder between two points."""
        a, b = np.asarray(start, float), np.asarray(end, float)
        axis = (b - a) / np.linalg.norm(b - a)
        side, other = _frame(axis)
        angle = np.linspace(0, 2 * np.pi, segments, endpoint=False)[:, None]
        ring = radius * (np.cos(angle) * side + np.sin(angle) * other)
        self.surface(np.stack([a + ring, b + ring]))
        self.facet(a + ring, -axis)
        self.facet(b + ring, axis)

    def place(self, other: Mesh, origin: ArrayLike, right: ArrayLike, normal: ArrayLike) -> None:
        """Add `other`, built facing +z, onto a wall that faces `normal`."""
        axes = np.stack([np.asarray(right, float), (0.0, 1.0, 0.0), np.asarray(normal, float)])
        for p, n, uv, f, start in zip(
            other.positions, other.normals, other.uvs, other.faces, other.starts(), strict=True
        ):
            self.add(p @ axes + np.asarray(origin, float), n @ axes, uv, f - start)

    def starts(self) -> list[int]:
        """The index of the first vertex of every part that was added."""
        return [0, *np.cumsum([len(p) for p in self.positions])[:-1].tolist()]

    @property
    def triangles(self) -> int:
        """How many triangles there are."""
        return sum(len(f) for f in self.faces)

    def write(self, name: str, *, bare: bool = False) -> None:
        """Write meshes/<name>.ply: binary, little endian; `bare` without normals and uvs."""
        columns = ["x", "y", "z"] if bare else ["x", "y", "z", "nx", "ny", "nz", "u", "v"]
        parts = (self.positions,) if bare else (self.positions, self.normals, self.uvs)
        vertices = np.concatenate([np.concatenate(part) for part in parts], axis=1)
        faces = np.concatenate(self.faces)
        packed = np.zeros(len(faces), dtype=[("count", "u1"), ("index", "<i4", 3)])
        packed["count"], packed["index"] = 3, faces
        properties = "".join(f"property float {c}\n" for c in columns)
        header = (
            f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n{properties}"
            f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
        )
        path = HERE / "meshes" / f"{name}.ply"
        path.write_bytes(header.encode() + vertices.astype("<f4").tobytes() + packed.tobytes())


def _frame(axis: Array) -> tuple[Array, Array]:
    """Two unit vectors at right angles to a unit vector, and to each other."""
    helper = np.array([0.0, 1.0, 0.0]) if abs(axis[1]) < 0.9 else np.array([1.0, 0.0, 0.0])
    side = np.cross(helper, axis)
    side /= np.linalg.norm(side)
    return side, np.cross(axis, side)


# ------------------------------------------------------------------------------------------------
# The building
# ------------------------------------------------------------------------------------------------

X, Y, Z = np.eye(3)


def building() -> dict[str, Mesh]:
    """Walls, floors, ceilings, skylight shaft, skirting, window bars."""
    white, back, annex, ceiling, floor = Mesh(), Mesh(), Mesh(), Mesh(), Mesh()
    trim, metal = Mesh(), Mesh()
    width, depth = RIGHT - LEFT, FRONT

    # The main room. Its front (z = 10) is open: that is where most of the sky comes in.
    white.wall((LEFT, 0, 0), Z * depth, Y * HEIGHT, X)
    holes = [(z0, SILL, z1, WINDOW_HEAD) for z0, z1 in WINDOWS]
    white.wall((RIGHT, 0, 0), Z * depth, Y * HEIGHT, -X, holes)
    for z0, z1 in WINDOWS:
        height = WINDOW_HEAD - SILL
        white.wall((RIGHT, SILL, z0), X * REVEAL, Z * (z1 - z0), Y)
        white.wall((RIGHT, WINDOW_HEAD, z0), X * REVEAL, Z * (z1 - z0), -Y)
        white.wall((RIGHT, SILL, z0), X * REVEAL, Y * height, Z)
        white.wall((RIGHT, SILL, z1), X * REVEAL, Y * height, -Z)
        bar_x, middle = RIGHT + REVEAL - 0.05, (z0 + z1) / 2
        metal.box((bar_x, SILL, middle - 0.02), (bar_x + 0.05, WINDOW_HEAD, middle + 0.02))
        for y in (SILL + height / 3, SILL + 2 * height / 3):
            metal.box((bar_x, y - 0.02, z0), (bar_x + 0.05, y + 0.02, z1))
    door_left, door_right, door_head = DOOR
    back.wall(
        (LEFT, 0, 0),
        X * width,
        Y * HEIGHT,
        Z,
        [(door_left - LEFT, 0, door_right - LEFT, door_head)],
    )
    floor.wall((LEFT, 0, 0), X * width, Z * depth, Y)
    left, right, far, near = SKYLIGHT
    ceiling.wall(
        (LEFT, HEIGHT, 0), X * width, Z * depth, -Y, [(left - LEFT, far, right - LEFT, near)]
    )
    ceiling.wall((left, HEIGHT, far), X * (right - left), Y * SHAFT, Z)
    ceiling.wall((left, HEIGHT, near), X * (right - left), Y * SHAFT, -Z)
    ceiling.wall((left, HEIGHT, far), Z * (near - far), Y * SHAFT, X)
    ceiling.wall((right, HEIGHT, far), Z * (near - far), Y * SHAFT, -X)
    for z in np.linspace(far, near, 7)[1:-1]:
        ceiling.box((left, HEIGHT + 0.06, z - 0.03), (right, HEIGHT + 0.4, z + 0.03), 0.008)

    # The ledge of the cove hides its LED strip from below.
    ceiling.box((LEFT, 3.10, 0), (LEFT + 0.30, 3.14, depth), 0.005)
    ceiling.box((LEFT + 0.30, 3.10, 0), (LEFT + 0.325, 3.25, depth), 0.005)

    # The doorway, and the annex behind it.
    for x, outward in ((door_left, X), (door_right, -X)):
        back.wall((x, 0, -DOOR_DEPTH), Z * DOOR_DEPTH, Y * door_head, outward)
    back.wall((door_left, door_head, -DOOR_DEPTH), X * (door_right - door_left), Z * DOOR_DEPTH, -Y)
    floor.wall((door_left, 0, -DOOR_DEPTH), X * (door_right - door_left), Z * DOOR_DEPTH, Y)
    a_left, a_right, a_height, a_far = ANNEX
    a_width, a_depth = a_right - a_left, -DOOR_DEPTH - a_far
    annex.wall((a_left, 0, a_far), X * a_width, Y * a_height, Z)
    annex.wall((a_left, 0, a_far), Z * a_depth, Y * a_height, X)
    annex.wall((a_right, 0, a_far), Z * a_depth, Y * a_height, -X)
    opening = (door_left - a_left, 0, door_right - a_left, door_head)
    annex.wall((a_left, 0, -DOOR_DEPTH), X * a_width, Y * a_height, -Z, [opening])
    ceiling.wall((a_left, a_height, a_far), X * a_width, Z * a_depth, -Y)
    floor.wall((a_left, 0, a_far), X * a_width, Z * a_depth, Y)

    # Skirting, and a lining round the doorway.
    for x0, x1 in ((LEFT, door_left - 0.07), (door_right + 0.07, RIGHT)):
        trim.box((x0, 0, 0), (x1, 0.12, 0.018), 0.004)
    for x0, x1 in ((LEFT, LEFT + 0.018), (RIGHT - 0.018, RIGHT)):
        trim.box((x0, 0, 0.018), (x1, 0.12, depth), 0.004)
    trim.box((a_left, 0, a_far), (a_right, 0.12, a_far + 0.018), 0.004)
    trim.box((door_left - 0.07, 0, 0), (door_left, door_head + 0.07, 0.025), 0.005)
    trim.box((door_right, 0, 0), (door_right + 0.07, door_head + 0.07, 0.025), 0.005)
    trim.box((door_left, door_head, 0), (door_right, door_head + 0.07, 0.025), 0.005)
    return {
        "walls": white,
        "back_wall": back,
        "annex": annex,
        "ceiling": ceiling,
        "floor": floor,
        "trim": trim,
        "window_bars": metal,
    }


def fixtures() -> dict[str, Mesh]:
    """Track rails, lamp heads, the pendant's shade, the floor lamp."""
    metal, shade = Mesh(), Mesh()
    rails = (
        ((-2.6, 0, 1.48), (0.4, 0, 1.52)),
        ((-1.82, 0, 1.9), (-1.78, 0, 6.5)),
        ((2.18, 0, 1.0), (2.22, 0, 6.5)),
    )
    for low, high in rails:
        metal.box(np.add(low, (0, HEIGHT - 0.035, 0)), np.add(high, (0, HEIGHT, 0)), 0.004)

    # A head for every spot in scene.xml: a can behind the light, hung from the rail above it.
    for origin, target in spots():
        axis = (target - origin) / np.linalg.norm(target - origin)
        back = origin - 0.2 * axis
        metal.rod(back, origin - 0.02 * axis, 0.048, 20)
        metal.rod(origin - 0.02 * axis, origin - 0.012 * axis, 0.056, 20)
        pivot = origin - 0.13 * axis
        metal.rod(pivot, (pivot[0], HEIGHT - 0.03, pivot[2]), 0.009, 8)

    # The pendant's shade is a dome with a thin wall; its disk of light is inside, above the rim.
    t = np.linspace(0, 1, 9)
    outside = np.column_stack([0.03 + 0.25 * np.sqrt(1 - t**2), 0.24 * t])
    inside = outside[::-1] - (0.006, 0.006)
    profile = np.concatenate([outside, [(0.0, 0.243), (0.0, 0.23)], inside[1:-1], [(0.274, 0.0)]])
    shade.lathe(profile, PENDANT, 36)
    shade.rod(np.add(PENDANT, (0, 0.235, 0)), (PENDANT[0], HEIGHT, PENDANT[2]), 0.006, 8)

    # The floor lamp of the annex: its bulb sits just above the rim of a conical shade.
    stand = [
        (0, 0),
        (0.16, 0),
        (0.16, 0.015),
        (0.02, 0.025),
        (0.011, 0.05),
        (0.011, 1.38),
        (0, 1.38),
    ]
    shade.lathe(stand, FLOOR_LAMP, 20)
    shade.lathe(
        [(0.2, 1.46), (0.11, 1.76), (0.106, 1.758), (0.196, 1.462), (0.2, 1.46)], FLOOR_LAMP, 32
    )
    return {"fixtures": metal, "shades": shade}


PENDANT = (-0.75, 2.42, 3.35)
FLOOR_LAMP = (1.42, 0.0, -3.6)


def spots() -> list[tuple[Array, Array]]:
    """(origin, target) of every spot in scene.xml."""
    found = []
    for emitter in ET.parse(HERE / "scene.xml").getroot().iter("emitter"):
        look_at = emitter.find("transform/lookat")
        if emitter.get("type") == "spot" and look_at is not None:
            origin, target = (
                np.array([float(n) for n in look_at.get(k, "").split(",")])
                for k in ("origin", "target")
            )
            found.append((origin, target))
    return found


# ------------------------------------------------------------------------------------------------
# The works
# ------------------------------------------------------------------------------------------------

# name: centre on the wall, direction to the right, normal, width, height
PAINTINGS = {
    "field": ((-1.1, 1.68, 0.0), X, Z, 2.9, 1.95),
    "tide_left": ((LEFT, 1.66, 3.62), -Z, X, 1.15, 1.55),
    "tide_right": ((LEFT, 1.66, 2.28), -Z, X, 1.15, 1.55),
    "arcs": ((RIGHT, 1.66, 3.55), Z, -X, 0.8, 0.8),
    "sun": ((2.24, 1.66, ANNEX[3]), X, Z, 1.0, 1.28),
}


def works() -> dict[str, Mesh]:
    """Paintings in their frames, sculptures on plinths, labels, a bench."""
    meshes: dict[str, Mesh] = {}
    frames, labels = Mesh(), Mesh()
    for name, (centre, right, normal, width, height) in PAINTINGS.items():
        canvas, frame, label = Mesh(), Mesh(), Mesh()
        w, h, lip, thick = width / 2, height / 2, 0.03, 0.05
        corners = [(-w, -h, 0.035), (w, -h, 0.035), (w, h, 0.035), (-w, h, 0.035)]
        canvas.facet(corners, Z, [(0, 1), (1, 1), (1, 0), (0, 0)])  # v runs down the picture
        frame.box((-w - lip, h, 0), (w + lip, h + lip, thick), 0.004)
        frame.box((-w - lip, -h - lip, 0), (w + lip, -h, thick), 0.004)
        frame.box((-w - lip, -h, 0), (-w, h, thick), 0.004)
        frame.box((w, -h, 0), (w + lip, h, thick), 0.004)
        label.box((w + 0.16, -0.42, 0), (w + 0.30, -0.32, 0.006), 0.001)
        meshes[f"painting_{name}"] = Mesh()
        meshes[f"painting_{name}"].place(canvas, centre, right, normal)
        frames.place(frame, centre, right, normal)
        if name != "tide_left":  # one label serves the pair
            labels.place(label, centre, right, normal)

    plinths = Mesh()
    for (x, _, z), side, height in ((KNOT, 0.46, 1.02), (VASE, 0.40, 0.95), (FIGURE, 0.52, 0.42)):
        plinths.box((x - side / 2, 0.03, z - side / 2), (x + side / 2, height, z + side / 2), 0.006)
        inset = side / 2 - 0.03
        plinths.box((x - inset, 0, z - inset), (x + inset, 0.03, z + inset))

    # A bench: an oak plank on two dark frames.
    seat, legs = Mesh(), Mesh()
    x0, x1, z0, z1 = -1.55, 0.05, 3.1, 3.56
    seat.box((x0, 0.40, z0), (x1, 0.46, z1), 0.008)
    for x in (x0 + 0.2, x1 - 0.2):
        legs.box((x - 0.02, 0, z0 + 0.04), (x + 0.02, 0.40, z0 + 0.08), 0.003)
        legs.box((x - 0.02, 0, z1 - 0.08), (x + 0.02, 0.40, z1 - 0.04), 0.003)
        legs.box((x - 0.02, 0, z0 + 0.08), (x + 0.02, 0.03, z1 - 0.08), 0.003)
    stone, hollow = figure()
    return meshes | {
        "frames": frames,
        "labels": labels,
        "plinths": plinths,
        "bench_seat": seat,
        "bench_legs": legs,
        "knot": knot(),
        "vase": vase(),
        "figure": stone,
        "figure_hollow": hollow,
    }


# Mitsuba makes smooth normals for these, and they carry no texture.
SMOOTH = ("knot", "vase", "figure", "figure_hollow")

KNOT = (1.28, 1.02, 3.0)
VASE = (2.72, 0.95, 2.25)
FIGURE = (-2.72, 0.42, 0.95)


def knot() -> Mesh:
    """A trefoil in bronze: a tube with an oval section that swells and thins as it goes."""
    steps, around = 160, 20
    t = np.linspace(0, 2 * np.pi, steps, endpoint=False)
    path = np.stack(
        [np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -1.25 * np.sin(3 * t)],
        axis=-1,
    )
    tangent = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    # The section is carried by the direction away from the middle of the knot.
    side = path - np.sum(path * tangent, axis=1, keepdims=True) * tangent
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(tangent, side)
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)[None, :, None]
    swell = (0.62 + 0.16 * np.cos(3 * t))[:, None, None]
    ring = 0.72 * np.cos(angle) * side[:, None] + 1.15 * np.sin(angle) * other[:, None]
    points = 0.105 * (path[:, None] + swell * ring)
    turn = np.radians(24)
    rotation = np.array(
        [[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]]
    )
    points = points @ rotation.T
    points += np.array(KNOT) - (0, points[..., 1].min(), 0)
    mesh = Mesh()
    mesh.surface(points, closed=(True, True))
    return mesh


def vase() -> Mesh:
    """A ceramic vase with flutes that wind round it."""
    profile = np.array(
        [
            (0.0, 0.0),
            (0.075, 0.0),
            (0.10, 0.03),
            (0.165, 0.16),
            (0.18, 0.26),
            (0.15, 0.38),
            (0.085, 0.49),
            (0.06, 0.56),
            (0.07, 0.61),
            (0.085, 0.625),
            (0.078, 0.625),
            (0.05, 0.56),
            (0.0, 0.5),
        ]
    )
    rows = _curve(profile, 34)
    segments = 76
    angle = np.linspace(0, -2 * np.pi, segments, endpoint=False)[None, :]
    radius, height = rows[:, :1], rows[:, 1:]
    belly = np.exp(-(((height - 0.24) / 0.16) ** 2))
    radius = radius * (1 + 0.05 * belly * np.cos(9 * angle + 9 * height))
    points = np.stack([radius * np.cos(angle), height + 0 * angle, radius * np.sin(angle)], axis=-1)
    mesh = Mesh()
    mesh.surface(points + np.array(VASE))
    return mesh


def figure() -> tuple[Mesh, Mesh]:
    """An upright pierced form in two parts: the stone, and its hollow, which meet in a sharp rim.

    It is described about the axis of its hole: for every direction there is a radius of the
    outline, of the rim and of the narrowest place. The hole is not in the middle, and leans.
    """
    turns = 72
    angle = np.linspace(0, 2 * np.pi, turns, endpoint=False)
    # The outline is an egg that stands on its narrow end; the axis of the hole is above its middle.
    reach = _egg(angle, middle=(0.0, 0.56), hole=(0.035, 0.80))
    rim = np.minimum(0.205 + 0.055 * np.sin(angle - 0.5) ** 2, 0.80 * reach)
    waist = 0.085 + 0.045 * np.sin(angle - 0.75) ** 2
    depth = 0.205 - 0.035 * np.sin(angle)

    def form(radius: Array, z: Array) -> Mesh:
        """The surface with these radii and depths, (rows, turns), turned and on its plinth."""
        x = 0.035 + 0.22 * z + radius * np.cos(angle)
        y = 0.80 + 0.30 * z + radius * np.sin(angle)
        swing = np.radians(34.0) + 0.30 * (y - 0.6)
        points = np.stack(
            [
                np.cos(swing) * x + np.sin(swing) * z,
                np.maximum(y, 0.0),
                np.cos(swing) * z - np.sin(swing) * x,
            ],
            axis=-1,
        )
        mesh = Mesh()
        mesh.surface(points + np.array(FIGURE))
        return mesh

    over = np.sin(np.linspace(-np.pi / 2, np.pi / 2, 23))[:, None] * np.pi / 2
    stone = form(rim + (reach - rim) * np.cos(over) ** 0.9, depth * np.sin(over))
    through = np.linspace(1, -1, 15)[:, None]
    hollow = form(waist + (rim - waist) * np.abs(through) ** 1.7, depth * through)
    return stone, hollow


def _egg(angle: Array, middle: tuple[float, float], hole: tuple[float, float]) -> Array:
    """How far the outline of the pierced form is from its hole, in each direction."""
    turn = np.linspace(0, 2 * np.pi, 721)
    broad = 0.245 + 0.085 * np.sin(turn)
    x = middle[0] + broad * np.cos(turn) + 0.045 * np.sin(2 * turn - 0.4)
    y = middle[1] + 0.76 * np.sin(turn) - 0.05 * np.cos(turn)
    towards = np.unwrap(np.arctan2(y - hole[1], x - hole[0]))
    return np.interp(angle, towards, np.hypot(x - hole[0], y - hole[1]), period=2 * np.pi)


def _curve(points: Array, count: int) -> Array:
    """`count` points, evenly spaced, on a Catmull-Rom curve through (n, 2) points."""
    ends = np.concatenate([points[:1], points, points[-1:]])
    t = (np.arange(16) / 16)[:, None]
    fine = [
        p1
        + 0.5 * t * (p2 - p0 + t * (2 * p0 - 5 * p1 + 4 * p2 - p3 + t * (3 * (p1 - p2) + p3 - p0)))
        for p0, p1, p2, p3 in zip(ends[:-3], ends[1:-2], ends[2:-1], ends[3:], strict=True)
    ]
    dense = np.concatenate([*fine, points[-1:]])
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(dense, axis=0), axis=1))])
    at = np.linspace(0, length[-1], count)
    curve = np.column_stack([np.interp(at, length, dense[:, k]) for k in range(2)])
    curve[:, 0] = np.maximum(curve[:, 0], 0)
    return curve


# ------------------------------------------------------------------------------------------------
# Textures: (h, w, 3) arrays in display values, 0 to 1, the way a painter picks colours
# ------------------------------------------------------------------------------------------------


def noise(
    height: int, width: int, cells: tuple[float, float], seed: int, octaves: int = 4
) -> Array:
    """Smooth fractal noise in about [-1, 1]; `cells` is the first lattice, (down, across).

    With whole numbers of cells the pattern tiles.
    """
    total, amplitude = np.zeros((height, width)), 1.0
    rng = np.random.default_rng(seed)
    for octave in range(octaves):
        down, across = (max(1, round(c * 2**octave)) for c in cells)
        lattice = rng.uniform(-1, 1, (down, across))
        y = np.linspace(0, down, height, endpoint=False)
        x = np.linspace(0, across, width, endpoint=False)
        y0, x0 = y.astype(int), x.astype(int)
        fy, fx = _fade(y - y0)[:, None], _fade(x - x0)[None, :]
        y1, x1 = (y0 + 1) % down, (x0 + 1) % across
        top = lattice[np.ix_(y0, x0)] * (1 - fx) + lattice[np.ix_(y0, x1)] * fx
        bottom = lattice[np.ix_(y1, x0)] * (1 - fx) + lattice[np.ix_(y1, x1)] * fx
        total += amplitude * (top * (1 - fy) + bottom * fy)
        amplitude *= 0.5
    return total


def _fade(t: Array) -> Array:
    return t * t * t * (t * (6 * t - 15) + 10)


def _step(low: float, high: float, value: Array) -> Array:
    return _fade(np.clip((value - low) / (high - low), 0, 1))


def _mix(a: Array, b: ArrayLike, amount: Array) -> Array:
    return a + amount[..., None] * (np.asarray(b, float) - a)


def _grid(height: int, width: int) -> tuple[Array, Array]:
    """x and y of the pixel centres, y in [0, 1] downwards and x in the same unit."""
    y, x = np.meshgrid(
        (np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / height, indexing="ij"
    )
    return x, y


def plaster(color: Sequence[float], seed: int, size: int = 320) -> Array:
    """Rolled paint over plaster: broad unevenness and a fine tooth."""
    shade = 0.012 * noise(size, size, (3, 3), seed, 4) + 0.008 * noise(
        size, size, (80, 80), seed + 1, 1
    )
    return np.asarray(color, float) + shade[..., None]


def brick(size: int = 432, courses: int = 24, bricks: int = 8) -> Array:
    """1.8 m of whitewashed brickwork; every other course is half a brick further on."""
    rng = np.random.default_rng(77)
    y, x = np.meshgrid(np.arange(size) / size, np.arange(size) / size, indexing="ij")
    # Laid by hand: courses and joints wander by some millimetres.
    y = (y + 0.0009 * noise(size, size, (2, 6), 78, 2)) % 1
    course = np.minimum((y * courses).astype(int), courses - 1)
    along = (x * bricks + 0.5 * (course % 2) + 0.02 * noise(size, size, (24, 8), 79, 1)) % bricks
    which = course * bricks + along.astype(int)
    across, down = along % 1, (y * courses) % 1
    edge = np.minimum(np.minimum(across, 1 - across) * 0.225, np.minimum(down, 1 - down) * 0.075)
    face = _step(0.0005, 0.0135, edge + 0.0015 * noise(size, size, (60, 60), 80, 2))
    out, lean, tone = rng.normal(0, 1, (3, courses * bricks))[:, which]
    tooth = noise(size, size, (54, 54), 81, 2)
    height = face * (0.80 + 0.05 * out + 0.05 * lean * (across - 0.5) + 0.015 * tooth)
    # Relief is painted: lower edges of bricks catch less light than upper ones, joints least.
    edges = np.clip(np.roll(height, -1, axis=0) - np.roll(height, 1, axis=0), -1, 1)
    shade = 0.016 * tone + 0.008 * tooth + 0.13 * (face - 1) + 0.045 * edges
    return np.array((0.88, 0.87, 0.85)) + shade[..., None]


def concrete(width: int = 680, height: int = 380) -> Array:
    """Two by two panels of fair-faced concrete, 3.4 m by 1.9 m, with the holes of their ties."""
    y, x = np.meshgrid(np.arange(height) / height, np.arange(width) / width, indexing="ij")
    cloud = noise(height, width, (2, 4), 91, 4)
    column, row = (x * 2).astype(int), (y * 2).astype(int)
    tone = np.array([[0.012, -0.010], [-0.014, 0.008]])[row, column]
    u, v = (x * 2) % 1 * 1.7, (y * 2) % 1 * 0.95
    joint = np.minimum(np.minimum(u, 1.7 - u), np.minimum(v, 0.95 - v))
    open_joint = _step(0.0075, 0.0025, joint)
    tie = np.hypot(np.abs(u - 0.85) - 0.50, np.abs(v - 0.475) - 0.24)
    hole = _step(0.019, 0.012, tie)
    # Water ran down the shuttering; air left pinholes.
    streak = noise(height, width, (2, 68), 92, 2)
    shade = tone + 0.030 * cloud + 0.008 * streak - 0.20 * open_joint - 0.24 * hole
    return np.array((0.735, 0.728, 0.712)) + shade[..., None]


def oak(height: int = 800, width: int = 640, planks: int = 20, rows: int = 3) -> Array:
    """Oak boards that run down the picture, each with its own tone and grain."""
    rng = np.random.default_rng(11)
    y, x = np.meshgrid(np.arange(height) / height, np.arange(width) / width, indexing="ij")
    plank = np.minimum((x * planks).astype(int), planks - 1)
    offset = rng.uniform(0, 1, planks)[plank]
    along = (y + offset) * rows
    board = plank * rows + (along.astype(int) % rows)
    tone, tint = rng.normal(0, 1, (2, planks * rows))
    grain = noise(height, width, (4, 160), 12, 2)
    # The broad figure of the wood is shifted from board to board.
    figure_noise = noise(height, width, (6, 60), 13, 2)
    shift = rng.integers(0, height, planks * rows)[board]
    figure_noise = figure_noise[
        (np.arange(height)[:, None] + shift) % height, np.arange(width)[None, :]
    ]
    value = 0.035 * tone[board] + 0.045 * figure_noise + 0.03 * grain
    color = np.array([0.60, 0.47, 0.35]) + value[..., None] * np.array([1.0, 0.95, 0.85])
    color += 0.012 * tint[board][..., None] * np.array([1.0, 0.0, -1.0])
    across = x * planks - plank
    joint = np.minimum(
        np.minimum(across, 1 - across) * width / planks,
        np.abs(along - np.round(along)) * height / rows,
    )
    return color * (0.62 + 0.38 * _step(0.2, 1.6, joint))[..., None]


def field(height: int = 400, width: int = 595) -> Array:
    """Three soft blocks of colour over a dark ground."""
    x, y = _grid(height, width)
    wobble = 0.012 * noise(height, width, (5, 7), 21)
    brush = noise(height, width, (40, 8), 22, 3)
    picture = np.full((height, width, 3), (0.36, 0.10, 0.13)) + 0.02 * brush[..., None]
    aspect = width / height
    blocks = (
        (0.06, 0.40, (0.86, 0.36, 0.15), 0.93),
        (0.45, 0.58, (0.93, 0.70, 0.32), 0.85),
        (0.63, 0.94, (0.20, 0.13, 0.27), 0.90),
    )
    for top, bottom, color, strength in blocks:
        vertical = _step(-0.02, 0.025, y - top + wobble) * _step(-0.02, 0.025, bottom - y + wobble)
        sides = _step(-0.02, 0.03, x - 0.09 + wobble) * _step(
            -0.02, 0.03, aspect - 0.09 - x + wobble
        )
        worn = strength + 0.10 * noise(height, width, (9, 5), 23 + round(100 * top), 4)
        block = (
            np.asarray(color)
            + (0.05 * noise(height, width, (3, 4), 31, 3) + 0.015 * brush)[..., None]
        )
        cover = vertical * sides * np.clip(worn, 0, 1)
        picture = picture + cover[..., None] * (block - picture)
    return picture


def tide(height: int = 420, width: int = 624) -> Array:
    """Poured paint in bands, warped twice; it is cut in two for the pair of panels."""
    x, y = _grid(height, width)
    one, two = noise(height, width, (2, 3), 41, 4), noise(height, width, (2, 3), 42, 4)
    yy = np.clip(y + 0.10 * one, 0, 1)
    warp = yy + 0.16 * two + 0.09 * np.sin(5.5 * x + 2.5 * one) - 0.06 * x
    stops = np.array([-0.15, 0.10, 0.24, 0.33, 0.42, 0.50, 0.62, 0.80, 1.15])
    colors = np.array(
        [
            (0.90, 0.87, 0.80),
            (0.86, 0.80, 0.70),
            (0.55, 0.68, 0.68),
            (0.16, 0.40, 0.48),
            (0.09, 0.22, 0.38),
            (0.85, 0.62, 0.28),
            (0.12, 0.17, 0.31),
            (0.08, 0.10, 0.20),
            (0.30, 0.44, 0.50),
        ]
    )
    picture = np.stack([np.interp(warp, stops, colors[:, k]) for k in range(3)], axis=-1)
    veins = np.exp(-((np.sin(26 * warp + 3 * one) / 0.10) ** 2))
    return _mix(picture, (0.93, 0.86, 0.70), 0.28 * veins)


def arcs(size: int = 320) -> Array:
    """A four by four board of quarter circles in five colours."""
    rng = np.random.default_rng(52)
    palette = np.array(
        [
            (0.92, 0.88, 0.80),
            (0.84, 0.33, 0.22),
            (0.13, 0.22, 0.33),
            (0.93, 0.70, 0.29),
            (0.38, 0.55, 0.52),
        ]
    )
    x, y = _grid(size, size)
    picture = np.empty((size, size, 3))
    cells = 4
    column, row = (np.minimum((v * cells).astype(int), cells - 1) for v in (x, y))
    for c, r in product(range(cells), repeat=2):
        inside = (column == c) & (row == r)
        ground, ring, core = palette[rng.permutation(len(palette))[:3]]
        corner_x, corner_y = c + rng.integers(2), r + rng.integers(2)
        distance = np.hypot(x * cells - corner_x, y * cells - corner_y)
        tile = _mix(
            np.broadcast_to(ground, picture.shape), ring, _step(0.015, -0.015, distance - 0.92)
        )
        tile = _mix(tile, core, _step(0.015, -0.015, distance - 0.5))
        picture[inside] = tile[inside]
    return picture + 0.012 * noise(size, size, (30, 30), 53, 2)[..., None]


def sun(height: int = 320, width: int = 251) -> Array:
    """A red disc over quiet water."""
    x, y = _grid(height, width)
    brush = noise(height, width, (50, 5), 61, 3)
    picture = np.full((height, width, 3), (0.91, 0.86, 0.76)) + 0.02 * brush[..., None]
    edge = 0.004 * noise(height, width, (14, 14), 62, 2)
    disc = _step(0.006, -0.006, np.hypot(x - 0.39, y - 0.36) - 0.21 + edge)
    picture = _mix(picture, (0.82, 0.27, 0.16), 0.95 * disc)
    water = _step(-0.01, 0.01, y - 0.68 + 0.006 * brush)
    picture = _mix(picture, (0.20, 0.30, 0.36), 0.9 * water)
    glint = water * _step(0.35, 0.9, brush + 0.9 - np.abs(x - 0.39) / (0.05 + 0.5 * (y - 0.62)))
    return _mix(picture, (0.90, 0.50, 0.30), 0.8 * glint)


def write_png(name: str, picture: Array, *, steps: int = 255) -> None:
    """Write textures/<name>.png: 8 bits, RGB, rows stored as differences downwards.

    Fewer `steps` than 255 make a smaller file.
    """
    coarse = np.rint(steps * np.clip(picture, 0, 1)) / steps
    pixels = np.rint(255 * coarse).astype(np.uint8)
    height, width = pixels.shape[:2]
    rows = pixels.reshape(height, -1)
    rows = np.concatenate(
        [np.full((height, 1), 2, np.uint8), np.diff(rows, axis=0, prepend=np.zeros_like(rows[:1]))],
        axis=1,
    )

    def chunk(kind: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = (
        chunk(b"IHDR", header)
        + chunk(b"IDAT", zlib.compress(rows.tobytes(), 9))
        + chunk(b"IEND", b"")
    )
    (HERE / "textures" / f"{name}.png").write_bytes(b"\x89PNG\r\n\x1a\n" + body)


def main() -> None:
    """Write every mesh and every texture, and say how large the scene is."""
    for folder in ("meshes", "textures"):
        (HERE / folder).mkdir(exist_ok=True)

    meshes = building() | fixtures() | works()
    for name, mesh in meshes.items():
        mesh.write(name, bare=name in SMOOTH)
        print(f"{name:22s}{mesh.triangles:7d} triangles")
    print(f"{'in all':22s}{sum(m.triangles for m in meshes.values()):7d} triangles")

    pair = tide()
    half = pair.shape[1] // 2
    write_png("brick", brick(), steps=170)
    write_png("concrete", concrete(), steps=170)
    write_png("plaster_blue", plaster((0.50, 0.58, 0.60), 75))
    write_png("oak", oak())
    write_png("field", field())
    write_png("tide_left", pair[:, :half])
    write_png("tide_right", pair[:, half:])
    write_png("arcs", arcs())
    write_png("sun", sun())


if __name__ == "__main__":
    main()
