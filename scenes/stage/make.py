"""Make the meshes and textures of the stage: cloth, boards, a cottage door, a tree, a woman.

    python scenes/stage/make.py

needs only numpy, takes some seconds, and writes the same bytes every time. What things are made
of and how they are lit is in `scene.xml`, by hand. Lengths are in metres, y up. The curtain
line is z = 0, the audience sits at +z, the cyclorama hangs at z = -6.5; left is the camera's.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))  # shapes.py lives one folder up

from shapes import (  # noqa: E402
    Floats,
    Mesh,
    curve,
    facets,
    join,
    lathe,
    rounded_box,
    sheet,
    surface_nets,
    tube,
    write_ply,
    write_png,
)

# --- The house: floor, cyclorama, cloth ----------------------------------------------------


def apron_edge(x: Floats) -> Floats:
    """z of the front edge of the stage, which bows out a little towards the audience."""
    return 1.45 + 0.28 * (1 - (x / 6.0) ** 2)


def floor() -> Mesh:
    """The stage floor; u and v are metres over the 4.48 m that one tile of boards covers."""
    x = np.linspace(-7, 7, 41)
    along = np.linspace(0, 1, 5)[:, None]
    z = apron_edge(x) + along * (-7.5 - apron_edge(x))
    points = np.stack([np.broadcast_to(x, z.shape), 0 * z, z], axis=-1)
    return sheet(points, uv=np.stack([points[..., 0], points[..., 2]], axis=-1) / 4.48)


def apron_front() -> Mesh:
    """The panelled board below the front edge, with a nosing along the top."""
    x = np.linspace(-7, 7, 141)
    y = np.array([-1.2, -0.14, -0.10, -0.02, 0.0])[:, None]
    out = np.array([-0.06, -0.06, 0.0, 0.0, -0.015])[:, None]
    panel = 0.025 * (np.abs((x / 1.0 + 0.5) % 1 - 0.5) < 0.06) * (out < -0.05)
    z = apron_edge(x) + out + panel
    grid = np.stack([np.broadcast_to(x, z.shape), np.broadcast_to(y, z.shape), z], axis=-1)
    return sheet(grid)


def cyclorama() -> Mesh:
    """A tall cloth bent forward at both ends and swept out at the foot, like a half-pipe."""
    angle = np.linspace(-1, 1, 61)
    bend = np.clip((np.abs(angle) - 0.72) / 0.28, 0, 1)
    x = np.sign(angle) * (np.minimum(np.abs(angle), 0.72) * 7.2 + 1.5 * np.sin(bend * np.pi / 2))
    z = -6.5 + 1.6 * (1 - np.cos(bend * np.pi / 2))
    y = np.concatenate([np.linspace(0, 0.5, 6), np.linspace(0.7, 6.4, 24)])[:, None]
    foot = 0.30 * np.clip(1 - y / 0.5, 0, 1) ** 2
    return sheet(np.stack([x + 0 * y, y + 0 * x, z + foot], axis=-1))


def house_curtain() -> Mesh:
    """The left half of the velvet curtain, drawn aside and held by a tie at y = 1.5.

    The same cloth passes everywhere, so folds deepen where it is gathered.
    """
    across, down = np.linspace(0, 1, 150), np.linspace(0, 1, 46)[:, None]
    y = 5.5 * (1 - down)
    # The free edge hangs from the top, is pulled to the tie, and falls straight from there.
    edge = curve([[5.5, -2.1], [4.6, -2.55], [3.4, -3.15], [2.4, -3.85], [1.62, -4.42],
                  [1.5, -4.46], [1.36, -4.42], [0.7, -4.30], [0.0, -4.25]], 200)  # fmt: skip
    inner = np.interp(y, edge[::-1, 0], edge[::-1, 1])
    outer = -6.2 + 0.55 * np.exp(-(((y - 1.5) / 0.35) ** 2))
    gather = np.exp(-(((y - 1.5) / 0.28) ** 2))
    # Folds wander a little from top to bottom, and are sharper in front than behind.
    wander = 0.35 * np.sin(1.7 * y + 4 * across) + 0.25 * np.sin(3.1 * y + 9 * across)
    phase = 2 * np.pi * 10 * across**1.1 + wander
    fold = np.sin(phase + 0.45 * np.sin(phase)) + 0.25 * np.sin(2.3 * phase + 1.0)
    depth = (0.13 + 0.05 * np.sin(5 * across + 1)) * (1 - 0.55 * gather)
    x = outer + (inner - outer) * across + 0.02 * np.cos(phase)
    # Above the tie the cloth bags forward.
    bag = 0.22 * np.exp(-(((y - 1.95) / 0.45) ** 2)) * np.sin(np.pi * across)
    z = 0.1 + depth * fold + bag - 0.10 * gather
    return sheet(np.stack([x, np.broadcast_to(y, x.shape), z], axis=-1)[::-1])


def tie_back() -> Mesh:
    """The rope that holds the left curtain, with a tassel."""
    turn = np.linspace(0, 2 * np.pi, 41)
    loop = np.stack(
        [-5.08 + 0.72 * np.cos(turn), 1.5 - 0.10 * np.cos(turn), 0.06 + 0.30 * np.sin(turn)], 1
    )
    twist = 0.045 + 0.008 * np.sin(24 * turn[:, None] + np.linspace(0, 4 * np.pi, 9))
    tassel = [(0.0, 0.10), (0.03, 0.08), (0.045, 0.04), (0.022, 0.0), (0.05, -0.04),
              (0.06, -0.22), (0.058, -0.24), (0.0, -0.24)]  # fmt: skip
    hang = lathe(tassel, rings=25, turns=20)
    return join([tube(loop, twist, sides=8), hang.placed((-4.42, 1.30, 0.28))])


def scallop(x: Floats) -> Floats:
    """y of the lower edge of the valance."""
    swag = np.abs(np.sin(np.pi * (x + 5.6) / 1.4)) ** 0.8
    return 4.52 - 0.26 * swag


def valance_folds(x: Floats, y: Floats) -> Floats:
    """z of the valance: pleats that splay as they fall."""
    drop = np.clip((5.6 - y) / 1.2, 0, 1.2)
    phase = 2 * np.pi * x / 0.35
    return 0.42 + 0.055 * drop * np.sin(phase + 0.4 * np.sin(phase)) + 0.03 * np.sin(2.1 * x)


def valance() -> Mesh:
    """The cloth along the top of the opening."""
    x = np.linspace(-6.3, 6.3, 361)
    down = np.linspace(1, 0, 9)[:, None]
    y = 5.6 + (scallop(x) - 5.6) * down
    return sheet(np.stack([x + 0 * y, y, valance_folds(x, y)], axis=-1))


def fringe() -> Mesh:
    """The gold fringe below the valance."""
    x = np.linspace(-6.3, 6.3, 361)
    below = np.array([0.11, 0.02, 0.0, -0.015])[:, None]
    y = scallop(x) - below
    z = valance_folds(x, y) + 0.012 + 0.01 * np.sin(2 * np.pi * x / 0.07)
    return sheet(np.stack([x + 0 * y, y, z], axis=-1))


def wing_curtains() -> Mesh:
    """Black legs at the sides and borders above, in two rows."""
    cloths = []
    for z, inner in ((-2.2, 4.15), (-4.3, 4.45)):
        across, y = np.linspace(0, 1, 60), np.linspace(0, 5.6, 10)[:, None]
        fold = np.sin(2 * np.pi * 9 * across + 0.5 * np.sin(1.3 * y + z) + z)
        x = inner + 2.6 * across
        leg = sheet(np.stack([x + 0 * y, y + 0 * x, z + 0.07 * fold], axis=-1))
        cloths += [leg, leg.mirrored()]
        x, y = np.linspace(-7, 7, 120), np.array([[4.72], [5.8]])
        border = z - 0.05 + 0.05 * np.sin(2 * np.pi * x / 0.5) * (5.8 - y)
        cloths.append(sheet(np.stack([x + 0 * y, y + 0 * x, border], axis=-1)))
    return join(cloths)


def ground_row() -> Mesh:
    """A cut-out of far hills, with cypresses and a tower, that hides the lights behind it."""
    x = np.linspace(-6.2, 6.2, 700)
    hills = 0.62 + 0.20 * np.sin(0.55 * x + 2.2) + 0.10 * np.sin(1.3 * x + 0.5)
    hills += 0.025 * np.sin(4.1 * x) + 0.012 * np.sin(11 * x + 1)
    top = hills
    for at, tall, wide in [(-3.35, 0.34, 0.07), (-3.12, 0.52, 0.085), (-0.75, 0.40, 0.075),
                           (-0.52, 0.28, 0.06), (0.05, 0.33, 0.065), (1.5, 0.3, 0.06)]:  # fmt: skip
        across = np.clip(np.abs(x - at) / wide, 0, 1)
        tree = tall * (1 - across**1.6) * (1 + 0.05 * np.sin(60 * x))
        top = np.maximum(top, hills * (across < 1) + tree)
    tower = np.where((x > -1.82) & (x < -1.62), 1.16, 0.0)
    battlement = 0.05 * ((x * 14) % 1 < 0.5) * (tower > 0)
    wall = np.where((x > -2.15) & (x < -1.35), 0.90, 0.0)
    roof = np.where((x > -1.6) & (x < -1.3), 1.10 - 1.2 * np.abs(x + 1.45), 0.0)
    top = np.maximum.reduce([top, tower + battlement, wall, roof])
    y = np.linspace(0, 1, 3)[:, None] * top
    z = np.full_like(y, -5.0)
    flat = np.stack([x + 0 * y, y, z], axis=-1)
    # Flat shading: a painted plywood cut-out has no relief.
    mesh = sheet(flat)
    return Mesh(mesh.points, np.broadcast_to([0.0, 0.0, 1.0], mesh.points.shape), mesh.faces)


# --- The set: platform, steps, balustrade, cottage door ------------------------------------


def platform() -> Mesh:
    """A platform at the right with three steps that lead up to it from the left front."""
    deck = rounded_box((3.3, 0.48, 2.3), radius=0.02).placed((3.05, 0.0, -3.25))
    steps = [
        rounded_box((1.5, 0.16 * k, 0.34), radius=0.015).placed((2.4, 0.0, -1.95 + 0.34 * (2 - k)))
        for k in (1, 2)
    ]
    return join([deck, *steps])


def baluster(height: float) -> Mesh:
    """One turned post."""
    outline = [(0.0, 1.0), (0.05, 1.0), (0.05, 0.95), (0.028, 0.92), (0.03, 0.80), (0.036, 0.62),
               (0.062, 0.36), (0.07, 0.24), (0.045, 0.14), (0.032, 0.11), (0.055, 0.08),
               (0.055, 0.0)]  # fmt: skip
    return lathe(np.array(outline) * (1.0, height), rings=37, turns=14)


def balustrade() -> Mesh:
    """A rail on turned posts along the right half of the platform's front."""
    y, z = 0.48, -2.22
    posts = [baluster(0.60).placed((x, y, z)) for x in np.linspace(3.48, 4.60, 5)]
    newel = [(0.0, 0.98), (0.05, 0.965), (0.075, 0.91), (0.05, 0.85), (0.03, 0.83), (0.075, 0.80),
             (0.08, 0.78), (0.08, 0.70)]  # fmt: skip
    post = rounded_box((0.15, 0.72, 0.15), radius=0.015)
    ends = [join([post, lathe(newel, rings=29, turns=20)]).placed((x, y, z)) for x in (3.25,)]
    rail = rounded_box((1.46, 0.07, 0.12), radius=0.02).placed((3.96, y + 0.60, z))
    return join([*posts, *ends, rail])


