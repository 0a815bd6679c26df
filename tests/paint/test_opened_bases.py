"""A session of many lights that opens before their planes are read."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lightpaint as lp
from lightpaint.basis.file import basis_file
from lightpaint.basis.file.deferred_planes import DeferredPlanes
from lightpaint.lighting.live import live_solver
from lightpaint.paint import protocol
from lightpaint.paint.session import picture_table
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.studio.session_studio import Studio
from lightpaint.paint.subject_factory import make_subject
from lightpaint.pipeline import BasisFile

N, SIZE = 6, (24, 32)


@pytest.fixture
def path(tmp_path: Path, make_basis: Any, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A saved basis of as many lights as count as many."""
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(basis_file, "MIN_LIGHTS", N)
    monkeypatch.setattr(live_solver, "MANY_LIGHTS", N - 1)
    monkeypatch.setattr(picture_table, "MAX_OPENING_VALUES", 0)
    rng = np.random.default_rng(2)
    images = rng.random((N, *SIZE, 3)) * (rng.random((N, *SIZE, 1)) < 0.4) + 0.01
    halves = images * rng.normal(0, 0.05, (N, *SIZE, 1))
    path = tmp_path / "hall.basis.exr"
    lp.write_basis(path, make_basis(images=images, half_differences=halves))
    return path


def studio_of(path: Path) -> Studio:
    return Studio([make_subject(BasisFile(str(path)), path.parent)], partial(Store.open, None))


def painted(studio: Studio) -> np.ndarray:
    """The weights that answer a stroke."""
    image = 1.4 * studio.session.views[0].current[4:12, 6:20]
    arrays = {"image": np.asarray(image, np.float32), "importance": np.ones((8, 14), np.float32)}
    studio.handle(protocol.Paint(0, (4, 12, 6, 20)), arrays)
    return studio.session.weights


def test_a_session_opens_and_answers_before_planes_are_read(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = studio_of(path)
    first._bases.obtain()
    weights = painted(first)
    assert not np.array_equal(weights, first.session.basis.current_weights)

    def read(_: DeferredPlanes) -> None:
        raise AssertionError("all planes are read")

    again = studio_of(path)
    assert isinstance(again.subjects[0].basis, lp.Basis)
    monkeypatch.setattr(DeferredPlanes, "whole", property(read))
    again._bases.use(list(again.subjects[0].bases()))
    state = again.state()
    assert isinstance(state, protocol.SessionState)
    np.testing.assert_array_equal(again.session.views[0].current, first.session.views[0].current)
    assert [light.present for light in state.lights] == [
        light.present for light in first.state().lights
    ]
    for k in range(N):
        np.testing.assert_array_equal(again.resource(f"plane/{k}"), first.resource(f"plane/{k}"))
    np.testing.assert_array_equal(painted(again), weights)
