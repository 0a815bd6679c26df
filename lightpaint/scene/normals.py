"""Makes the normals of smooth meshes reproducible to the last bit.

When Mitsuba loads a mesh without normals, it computes them from the faces around each vertex.
Several threads add these up in varying order, so renders differ in their last bits between
processes.
"""

from typing import Any

from lightpaint.scene.runtime.kernel_threads import kernels

#: Maximum difference at which normals count as computed from the faces rather than read from the
#: file. Round-off is a hundredth of it.
NORMAL_TOLERANCE = 1e-5


def make_normals_reproducible(scene: Any) -> None:
    """Recompute normals on one thread, which always adds in the same order.

    Normals from a file are kept, unless they equal the computed ones. scene: an `mi.Scene`.
    """
    import mitsuba as mi

    # Scalar variants use one thread anyway.
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