# The doorway: half its width, the height where its arch begins, and the wall around it.
HALF, SPRING, WALL_HALF, WALL_TOP, THICK = 0.50, 1.55, 1.32, 2.95, 0.26
DOOR_AT, DOOR_TURN = (2.75, 0.48, -3.95), -14.0


def arch(radius_out: float, count: int = 33) -> Floats:
    """(count, 2) points from the foot of the left jamb over the arch to the right one."""
    half = HALF + radius_out
    turn = np.linspace(np.pi, 0, count - 8)
    over = np.stack([half * np.cos(turn), SPRING + half * np.sin(turn)], axis=1)
    rise = np.linspace(0, SPRING, 5)[:-1]
    left = np.stack([np.full(4, -half), rise], axis=1)
    right = np.stack([np.full(4, half), rise[::-1]], axis=1)
    return np.concatenate([left, over, right])


def door_wall() -> tuple[Mesh, Mesh]:
    """A painted wall with an arched opening and a gable, and its black back; u, v are in 3 m."""
    inner = arch(0.0)
    # Each point of the arch is joined to the point of the outline in the same direction.
    outline = np.array([(-WALL_HALF, 0.0), (-WALL_HALF, 2.35), (-0.78, WALL_TOP), (0.0, 3.22),
                        (0.78, WALL_TOP), (WALL_HALF, 2.35), (WALL_HALF, 0.0)])  # fmt: skip
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(outline, axis=0), axis=1))])
    share = np.linspace(0, length[-1], len(inner))
    # The point nearest to a corner moves onto it, or the corner would be cut off.
    share[[np.abs(share - corner).argmin() for corner in length]] = length
    outer = np.stack([np.interp(share, length, outline[:, k]) for k in (0, 1)], axis=1)

    def lift(flat: Floats, z: float) -> Floats:
        return np.column_stack([flat, np.full(len(flat), z)])

    def band(a: Floats, b: Floats) -> Iterable[tuple[list[Floats], list[Floats]]]:
        """Quads from polyline a to polyline b, with texture coordinates from x, y and z."""
        for k in range(len(a) - 1):
            quad = [a[k], a[k + 1], b[k + 1], b[k]]
            yield quad, [np.array([(p[0] + p[2]) / 3, p[1] / 3]) for p in quad]

    front, back = 0.5 * THICK, -0.5 * THICK
    strips = [
        *band(lift(outer, front), lift(inner, front)),
        *band(lift(inner, front), lift(inner, back)),
        *band(lift(outer, back), lift(outer, front)),
    ]

    def build(strip: list[tuple[list[Floats], list[Floats]]]) -> Mesh:
        quads = np.array([quad for quad, _ in strip])[:, ::-1]
        mesh = facets(quads, [uv[::-1] for _, uv in strip])
        return mesh.placed(DOOR_AT, turn=DOOR_TURN)

    return build(strips), build(list(band(lift(inner, back), lift(outer, back))))


