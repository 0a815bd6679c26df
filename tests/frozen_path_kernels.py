"""Print how many kernels frozen paths take: `python frozen_path_kernels.py ROOM.XML LIGHT ...`.

A program of its own, since what a process compiled before may change the order of variables.
"""

import json
import sys
from typing import Any

from lightpaint.placement.paths.frozen_paths import FrozenPaths
from lightpaint.scene.scene_reader import load_scene

#: What a vertex of a path asks of its surface.
CALLS = ("BSDF::sample()", "BSDF::eval()")


def count_kernels(path: str, lights: list[str]) -> list[int]:
    """Return the number of kernels with each of `CALLS`, for films and paths of several sizes."""
    room = load_scene(path)
    import drjit as dr

    sites = [room.light(name).members[0].site for name in lights]
    kernels: dict[Any, str] = {}
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
        dr.kernel_history_clear()
        for scene, first_hits, bounces in (room, 1, 1), (room, 16, 4), (room.reduced("1/2"), 4, 2):
            scene.while_loaded(
                lambda loaded, scene=scene, first_hits=first_hits, bounces=bounces: FrozenPaths(
                    scene, loaded, first_hits=first_hits, bounces=bounces
                ).columns(sites)
            )
        for kernel in dr.kernel_history([dr.KernelType.JIT]):
            ir = kernel["ir"]
            if kernel["size"] > 1:  # a single vertex is read in another way
                kernels[kernel["hash"]] = ir if isinstance(ir, str) else ir.getvalue()
    return [sum(f"Call: {call}" in ir for ir in kernels.values()) for call in CALLS]


if __name__ == "__main__":
    print(json.dumps(count_kernels(sys.argv[1], sys.argv[2:])))
