"""The lighting follows from planes and paintings: not from where planes lie, nor from who works.

That is, from neither memory nor file, the number of threads, nor the order of views.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import BasisFactory
from nightly import nightly
from threadpoolctl import threadpool_limits

import lightpaint as lp
from lightpaint.basis.file import basis_file, file_planes
from lightpaint.basis.file.file_planes import FilePlanes
from lightpaint.threads import limit_jobs

#: Each has another loss, or other equations beside it.
FITS: dict[str, dict[str, Any]] = {
    "linear": {},
    "held": {"hold": 1.0},
    "gentle": {"colors": "gentle"},
    "white": {"colors": "white"},
    "own": {"colors": "own"},
    "display": {"transform": lp.ViewTransform("srgb")},
    "constraints": {
        "constraints": lp.Constraints.of(
            {"light 2": {"limits": {"max": 0.3}}}, tie=[["light 0", "light 3"]], prefer_current=0.1
        )
    },
    "few lights": {"constraints": lp.Constraints.of(sparse=6)},
}

#: One fit of each kind, for every check.
SOME_FITS = [fit if fit in ("linear", "display", "constraints") else nightly(fit) for fit in FITS]

#: Enough lights and pixels that BLAS would take several threads, and planes several strips.
LIGHTS, SIZES = 24, ((60, 80), (50, 70))

#: Sums of float64 in another order. Display values are fitted by steps, which end where one is
#: within 1e-6 of the answer.
LINEAR, DISPLAY = 1e-9, 1e-5


@pytest.fixture(scope="module")
def views(make_basis: BasisFactory) -> tuple[list[lp.Basis], list[lp.Target]]:
    """Two views of one lighting, each partly painted, of what no lighting quite does."""
    rng = np.random.default_rng(7)
    emission = (0.5 + rng.random((LIGHTS, 3))).tolist()
    weights = np.maximum(rng.normal(0.4, 0.5, (LIGHTS, 3)), 0)
    bases, targets = [], []
    for k, size in enumerate(SIZES):
        images = rng.gamma(0.5, 0.1, (LIGHTS, *size, 3)).astype(np.float32)
        noise = (0.02 * images * rng.normal(size=images.shape)).astype(np.float32)
        basis = make_basis(images=images, half_differences=noise, emission=emission, seed=k)
        image = basis.mix(weights) * rng.uniform(0.8, 1.2, (*size, 1))
        painted = np.arange(size[0]) % 9 > k
        importance = painted[:, None] * rng.uniform(0.2, 1, size)
        bases.append(basis)
        targets.append(lp.Target.of(image.astype(np.float32), importance.astype(np.float32)))
    return bases, targets


def emissions(bases: Any, targets: Any, fit: str) -> np.ndarray:
    return np.array(list(lp.solve(bases, targets, **FITS[fit]).lighting.emission.values()))


@pytest.mark.parametrize("fit", SOME_FITS)
def test_not_from_the_order_of_views(views: Any, fit: str) -> None:
    bases, targets = views
    expected = emissions(bases, targets, fit)
    tolerance = DISPLAY if fit == "display" else LINEAR
    actual = emissions(bases[::-1], targets[::-1], fit)
    np.testing.assert_allclose(actual, expected, rtol=tolerance, atol=tolerance)


@pytest.mark.parametrize("fit", SOME_FITS)
def test_not_from_the_number_of_threads(views: Any, fit: str) -> None:
    bases, targets = views
    results_by_count = []
    for count in (1, 4):
        limit_jobs(count)
        try:
            with threadpool_limits(count, "blas"):
                results_by_count.append(emissions(bases, targets, fit))
        finally:
            limit_jobs(None)
    np.testing.assert_array_equal(*results_by_count)


@pytest.mark.parametrize("fit", FITS)
def test_not_from_where_planes_lie(
    views: Any, fit: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    [basis, _], [target, _] = views
    path = tmp_path / "it.basis.exr"
    lp.write_basis(path, basis)
    expected = emissions(lp.read_basis(path), target, fit)
    monkeypatch.setattr(basis_file, "IN_MEMORY_MAX_BYTES", 0)
    monkeypatch.setattr(file_planes, "PICKED_MAX_BYTES", 0)
    stored = lp.read_basis(path)
    assert isinstance(stored.planes, FilePlanes)
    actual = emissions(stored, target, fit)
    # The same sums in the same order, but for strips.
    np.testing.assert_allclose(actual, expected, rtol=1e-10, atol=1e-12)