def door_trim() -> Mesh:
    """The stone moulding around the opening, a sill, and a coping on the gable."""
    path = np.column_stack([arch(0.07, 61), np.full(61, 0.5 * THICK + 0.01)])
    around = np.linspace(0, 2 * np.pi, 13)
    section = 0.085 * (1 + 0.12 * np.cos(4 * around))
    moulding = tube(path, np.broadcast_to(section, (61, 13)), sides=12)
    key = rounded_box((0.20, 0.28, 0.16), radius=0.02).placed((0, SPRING + HALF - 0.04, 0.16))
    feet = [
        rounded_box((0.24, 0.22, 0.2), radius=0.02).placed((s * (HALF + 0.07), 0, 0.13))
        for s in (-1, 1)
    ]
    knots = [(-WALL_HALF - 0.06, 2.33, 0), (-0.78, WALL_TOP, 0), (0, 3.22, 0),
             (0.78, WALL_TOP, 0), (WALL_HALF + 0.06, 2.33, 0)]  # fmt: skip
    slope = np.concatenate([np.linspace(a, b, 8) for a, b in pairwise(knots)])
    slope = np.unique(np.round(slope, 9), axis=0)
    coping = tube(slope, np.full(len(slope), 0.10), sides=10)
    across = coping.normals / (1, 1, 1.7)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    coping = Mesh(coping.points * (1, 1, 1.7), across, coping.faces)
    return join([moulding, key, *feet, coping]).placed(DOOR_AT, turn=DOOR_TURN)


