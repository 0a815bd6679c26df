"""Normals of smooth meshes, which are the same on any number of threads."""

from collections.abc import Iterator

import numpy as np
import pytest

from lightpaint.scene.runtime.kernel_threads import kernels_for_all_sizes, limit_threads
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.scene.scene_tree import make_normals_reproducible

use_variant()

import drjit as dr  # noqa: E402
import mitsuba as mi  # noqa: E402


@pytest.fixture(autouse=True, params=[1, None])
def _threads(request: pytest.FixtureRequest) -> Iterator[None]:
    limit_threads(request.param)
    yield
    limit_threads(None)


def ball(*, offset: float = 0.0, factor: float = 1.0, rows: int = 12) -> object:
    """A scene of a smooth mesh: its own normals times `factor`, and so far off."""
    columns = 24
    up, round_ = np.mgrid[0.1 : np.pi - 0.1 : rows * 1j, 0 : 2 * np.pi : columns * 1j]
    points = np.stack([np.sin(up) * np.cos(round_), np.sin(up) * np.sin(round_), np.cos(up)], -1)
    corner = np.arange(rows * columns, dtype=np.uint32).reshape(rows, columns)
    a, b, c, d = corner[:-1, :-1], corner[:-1, 1:], corner[1:, :-1], corner[1:, 1:]
    faces = np.concatenate([np.stack([a, c, b], -1), np.stack([b, c, d], -1)]).reshape(-1, 3)
    mesh = mi.Mesh("ball", rows * columns, len(faces), has_vertex_normals=True)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = points.astype(np.float32).ravel()
    parameters["faces"] = faces.ravel()
    parameters.update()
    mesh.recompute_vertex_normals()
    parameters = mi.traverse(mesh)
    parameters["vertex_normals"] = parameters["vertex_normals"] * factor + offset
    parameters.update()
    return mi.load_dict({"type": "scene", "it": mesh})


def normals(scene: object) -> np.ndarray:
    [mesh] = scene.shapes()  # type: ignore[attr-defined]
    return np.array(mi.traverse(mesh)["vertex_normals"])


def test_what_was_computed_is_computed_again() -> None:
    reference, scene = ball(), ball(offset=2e-7)
    # A mesh that is loaded while other threads are at work may have sums in another order.
    make_normals_reproducible(reference)
    expected = normals(reference)
    assert (normals(scene) != expected).any()
    make_normals_reproducible(scene)
    np.testing.assert_array_equal(normals(scene), expected)


def test_those_of_a_file_stay() -> None:
    scene = ball(factor=-1.0)
    before = normals(scene)
    make_normals_reproducible(scene)
    np.testing.assert_array_equal(normals(scene), before)


def test_meshes_of_all_sizes_share_kernels() -> None:
    def kernels_of(rows: int) -> set[str]:
        dr.kernel_history_clear()
        with kernels_for_all_sizes(), dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            ball(rows=rows)
            history = dr.kernel_history([dr.KernelType.JIT])
        return {kernel["hash"] for kernel in history if kernel["operation_count"] > 100}

    assert len(kernels_of(12) | kernels_of(40)) == 1
    assert dr.expand_threshold() > 0
