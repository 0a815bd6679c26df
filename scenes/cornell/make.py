"""Make the meshes of the Cornell box: two softly rounded boxes, a vase and a marble.

    python scenes/cornell/make.py

needs only numpy, takes a moment, and writes the same bytes every time. What the scene looks
like (materials, lights, camera) is in `scene.xml`, by hand. Lengths are in metres: the room
is 2 m wide, 2 m high and 2 m deep, its floor centred on the origin, y up, the open side at +z.
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))  # shapes.py lives one folder up

from shapes import Mesh, ball, lathe, rounded_box, write_ply  # noqa: E402

# (radius, height) from the inside of the vase over its lip and down to its foot.
VASE = [
    *((0.045, 0.05), (0.075, 0.18), (0.040, 0.30), (0.045, 0.36), (0.062, 0.385)),
    *((0.068, 0.380), (0.055, 0.35), (0.050, 0.30), (0.088, 0.20), (0.110, 0.12)),
    *((0.100, 0.05), (0.066, 0.008), (0.050, 0.0)),
]


def cornell_meshes() -> dict[str, Mesh]:
    """Everything in the room that is not a flat wall, by file name."""
    tall = rounded_box((0.56, 1.12, 0.56), radius=0.03, steps=4)
    short = rounded_box((0.58, 0.54, 0.58), radius=0.03, steps=4)
    return {
        "tall_box": tall.placed((-0.36, 0.0, -0.34), turn=18),
        "short_box": short.placed((0.40, 0.0, 0.18), turn=-20),
        "vase": lathe(VASE, rings=49, turns=48).placed((0.40, 0.54, 0.18)),
        "marble": ball(0.15).placed((-0.30, 0.0, 0.48)),
    }


def main() -> None:
    """Write `meshes/*.ply` beside this file and say how big each is."""
    (HERE / "meshes").mkdir(exist_ok=True)
    for name, mesh in cornell_meshes().items():
        path = HERE / "meshes" / f"{name}.ply"
        write_ply(path, mesh)
        print(f"{path.name:16} {len(mesh.faces):6} triangles {path.stat().st_size:8} bytes")


if __name__ == "__main__":
    main()