def door_leaf() -> Mesh:
    """The door itself, of five planks, standing open inwards."""
    width = 2 * HALF / 5
    planks = []
    for k in range(5):
        x = -HALF + (k + 0.5) * width
        top = SPRING + np.sqrt(max(HALF**2 - x**2, 0.0)) - 0.02
        planks.append(
            rounded_box((width - 0.008, top, 0.05), radius=0.012).placed((x + HALF, 0, 0))
        )
    bars = [
        rounded_box((0.9, 0.09, 0.03), radius=0.01).placed((HALF, y, 0.035)) for y in (0.4, 1.4)
    ]
    leaf = join([*planks, *bars]).placed((0, 0, 0), turn=72)
    return leaf.placed((-HALF, 0, -0.5 * THICK)).placed(DOOR_AT, turn=DOOR_TURN)


# --- The table, the lantern, the chair -----------------------------------------------------

TABLE_AT = (-1.15, 0.0, -0.75)


def tablecloth() -> Mesh:
    """A round cloth over a round table: flat on top, then folds that deepen as they fall."""
    angle = np.linspace(0, 2 * np.pi, 145)
    s = np.concatenate([np.linspace(0.02, 0.42, 5), np.linspace(0.44, 1.0, 16)])[:, None]
    fall = np.clip((s - 0.44) / 0.56, 0, 1)
    fold = np.cos(11 * angle + 0.8 * np.sin(3 * angle)) + 0.4 * np.cos(7 * angle + 1.2)
    radius = np.minimum(s, 0.44) + 0.10 * fall**0.8 + 0.06 * fall**1.2 * fold
    round_off = 0.02 * np.exp(-(((s - 0.44) / 0.03) ** 2))
    y = 0.76 - 0.62 * fall - round_off
    corners = 0.07 * fall * np.cos(4 * angle + 0.6)
    points = np.stack([radius * np.sin(angle), y + corners, radius * np.cos(angle)], axis=-1)
    return sheet(points[::-1]).placed(TABLE_AT)


def lantern() -> Mesh:
    """The brass cage around the flame (the flame itself is in scene.xml)."""
    base = lathe([(0.0, 0.035), (0.09, 0.035), (0.115, 0.025), (0.125, 0.0)], rings=17, turns=28)
    cap = lathe([(0.0, 0.17), (0.028, 0.165), (0.03, 0.13), (0.06, 0.09), (0.115, 0.03),
                 (0.125, 0.0), (0.11, 0.0)], rings=25, turns=28)  # fmt: skip
    posts = [
        tube(np.array([[x, 0.02, z], [x, 0.16, z], [x, 0.305, z]]), np.full(3, 0.009), sides=8)
        for x, z in ((0.092, 0.04), (-0.04, 0.092), (-0.092, -0.04), (0.04, -0.092))
    ]
    turn = np.linspace(0, 2 * np.pi, 25)
    loop = np.stack([0.045 * np.cos(turn), 0.515 + 0.045 * np.sin(turn), 0 * turn], axis=1)
    ring = tube(loop, np.full(25, 0.008), sides=6)
    parts = [base, cap.placed((0, 0.30, 0)), *posts, ring]
    x, y, z = TABLE_AT
    return join(parts).placed((x + 0.04, y + 0.762, z + 0.02))


def table_things() -> Mesh:
    """A goblet and a bowl beside the lantern."""
    goblet = [(0.028, 0.12), (0.042, 0.19), (0.048, 0.19), (0.046, 0.14), (0.03, 0.10),
              (0.010, 0.085), (0.010, 0.03), (0.035, 0.008), (0.04, 0.0)]  # fmt: skip
    x, y, z = TABLE_AT
    cup = lathe(goblet, rings=33, turns=24)
    return join([cup.placed((x + 0.25, y + 0.76, z + 0.16))])


def books() -> Mesh:
    """Two books on the other side of the lantern."""
    x, y, z = TABLE_AT
    lower = rounded_box((0.26, 0.045, 0.19), radius=0.008).placed(
        (x - 0.25, y + 0.76, z + 0.14), turn=25
    )
    upper = rounded_box((0.22, 0.04, 0.16), radius=0.008).placed(
        (x - 0.24, y + 0.805, z + 0.13), turn=-8
    )
    return join([lower, upper])


def chair() -> Mesh:
    """A wooden chair with turned legs and a slatted back, half turned from the table."""
    leg = [(0.0, 0.44), (0.022, 0.44), (0.02, 0.36), (0.03, 0.30), (0.02, 0.25), (0.024, 0.12),
           (0.016, 0.0)]  # fmt: skip
    front = [lathe(leg, rings=25, turns=12).placed((s * 0.19, 0, 0.18)) for s in (-1, 1)]
    back = []
    for side in (-0.2, 0.2):
        spine = [(0.9 * side, 0, -0.22), (side, 0.44, -0.18), (side, 0.75, -0.20)]
        post = curve([*spine, (side, 1.06, -0.27)], 17)
        back.append(tube(post, np.full(17, 0.021), sides=10))
    seat = rounded_box((0.46, 0.045, 0.43), radius=0.018).placed((0, 0.44, 0))
    slats = []
    for height, z in ((0.62, -0.188), (0.79, -0.203), (0.97, -0.243)):
        bow = curve([(-0.2, height, z), (0, height + 0.02, z - 0.03), (0.2, height, z)], 13)
        slat = tube(bow, np.full(13, 0.018), sides=10)
        tall = slat.points.copy()
        tall[:, 1] = height + (tall[:, 1] - height) * 2.2
        slats.append(Mesh(tall, slat.normals, slat.faces))
    return join([*front, *back, seat, *slats]).placed((-2.05, 0, -0.85), turn=62)


