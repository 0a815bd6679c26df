"""Make the example office: twelve luminaires with photometric files, and planes to measure on.

    python scenes/office/make_office.py

writes `office.xml`, its lights file and its planes file, and three photometric files (IES LM-63),
whose webs are invented. Lengths are in metres, z is up; the camera looks from the south-west.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

HERE = Path(__file__).resolve().parent

#: Width (x), depth (y) and height of the room.
ROOM = (8.4, 6.0, 3.0)
DESKS = (2.0, 4.2, 6.4)

#: Chromaticity, lumens and watts of the two kinds of white LEDs in a pendant and in a wall washer.
WARM, COOL = (0.4599, 0.4106), (0.3457, 0.3585)

Web = Callable[[float, float], float]


def batwing(c: float, gamma: float) -> float:
    """Candela of a pendant that is mostly wide across, and gives a fifth of its light upwards."""
    across = math.cos(math.radians(c)) ** 2
    if gamma > 90:
        return 190 * math.cos(math.radians(180 - gamma)) ** 0.7
    wide = 1250 * math.exp(-(((gamma - 30) / 20) ** 2)) + 420 * math.exp(-((gamma / 28) ** 2))
    along = 1050 * math.cos(math.radians(gamma)) ** 2.4
    blended = across * wide + (1 - across) * along
    return blended * min(1.0, max(0.0, (90 - gamma) / 8))


def washer(c: float, gamma: float) -> float:
    """Candela of a wall washer, which throws its light towards C = 90."""
    if gamma >= 90:
        return 0.0
    toward = max(0.0, math.sin(math.radians(c)))
    peak = 1900 * toward**2 * math.exp(-(((gamma - 48) / 17) ** 2))
    return peak + 260 * math.cos(math.radians(gamma)) ** 3


def downlight(_: float, gamma: float) -> float:
    """Candela of a round downlight."""
    return 2400 * math.exp(-((gamma / 19) ** 2)) if gamma < 60 else 0.0


#: For each web: its candela, the C-planes and the last angle of the file, watts, and the diameter
#: of its round opening.
WEBS: dict[str, tuple[Web, list[float], float, float, float]] = {
    "pendant": (batwing, [22.5 * k for k in range(5)], 180, 34, 0.14),
    "washer": (washer, [15.0 * k for k in range(25)], 90, 24, 0.12),
    "downlight": (downlight, [0.0], 90, 12, 0.16),
}


def ies_text(name: str) -> str:
    """Return a photometric file of IES LM-63-2002, absolute."""
    web, planes, last, watts, opening = WEBS[name]
    angles = [2.5 * k for k in range(round(last / 2.5) + 1)]
    rows = [[web(c, gamma) for gamma in angles] for c in planes]
    if name == "washer":  # no angle belongs to two planes
        rows[-1] = rows[0]
    for row in rows:  # straight down, all planes are one
        row[0] = sum(x[0] for x in rows) / len(rows) if len(rows) > 1 else row[0]
    lines = [
        "IESNA:LM-63-2002",
        "[TEST] INVENTED",
        "[MANUFAC] lightpaint",
        f"[LUMINAIRE] {name} of the example office",
        "TILT=NONE",
        f"1 -1 1 {len(angles)} {len(planes)} 1 2 {-opening:g} {-opening:g} 0",
        f"1 1 {watts}",
        " ".join(f"{x:g}" for x in angles),
        " ".join(f"{x:g}" for x in planes),
        *(" ".join(f"{x:.1f}" for x in row) for row in rows),
    ]
    return "\n".join(lines) + "\n"


def luminaires() -> dict[str, tuple[str, tuple[float, float, float]]]:
    """Return the web and the place of each luminaire, by name."""
    placed: dict[str, tuple[str, tuple[float, float, float]]] = {}
    for k, x in enumerate(DESKS, 1):
        placed[f"pendant_{k}a"] = "pendant", (x - 0.45, 2.9, 2.25)
        placed[f"pendant_{k}b"] = "pendant", (x + 0.45, 2.9, 2.25)
    for k, x in enumerate((1.2, 3.2, 5.2, 7.2), 1):
        placed[f"washer_{k}"] = "washer", (x, 5.0, 2.95)
    placed["downlight_1"] = "downlight", (2.4, 1.0, 2.95)
    placed["downlight_2"] = "downlight", (6.0, 1.0, 2.95)
    return placed


def _rectangle(
    name: str,
    material: str,
    center: tuple[float, float, float],
    size: tuple[float, float],
    rotate: str = "",
) -> str:
    x, y, z = center
    return (
        f'    <shape type="rectangle" id="{name}">\n'
        f'        <transform name="to_world"><scale x="{size[0] / 2:g}" y="{size[1] / 2:g}"/>'
        f'{rotate}<translate x="{x:g}" y="{y:g}" z="{z:g}"/></transform>\n'
        f'        <ref id="{material}"/>\n'
        "    </shape>\n"
    )


def _box(
    name: str, material: str, low: tuple[float, float, float], high: tuple[float, float, float]
) -> str:
    middle = [(a + b) / 2 for a, b in zip(low, high, strict=True)]
    half = [(b - a) / 2 for a, b in zip(low, high, strict=True)]
    scale = " ".join(f'{axis}="{v:g}"' for axis, v in zip("xyz", half, strict=True))
    place = " ".join(f'{axis}="{v:g}"' for axis, v in zip("xyz", middle, strict=True))
    return (
        f'    <shape type="cube" id="{name}">\n'
        f'        <transform name="to_world"><scale {scale}/><translate {place}/></transform>\n'
        f'        <ref id="{material}"/>\n'
        "    </shape>\n"
    )


MATERIALS = {
    "paint": (0.68, 0.67, 0.64),
    "white": (0.82, 0.82, 0.80),
    "carpet": (0.15, 0.17, 0.20),
    "clay": (0.52, 0.27, 0.18),
    "oak": (0.48, 0.33, 0.20),
    "graphite": (0.05, 0.05, 0.055),
    "leaf": (0.10, 0.24, 0.08),
    "linen": (0.55, 0.52, 0.45),
    "teal": (0.06, 0.26, 0.28),
    "ochre": (0.55, 0.36, 0.08),
    "brick": (0.42, 0.11, 0.08),
}


def scene_text() -> str:
    """Return the scene."""
    width, depth, height = ROOM
    parts = [
        '<scene version="3.0.0">\n'
        "    <!-- Written by make_office.py. -->\n"
        '    <integrator type="path"><integer name="max_depth" value="9"/></integrator>\n'
        '    <sensor type="perspective" id="camera">\n'
        '        <float name="fov" value="72"/>\n'
        '        <transform name="to_world"><lookat origin="0.35, 0.3, 1.75"'
        ' target="5.0, 4.3, 1.12" up="0, 0, 1"/></transform>\n'
        '        <sampler type="independent"><integer name="sample_count" value="128"/></sampler>\n'
        '        <film type="hdrfilm">\n'
        '            <integer name="width" value="640"/><integer name="height" value="360"/>\n'
        '            <rfilter type="box"/>\n'
        "        </film>\n"
        "    </sensor>\n"
    ]
    for name, (r, g, b) in MATERIALS.items():
        parts.append(
            f'    <bsdf type="twosided" id="{name}"><bsdf type="diffuse">'
            f'<rgb name="reflectance" value="{r:g} {g:g} {b:g}"/></bsdf></bsdf>\n'
        )
    x_turn, y_turn = '<rotate x="1" angle="{}"/>', '<rotate y="1" angle="{}"/>'
    parts += [
        _rectangle("floor", "carpet", (width / 2, depth / 2, 0), (width, depth)),
        _rectangle(
            "ceiling", "white", (width / 2, depth / 2, height), (width, depth), x_turn.format(180)
        ),
        _rectangle(
            "south", "paint", (width / 2, 0, height / 2), (width, height), x_turn.format(-90)
        ),
        _rectangle(
            "north", "clay", (width / 2, depth, height / 2), (width, height), x_turn.format(90)
        ),
        _rectangle("west", "paint", (0, depth / 2, height / 2), (height, depth), y_turn.format(90)),
        _rectangle(
            "east", "paint", (width, depth / 2, height / 2), (height, depth), y_turn.format(-90)
        ),
    ]
    for k, x in enumerate(DESKS, 1):
        parts.append(_box(f"desk_{k}", "oak", (x - 0.8, 2.1, 0.71), (x + 0.8, 3.7, 0.74)))
        for side, y in (("a", 2.75), ("b", 3.05)):
            low, high = (x - 0.3, y - 0.01, 0.84), (x + 0.3, y + 0.01, 1.2)
            parts.append(_box(f"screen_{k}{side}", "graphite", low, high))
            low, high = (x - 0.03, y - 0.03, 0.74), (x + 0.03, y + 0.03, 0.86)
            parts.append(_box(f"foot_{k}{side}", "graphite", low, high))
        for j, (dx, dy) in enumerate(((-0.76, 2.14), (0.76, 2.14), (-0.76, 3.66), (0.76, 3.66))):
            low, high = (x + dx - 0.03, dy - 0.03, 0), (x + dx + 0.03, dy + 0.03, 0.71)
            parts.append(_box(f"leg_{k}{j}", "graphite", low, high))
        for side, y in (("a", 1.55), ("b", 4.25)):
            parts.append(
                _box(
                    f"seat_{k}{side}", "teal", (x - 0.24, y - 0.24, 0.4), (x + 0.24, y + 0.24, 0.48)
                )
            )
            back = y - 0.24 if side == "a" else y + 0.2
            parts.append(
                _box(
                    f"back_{k}{side}", "teal", (x - 0.24, back, 0.5), (x + 0.24, back + 0.04, 0.98)
                )
            )
            parts.append(
                _box(
                    f"stand_{k}{side}",
                    "graphite",
                    (x - 0.04, y - 0.04, 0),
                    (x + 0.04, y + 0.04, 0.4),
                )
            )
    parts += [
        _box("picture", "linen", (2.6, 5.95, 1.1), (5.0, 6.0, 2.2)),
        _box("picture_field", "teal", (2.85, 5.94, 1.3), (3.9, 5.95, 2.0)),
        _box("picture_sun", "ochre", (4.05, 5.94, 1.3), (4.75, 5.95, 2.0)),
        _box("sideboard", "oak", (6.2, 5.5, 0.1), (8.1, 5.96, 0.8)),
        _box("books", "brick", (6.5, 5.6, 0.8), (6.9, 5.85, 1.06)),
        _box("box", "ochre", (7.0, 5.6, 0.8), (7.3, 5.85, 0.98)),
        _box("pot", "linen", (7.6, 4.7, 0), (8.0, 5.1, 0.42)),
    ]
    leaves = ((7.8, 4.9, 0.95, 0.34), (7.68, 4.78, 1.32, 0.24), (7.92, 5.0, 1.4, 0.22))
    for k, (x, y, z, radius) in enumerate(leaves, 1):
        parts.append(
            f'    <shape type="sphere" id="leaves_{k}"><point name="center" value="{x}, {y}, {z}"/>'
            f'<float name="radius" value="{radius}"/><ref id="leaf"/></shape>\n'
        )
    parts.append(
        '    <shape type="rectangle" id="window">\n'
        '        <transform name="to_world"><scale x="0.75" y="1.9"/><rotate y="1" angle="-90"/>'
        '<translate x="8.39" y="2.9" z="1.75"/></transform>\n'
        '        <emitter type="area"><rgb name="radiance" value="7 10 17"/></emitter>\n'
        "    </shape>\n"
    )
    for name, (_, (x, y, z)) in luminaires().items():
        parts.append(
            f'    <emitter type="point" id="{name}">'
            f'<point name="position" value="{x:g}, {y:g}, {z:g}"/>'
            '<rgb name="intensity" value="1"/></emitter>\n'
        )
    return "".join(parts) + "</scene>\n"


def lights_text() -> str:
    """Return the lights file: a luminaire in place of each point light."""
    lines = [
        "# Written by make_office.py. A radiance of 1 is 1 cd/m2.",
        "cd_per_unit = 1",
        "",
        "[light.window]",
        "lock = true",
        "",
        '[light."pendant_*"]',
        'photometry = "pendant.ies"',
        "factor = 0.8",
        "emitters = [",
        f'    {{ name = "warm", xy = {list(WARM)}, lm = 2300, watts = 21 }},',
        f'    {{ name = "cool", xy = {list(COOL)}, lm = 2500, watts = 21 }},',
        "]",
        "",
        '[light."washer_*"]',
        'photometry = "washer.ies"',
        "factor = 0.8",
        "emitters = [",
        f'    {{ name = "warm", xy = {list(WARM)}, lm = 1500, watts = 14 }},',
        f'    {{ name = "cool", xy = {list(COOL)}, lm = 1600, watts = 14 }},',
        "]",
        "",
        '[light."downlight_*"]',
        'photometry = "downlight.ies"',
        "factor = 0.8",
        'color = "2700K"',
    ]
    return "\n".join(lines) + "\n"


PLANES = """\
# Written by make_office.py.
[power]
area = 50.4

[plane.room]
shape = "floor"
height = 0.75
margin = 0.5
uniformity = 0.1

[plane.wall]
walls = ["north"]
margin = 0.5
mean = 75
"""

#: A desk of the planes file.
DESK = """
[plane.desk_{number}]
shape = "desk_{number}"
height = 0.01
grid = 0.2
mean = 500
uniformity = 0.6
"""

#: Who sits at the first desk, and who comes in.
OBSERVERS = """
[observer.seat_1]
at = [2.0, 1.55, 1.2]
towards = [2.0, 5.0, 1.2]

[observer.door]
at = "camera"
"""


def main() -> None:
    """Write all files."""
    for name in WEBS:
        (HERE / f"{name}.ies").write_text(ies_text(name), encoding="ascii", newline="\n")
    (HERE / "office.xml").write_text(scene_text(), encoding="utf-8")
    (HERE / "office.lights.toml").write_text(lights_text(), encoding="utf-8")
    desks = "".join(DESK.format(number=k + 1) for k in range(len(DESKS)))
    (HERE / "office.planes.toml").write_text(PLANES + desks + OBSERVERS, encoding="utf-8")


if __name__ == "__main__":
    main()
