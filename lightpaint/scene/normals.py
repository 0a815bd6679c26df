"""Normals of smooth meshes that are the same each time, to the last bit.

A mesh that comes without normals gets them when it is loaded, from those of the faces about a
vertex: added up by several threads, in another order each time. What is rendered then differs in
its last bits from process to process.
"""

from typing import Any

from lightpaint.scene.runtime.kernel_threads import adds_in_order, kernels

#: Most by which normals of a file are those that its faces have: written or computed otherwise.
#: Round-off is a hundredth of it.
SAME = 1e-5


def settle_normals(scene: Any) -> None:
    """Compute them again on one thread, where this process adds everything up on one.

    Not those that a file brings along, unless they are the same. scene: a `mi.Scene`.
    """
    import mitsuba as mi

    if not adds_in_order() or not isinstance(scene, mi.Scene):
        return
    import drjit as dr

    with kernels():
        for mesh in (x for x in scene.shapes() if isinstance(x, mi.Mesh)):
            its, key = mi.traverse(mesh), "vertex_normals"
            if key not in its or not mesh.has_vertex_normals():
                continue
            loaded = type(its[key])(its[key])
            dr.eval(loaded)
            mesh.recompute_vertex_normals()
            if not dr.all(dr.abs(mi.traverse(mesh)[key] - loaded) <= SAME):
                its[key] = loaded
                its.update()