# --- The tree ------------------------------------------------------------------------------


def grow(
    rng: np.random.Generator,
    start: Floats,
    heading: Floats,
    *,
    radius: float,
    length: float,
    order: int,
) -> list[Mesh]:
    """A branch and all that grows from it. Branches seek the light, and lean downwind (+x)."""
    steps = max(5, int(length / 0.12))
    path, forward, drift = [start], heading / np.linalg.norm(heading), rng.normal(0, 1, 3)
    for _ in range(steps):
        drift = 0.8 * drift + 0.6 * rng.normal(0, 1, 3)
        seek = np.array([0.05, 0.045 + 0.02 * order, 0.0])
        forward = forward + 0.075 * drift * (1.0 if order else 0.6) + seek
        forward = forward / np.linalg.norm(forward)
        path.append(path[-1] + forward * length / steps)
    points = np.array(path)
    share = np.linspace(0, 1, len(points))
    end = 0.50 if order < 2 else 0.2
    radii = radius * (1 + (end - 1) * share)
    sides = (14, 8, 6, 4, 4)[order]
    if order == 0:
        # The foot spreads into roots, and the bark runs up the trunk in ribs.
        angle = np.linspace(0, 2 * np.pi, sides + 1)
        flare = 0.9 * np.exp(-share / 0.07)[:, None] * (1 + 0.5 * np.cos(5 * angle + 0.7))
        ribs = 0.10 * np.cos(3 * angle + 5 * share[:, None]) + 0.06 * np.cos(7 * angle)
        meshes = [tube(points, radii[:, None] * (1 + flare + ribs), sides=sides)]
    else:
        meshes = [tube(points, radii, sides=sides)]
    if order == 4:
        return meshes

    count = (6, 5, 4, 3)[order]
    turn = rng.uniform(0, 2 * np.pi)
    for k in range(count):
        place = 0.48 + 0.52 * (k + 1) / count if order == 0 else 0.30 + 0.70 * (k + 1) / count
        at = min(int(place * (len(points) - 1)), len(points) - 1)
        along = points[at] - points[max(at - 1, 0)]
        along /= np.linalg.norm(along)
        # The golden angle spreads the branches around; the last one carries straight on.
        turn += 2.399963
        side = np.cross(along, [np.cos(turn), 0.3, np.sin(turn)])
        side /= max(np.linalg.norm(side), 1e-9)
        lean = np.radians(rng.uniform(12, 22) if k == count - 1 else rng.uniform(38, 62))
        child = np.cos(lean) * along + np.sin(lean) * side
        meshes += grow(
            rng,
            points[at],
            child,
            radius=radii[at] * rng.uniform(0.58, 0.72),
            length=length * rng.uniform(0.52, 0.70),
            order=order + 1,
        )
    return meshes


def tree() -> Mesh:
    """A bare old tree at the left."""
    rng = np.random.default_rng(11)
    start, heading = np.array([-2.95, -0.02, -2.9]), np.array([-0.06, 1.0, 0.05])
    return join(grow(rng, start, heading, radius=0.17, length=2.1, order=0))


# --- The woman -----------------------------------------------------------------------------


def smooth_min(a: Floats, b: Floats, k: float) -> Floats:
    """The smaller of two distances, blended over a width k."""
    h = np.clip(0.5 + 0.5 * (b - a) / k, 0, 1)
    return b + (a - b) * h - k * h * (1 - h)


def limb(p: Floats, a: ArrayLike, b: ArrayLike, thick: float, thin: float) -> Floats:
    """About the distance to a cone with round ends: radius `thick` at a, `thin` at b."""
    start, end = np.asarray(a, float), np.asarray(b, float)
    axis = end - start
    along = np.clip((p - start) @ axis / (axis @ axis), 0, 1)
    distance: Floats = np.linalg.norm(p - start - along[..., None] * axis, axis=-1)
    taper: Floats = thick + (thin - thick) * along
    return distance - taper


def ellipsoid(p: Floats, centre: tuple[float, ...], radii: tuple[float, ...]) -> Floats:
    """About the distance to an ellipsoid."""
    q = (p - np.array(centre)) / np.array(radii)
    length: Floats = np.linalg.norm(q, axis=-1)
    slope = np.linalg.norm(q / np.array(radii), axis=-1)
    distance: Floats = length * (length - 1) / np.maximum(slope, 1e-6)
    return distance


# Joints in metres; she faces +z, her right hand (-x) is held out towards the lantern.
SHOULDER, HEAD = {-1: (-0.155, 1.405, 0.0), 1: (0.155, 1.405, 0.0)}, (0.0, 1.635, 0.02)
ELBOW = {-1: (-0.33, 1.20, 0.10), 1: (0.25, 1.15, -0.05)}
HAND = {-1: (-0.56, 1.27, 0.22), 1: (0.13, 1.00, 0.13)}


