"""Normals of smooth meshes that are reproducible to the last bit.

Mitsuba computes missing normals of a mesh when it loads it, from the faces around a vertex. Several
threads add them up, in a different order each time, so that renders differ in their last bits from
process to process.
"""

from typing import Any

from lightpaint.scene.runtime.kernel_threads import kernels

#: Largest difference at which the normals of a file count as computed from its faces. Round-off is
#: a hundredth of it.
NORMAL_TOLERANCE = 1e-5


def make_normals_reproducible(scene: Any) -> None:
    """Compute the normals again on one thread, which adds in the same order each time.

    Normals from a file stay, unless they equal the computed ones. scene: a `mi.Scene`.
    """
    import mitsuba as mi

    # Scalar variants have one thread anyway.
    if mi.variant().startswith("scalar") or not isinstance(scene, mi.Scene):
        return
    import drjit as dr

    meshes = [x for x in scene.shapes() if isinstance(x, mi.Mesh) and x.has_vertex_normals()]
    if not meshes:
        return
    with kernels(threads=1):
        for mesh in meshes:
            parameters, key = mi.traverse(mesh), "vertex_normals"
            if key not in parameters:
                continue
            loaded = type(parameters[key])(parameters[key])
            dr.eval(loaded)
            mesh.recompute_vertex_normals()
            if not dr.all(dr.abs(mi.traverse(mesh)[key] - loaded) <= NORMAL_TOLERANCE):
                parameters[key] = loaded
                parameters.update()
