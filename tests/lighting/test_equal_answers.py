"""What is promised to be equal: to the bit on one machine, and how far on another processor.

Another processor is had by telling OpenBLAS to take another one's kernel. docs/method.md, "Equal
answers", has what was measured of paintings.
"""

import json
import platform
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import spawn

import lightpaint as lp
from lightpaint.images.formats.exr import write_rgb
from lightpaint.images.picture import read_picture
from lightpaint.threads import linear_algebra

#: A kernel that every processor of this kind can run, and none has chosen for forty releases.
OTHER = "Nehalem"

#: Part by which weights of lights that are not alike may differ, a single one or those that are
#: alike together; and pictures in float32.
DISTINCT, PICTURE = 1e-8, 1e-6

#: Part in which the last two lights are unlike: single-precision images hardly tell them apart.
ALIKE = 1e-5


@pytest.fixture
def folder(make_basis: Any, tmp_path: Path) -> Path:
    """A basis with two lights that are nearly one, and a painting that they can do."""
    rng = np.random.default_rng(0)
    images = 0.1 + rng.random((5, 40, 30, 3))
    images[4] = images[3] * (1 + ALIKE * rng.normal(size=images[3].shape))
    halves = 0.01 * rng.normal(size=images.shape)
    basis = make_basis(images=images, half_differences=halves, names=[*"abcde"])
    lp.write_basis(tmp_path / "a.basis.exr", basis)
    write_rgb(tmp_path / "t.exr", basis.mix(0.5 + rng.random((5, 3))))
    return tmp_path


def _solve_apart(folder: Path, name: str, **variables: str) -> bytes:
    completed = spawn(folder, "solve", "a.basis.exr", "t.exr", "-o", name, **variables)
    assert completed.returncode == 0, completed.stderr
    return (folder / name / "lighting.json").read_bytes()


def _emissions(text: bytes) -> Any:
    return np.array([light["emission"] for light in json.loads(text)["lights"].values()])


@pytest.mark.nightly
def test_equal_commands_have_equal_answers_and_other_kernels_nearly_so(folder: Path):
    blas, kernel = linear_algebra()
    lighting_text = _solve_apart(folder, "here")
    assert _solve_apart(folder, "again") == lighting_text
    for name in ("predicted.exr", "comparison.png"):
        content, other = ((folder / x / name).read_bytes() for x in ("here", "again"))
        assert content == other, name
    software = json.loads(lighting_text)["solve"]["software"]
    assert (software["blas"], software["kernel"]) == (blas, kernel)
    assert software["numpy"] == np.__version__
    if not (blas.startswith("openblas") and platform.machine() == "x86_64" and kernel != OTHER):
        pytest.skip("OpenBLAS with kernels for x86-64")
    other_text = _solve_apart(folder, "there", OPENBLAS_CORETYPE=OTHER)
    assert json.loads(other_text)["solve"]["software"]["kernel"] == OTHER
    a, b = _emissions(lighting_text), _emissions(other_text)
    # Not the same sums, or this test would show nothing.
    assert (a != b).any()
    np.testing.assert_allclose(a[:3], b[:3], rtol=DISTINCT)
    np.testing.assert_allclose(a[3:].sum(axis=0), b[3:].sum(axis=0), rtol=DISTINCT)
    own_picture, other_picture = (
        read_picture(folder / x / "predicted.exr").image for x in ("here", "there")
    )
    np.testing.assert_allclose(own_picture, other_picture, rtol=PICTURE)


def test_a_lighting_keeps_what_it_was_solved_with(make_basis: Any, tmp_path: Path):
    basis = make_basis(2)
    lighting = lp.solve(basis, lp.Target.of(basis.images.sum(axis=0))).lighting
    assert lighting.certificate is not None
    assert lighting.certificate.software.lightpaint == lp.__version__
    lp.write_lighting(tmp_path / "l.json", lighting)
    assert lp.read_lighting(tmp_path / "l.json") == lighting
    # Those from before say nothing of it.
    data = json.loads((tmp_path / "l.json").read_text(encoding="utf-8"))
    del data["solve"]["software"]
    (tmp_path / "l.json").write_text(json.dumps(data), encoding="utf-8")
    assert lp.read_lighting(tmp_path / "l.json").certificate.software is None