def gown_distance(p: Floats) -> Floats:
    """Distance to the gown: a pleated skirt with a train, a bodice, wide sleeves."""
    y = p[..., 1]
    low = np.clip(1.05 - y, 0, 1.05) / 1.05
    # The train draws the skirt backwards near the floor.
    x, z = p[..., 0] + 0.05 * low**2, p[..., 2] + 0.20 * low**2.5
    angle, reach = np.arctan2(x, z / (1 + 0.30 * low**2)), np.hypot(x, z / (1 + 0.30 * low**2))
    outline = curve([(0.0, 0.47), (0.06, 0.435), (0.3, 0.325), (0.6, 0.245), (0.85, 0.19),
                     (0.95, 0.165), (1.06, 0.122), (1.15, 0.128)], 64)  # fmt: skip
    radius = np.interp(y, outline[:, 0], outline[:, 1])
    folds = np.cos(10 * angle + 1.2 * np.sin(2 * angle) + 0.8 * low)
    folds = folds + 0.35 * np.cos(17 * angle + 2)
    skirt = 0.75 * (reach - radius - 0.030 * low**1.1 * folds)
    skirt = np.maximum(skirt, np.maximum(-y, y - 1.12))
    bodice = ellipsoid(p, (0.0, 1.25, 0.0), (0.142, 0.235, 0.102))
    bust = ellipsoid(p, (0.0, 1.285, 0.052), (0.112, 0.078, 0.074))
    body = smooth_min(smooth_min(skirt, bodice, 0.05), bust, 0.05)
    for side in (-1, 1):
        upper = limb(p, SHOULDER[side], ELBOW[side], 0.062, 0.055)
        wrist = 0.75 * np.array(HAND[side]) + 0.25 * np.array(ELBOW[side])
        lower = limb(p, ELBOW[side], wrist - (0, 0.05, 0), 0.052, 0.082)
        lower = np.maximum(lower, limb(p, ELBOW[side], wrist, 0.09, 0.082))
        body = smooth_min(body, smooth_min(upper, lower, 0.04), 0.045)
    return np.maximum(body, -ellipsoid(p, (0.0, 1.50, 0.05), (0.085, 0.085, 0.10)))


def head_distance(p: Floats) -> Floats:
    """Distance to head and neck: a skull, and the planes of a face in front of it."""
    q = p - np.array(HEAD)
    side = np.abs(q[..., 0])
    m = np.stack([side, q[..., 1], q[..., 2]], axis=-1)  # both halves of the face at once
    head = ellipsoid(q, (0.0, 0.020, -0.008), (0.073, 0.098, 0.094))
    face = ellipsoid(q, (0.0, -0.028, 0.024), (0.058, 0.088, 0.066))
    head = smooth_min(head, face, 0.03)
    cheek = ellipsoid(m, (0.036, -0.026, 0.058), (0.022, 0.019, 0.021))
    chin = ellipsoid(q, (0.0, -0.103, 0.060), (0.021, 0.017, 0.019))
    jaw = limb(m, (0.055, -0.050, -0.002), (0.014, -0.101, 0.050), 0.012, 0.013)
    for part, soft in ((jaw, 0.035), (cheek, 0.028), (chin, 0.022)):
        head = smooth_min(head, part, soft)
    socket = ellipsoid(m, (0.031, 0.003, 0.102), (0.023, 0.013, 0.020))
    head = -smooth_min(-head, socket, 0.016)
    brow = limb(m, (0.012, 0.021, 0.085), (0.045, 0.019, 0.069), 0.008, 0.005)
    lid = ellipsoid(m, (0.030, 0.002, 0.071), (0.017, 0.011, 0.015))
    bridge = limb(q, (0.0, 0.012, 0.086), (0.0, -0.028, 0.108), 0.0065, 0.0095)
    wing = ellipsoid(m, (0.010, -0.033, 0.094), (0.0075, 0.007, 0.010))
    mouth = ellipsoid(q, (0.0, -0.064, 0.078), (0.026, 0.018, 0.016))
    for part, soft in ((brow, 0.014), (lid, 0.006), (bridge, 0.011), (wing, 0.006), (mouth, 0.02)):
        head = smooth_min(head, part, soft)
    neck = limb(p, (0, 1.36, -0.012), (0, 1.58, -0.004), 0.054, 0.045)
    return smooth_min(head, neck, 0.022)


def lips_distance(p: Floats) -> Floats:
    """Distance to the lips, which stand a little proud of the mouth."""
    q = p - np.array(HEAD)
    m = np.stack([np.abs(q[..., 0]), q[..., 1], q[..., 2]], axis=-1)
    upper = limb(m, (0.004, -0.0600, 0.0945), (0.026, -0.0645, 0.0815), 0.0042, 0.0026)
    lower = limb(m, (0.000, -0.0685, 0.0940), (0.022, -0.0660, 0.0835), 0.0050, 0.0026)
    return smooth_min(upper, lower, 0.002)


def skin_distance(p: Floats) -> Floats:
    """Distance to the shoulders and hands."""
    body = ellipsoid(p, (0.0, 1.385, 0.0), (0.155, 0.075, 0.085))
    body = smooth_min(body, limb(p, (0, 1.40, -0.01), (0, 1.47, -0.006), 0.056, 0.05), 0.05)
    for side in (-1, 1):
        elbow, hand = np.array(ELBOW[side]), np.array(HAND[side])
        forward = (hand - elbow) / np.linalg.norm(hand - elbow)
        body = np.minimum(body, limb(p, hand - 0.12 * forward, hand, 0.03, 0.024))
        palm = limb(p, hand, hand + 0.07 * forward, 0.032, 0.020)
        thumb = limb(p, hand, hand + 0.045 * forward + (0, 0.035, 0), 0.014, 0.009)
        body = smooth_min(body, smooth_min(palm, thumb, 0.015), 0.02)
    return body


def hair_distance(p: Floats) -> Floats:
    """Distance to the hair: waved over the ears and drawn back into a knot."""
    q = p - np.array(HEAD)
    m = np.stack([np.abs(q[..., 0]), q[..., 1], q[..., 2]], axis=-1)
    cap = ellipsoid(q, (0.0, 0.031, -0.012), (0.082, 0.100, 0.105))
    wave = ellipsoid(m, (0.064, -0.004, -0.004), (0.020, 0.050, 0.046))
    cap = smooth_min(cap, wave, 0.02)
    # The hairline is an oval round the face.
    face = ellipsoid(q, (0.0, -0.034, 0.112), (0.064, 0.112, 0.100))
    cap = -smooth_min(-cap, face, 0.008)
    coil = ellipsoid(q, (0.0, 0.030, -0.142), (0.060, 0.058, 0.048))
    strands = 0.0016 * np.sin(170 * m[..., 0] + 90 * q[..., 1] - 60 * q[..., 2])
    return smooth_min(cap, coil, 0.02) + strands


def brow_distance(p: Floats) -> Floats:
    """Distance to brows and lashes, which are of the hair's colour."""
    q = p - np.array(HEAD)
    m = np.stack([np.abs(q[..., 0]), q[..., 1], q[..., 2]], axis=-1)
    inner = limb(m, (0.015, 0.0285, 0.0890), (0.034, 0.0320, 0.0785), 0.0030, 0.0034)
    outer = limb(m, (0.034, 0.0320, 0.0785), (0.051, 0.0225, 0.0640), 0.0034, 0.0016)
    lash = limb(m, (0.018, -0.0005, 0.0850), (0.043, -0.0020, 0.0770), 0.0036, 0.0030)
    return np.minimum(np.minimum(inner, outer), lash)


FIGURE_AT, FIGURE_TURN, FIGURE_SCALE = (0.35, 0.0, -0.75), -24.0, 1.12


def woman() -> dict[str, Mesh]:
    """The standing figure, in the materials it is made of."""
    x, y, z = HEAD
    low, high = np.array([x - 0.12, y - 0.16, z - 0.20]), np.array([x + 0.12, y + 0.16, z + 0.13])
    gown = surface_nets(gown_distance, (-0.70, -0.02, -0.85), (0.60, 1.55, 0.60), cell=0.025)
    skin = surface_nets(skin_distance, (-0.72, 0.85, -0.2), (0.4, 1.60, 0.4), cell=0.013)
    head = surface_nets(head_distance, low, high, cell=0.0065)
    hair = surface_nets(hair_distance, low, high, cell=0.008)
    brows = surface_nets(brow_distance, low, high, cell=0.0030)
    parts = {
        "figure_gown": gown,
        "figure_skin": join([skin, head]),
        "figure_hair": join([hair, brows]),
        "figure_lips": surface_nets(lips_distance, low, high, cell=0.0030),
    }
    return {
        name: mesh.placed(FIGURE_AT, turn=FIGURE_TURN, scale=FIGURE_SCALE)
        for name, mesh in parts.items()
    }


# --- Footlights ----------------------------------------------------------------------------


def footlight_shells() -> Mesh:
    """Brass scallop shells along the front edge; the strip of light hides behind them."""
    u, v = np.linspace(-1, 1, 25), np.linspace(0, 1, 7)[:, None]
    ribs = 1 + 0.05 * np.cos(8 * np.pi * u) * v
    x = 0.20 * np.sin(u * np.pi / 2) * (0.55 + 0.45 * np.sin(v * np.pi / 2)) * ribs
    y = 0.16 * v * np.cos(0.38 * np.pi * u) * ribs
    z = 0.09 * (1 - v**2) * np.cos(u * np.pi / 2) - 0.05 * v
    shell = sheet(np.stack([x + 0 * v, y, z], axis=-1))
    return join([shell.placed((x, 0.0, 1.32)) for x in np.linspace(-4.8, 4.8, 17)])


# --- Textures ------------------------------------------------------------------------------


def boards_texture(size: int = 768, boards: int = 32) -> NDArray[np.uint8]:
    """4.48 m of boards, each with its own tone, grain and end joint; it tiles both ways."""
    rng = np.random.default_rng(3)
    per = size // boards
    image = np.empty((size, size, 3))
    along, across = np.arange(size) / size, (np.arange(per) + 0.5) / per

    def wave(phase: Floats, strength: float) -> Floats:
        """A sine of random height and place."""
        return rng.normal(0, strength) * np.sin(2 * np.pi * (phase + rng.uniform()))

    for k in range(boards):
        tone = rng.normal(0, 0.16) + 0.10 * rng.choice([-1, 1], p=[0.3, 0.7])
        hue = rng.normal(0, 0.05)
        # Grain: a few lines across, bent slowly along the board; and wear from feet.
        light = np.full((size, per), tone)
        bend = np.sum([wave(n * along, 0.10 / n) for n in (1, 2, 3, 5)], axis=0)[:, None]
        for lines in (1.3, 2.1, 3.7, 5.9):
            light += wave(lines * (across + bend), 0.07)
        for n in (1, 2, 4):
            light += wave(n * along, 0.06)[:, None]
        light = np.exp2(light)
        # The gap between boards, and one butt joint with its shadow.
        light[:, 0] *= 0.35
        light[:, -1] *= 0.75
        light[rng.integers(0, size)] *= 0.4
        wood = np.array([0.36, 0.205, 0.115]) * (1 + hue * np.array([0.3, 0.0, -0.6]))
        image[:, k * per : (k + 1) * per] = light[..., None] * wood
    return encode(image)


def masonry_texture(size: int = 512) -> NDArray[np.uint8]:
    """3 m x 3 m of a painted wall: courses of stone under worn plaster."""
    rng = np.random.default_rng(8)
    y, x = np.mgrid[0:size, 0:size] / size

    def cloud(octaves: Iterable[int]) -> Floats:
        """Smooth noise with period 1, about N(0, 1)."""
        total = np.zeros((size, size))
        for n in octaves:
            for _ in range(5):
                fx, fy = rng.integers(-n, n + 1, 2)
                total += np.sin(2 * np.pi * (fx * x + fy * y + rng.uniform())) / np.sqrt(n)
        spread: float = total.std()
        return total / spread

    rows, warp = 14, 0.0025 * cloud([2, 4, 9])
    row = np.floor((y + warp) * rows) % rows
    wide = 5 + (row.astype(int) * 7 % 3)
    column = (x + 0.5 * warp) * wide + 0.37 * row
    in_row, in_column = ((y + warp) * rows) % 1, column % 1
    joint = np.minimum(
        np.minimum(in_row, 1 - in_row) / rows, np.minimum(in_column, 1 - in_column) / wide
    )
    which = (row * 31 + np.floor(column) % wide * 17).astype(int) % 4096
    face = np.clip(joint / 0.007 - 0.2 + 0.12 * cloud([17, 29]), 0, 1)
    face = face * face * (3 - 2 * face)
    tone, out = rng.normal(0, 0.20, 4096)[which], rng.normal(0, 0.10, 4096)[which]
    grain = cloud([9, 19, 37])
    stone = np.array([0.44, 0.37, 0.29]) * np.exp2(tone + 0.10 * grain)[..., None]
    stone *= (0.45 + 0.55 * face)[..., None]
    plaster = np.array([0.58, 0.51, 0.41]) * np.exp2(0.09 * cloud([3, 7, 13]))[..., None]
    cover = np.clip(0.5 + 2.2 * (cloud([2, 3, 5]) + 0.10 * grain - 0.85), 0, 1)
    height = face * (0.60 + out + 0.05 * grain)
    height += cover * (0.85 + 0.012 * cloud([5, 11]) - height)
    # Relief is painted, as scene painters do: light from above on every edge.
    edges = np.clip(np.roll(height, -1, axis=0) - np.roll(height, 1, axis=0), -0.5, 0.5)
    color = stone + cover[..., None] * (plaster - stone)
    return encode(color * np.exp2(0.9 * edges)[..., None])


def encode(linear: Floats) -> NDArray[np.uint8]:
    """Linear reflectance to sRGB bytes, in steps of 4 so that the file packs well."""
    clipped = np.clip(linear, 0, 0.85)
    low, high = 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055
    steps: NDArray[np.uint8] = np.round(np.where(clipped <= 0.0031308, low, high) * 63).astype(
        np.uint8
    )
    return 4 * steps


# -------------------------------------------------------------------------------------------


def stage_meshes() -> dict[str, Mesh]:
    """Every mesh of the scene, by file name."""
    curtain, tie = house_curtain(), tie_back()
    wall, wall_back = door_wall()
    return {
        "floor": floor(),
        "apron_front": apron_front(),
        "cyclorama": cyclorama(),
        "curtain_left": curtain,
        "curtain_right": curtain.mirrored(),
        "valance": valance(),
        "trimmings": join([fringe(), tie, tie.mirrored()]),
        "wing_curtains": wing_curtains(),
        "ground_row": ground_row(),
        "platform": platform(),
        "balustrade": balustrade(),
        "door_wall": wall,
        "door_back": wall_back,
        "door_trim": door_trim(),
        "door_leaf": door_leaf(),
        "tablecloth": tablecloth(),
        "lantern_cage": join([lantern(), table_things()]),
        "books": books(),
        "chair": chair(),
        "tree": tree(),
        **woman(),
        "footlight_shells": footlight_shells(),
    }


def main() -> None:
    """Write `meshes/*.ply` and `textures/*.png` beside this file and say how big each is."""
    for folder in ("meshes", "textures"):
        (HERE / folder).mkdir(exist_ok=True)
    triangles = size = 0
    for name, mesh in stage_meshes().items():
        path = HERE / "meshes" / f"{name}.ply"
        write_ply(path, mesh)
        triangles, size = triangles + len(mesh.faces), size + path.stat().st_size
        print(f"{path.name:22} {len(mesh.faces):6} triangles {path.stat().st_size:8} bytes")
    for name, image in {"boards": boards_texture(), "masonry": masonry_texture()}.items():
        path = HERE / "textures" / f"{name}.png"
        write_png(path, image)
        size += path.stat().st_size
        print(
            f"{path.name:22} {image.shape[1]:6} x {image.shape[0]:<7} {path.stat().st_size:8} bytes"
        )
    print(f"{'together':22} {triangles:6} triangles {size:8} bytes")


if __name__ == "__main__":
    main()
