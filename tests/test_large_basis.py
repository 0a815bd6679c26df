"""A basis that stays in its file: results as from memory, in the memory of a few pictures."""

import json
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nightly import nightly
from PIL import Image

import lightpaint as lp
from lightpaint import images
from lightpaint.basis.file import basis_file, file_planes
from lightpaint.images import denoiser, pixel_blocks
from lightpaint.images.formats.png import png_bytes
from lightpaint.lighting.loss import pixel_loss

#: Bytes of memory for each pixel that a solve and its report may take, beside the planes: 3.5 GB at
#: 3840 x 2160, where libraries and strips of 100 lights take another half.
BYTES_A_PIXEL = 420


#: Noise of a light, relative to it, at which blocks of pixels are fitted.
NOISY = 1.0


def stay_in_the_file(patch: pytest.MonkeyPatch, large: int) -> None:
    """Let planes stay in their file, and pictures of so many pixels be large."""
    patch.setattr(basis_file, "IN_MEMORY_MAX_BYTES", 0)
    # A few rows: a walk along single ones would take most of the time.
    patch.setattr(file_planes, "STRIP_CACHE_BYTES", 16 * large)
    patch.setattr(file_planes, "PICKED_MAX_BYTES", 16 * large)
    patch.setattr(pixel_blocks, "BAND_PIXELS", large // 8)
    patch.setattr(pixel_loss, "MAX_KEPT_PIXELS", large)
    patch.setattr(pixel_loss, "STRIP_PIXELS", min(pixel_loss.STRIP_PIXELS, large // 4))
    for module in (pixel_blocks, denoiser, images):
        patch.setattr(module, "LARGE_PICTURE", large)


def written(
    folder: Path, make_basis: Any, size: tuple[int, int], n: int = 3, grain: float = 0.02
) -> dict[str, Path]:
    """Write pools of light with their noise, and a painting of other strengths of them."""
    rng, (height, width) = np.random.default_rng(1), size
    y, x = np.mgrid[:height, :width] / np.reshape(size, (2, 1, 1))
    far = [np.square(x - a) + np.square(y - b) for a, b in rng.uniform(0.2, 0.8, (n, 2))]
    pools = (np.exp(-20 * np.stack(far)) + 0.01)[..., None] * rng.uniform(0.3, 1, (n, 1, 1, 3))
    noise = grain * pools * rng.standard_normal(pools.shape)
    basis = make_basis(images=pools + noise, half_differences=noise)
    lp.write_basis(folder / "it.basis.exr", basis)
    painted = np.einsum("nhwc,nc->hwc", pools, rng.uniform(0.1, 0.9, (n, 3)))
    painted[: height // 3, :, 2] *= 0.7
    codes = 255 * lp.ViewTransform("srgb").encode(np.clip(painted, 0, 1)) + 0.5
    (folder / "painting.png").write_bytes(png_bytes(codes.astype(np.uint8), {}))
    return {"painting": folder / "painting.png", "basis": folder / "it.basis.exr"}


@pytest.mark.nightly
@pytest.mark.parametrize("grain", [0.02, NOISY])
def test_results_are_those_of_planes_in_memory(
    tmp_path: Path, make_basis: Any, monkeypatch: pytest.MonkeyPatch, grain: float
) -> None:
    files = written(tmp_path, make_basis, (67, 90), grain=grain)
    monkeypatch.chdir(tmp_path)
    lp.paint_with_light(None, files["painting"], "memory", basis=files["basis"])
    stay_in_the_file(monkeypatch, 2**9)
    look = lp.paint_with_light(None, files["painting"], "file", basis=files["basis"])
    assert isinstance(look.basis.planes, file_planes.FilePlanes)
    assert (look.solution.problem.block_side > 1) == (grain == NOISY)

    def numbers(folder: str, name: str) -> list[Any]:
        results: list[Any] = []

        def walk(value: Any) -> None:
            if isinstance(value, dict | list):
                for expected in value.values() if isinstance(value, dict) else value:
                    walk(expected)
            else:
                results.append(value)

        document = json.loads((tmp_path / folder / name).read_text("utf-8"))
        for key in ("command", "software", "versions"):
            document.pop(key, None)
        walk(document)
        return results

    for name in ("lighting.json", "report.json"):
        actual, expected = numbers("file", name), numbers("memory", name)
        assert [x for x in actual if isinstance(x, str)] == [
            x for x in expected if isinstance(x, str)
        ]
        floats = ([x for x in some if isinstance(x, float)] for some in (actual, expected))
        # Sums of the same numbers by bands: round-off, of which solves make a little more, and
        # differences of noisy blocks up to ten times as much.
        np.testing.assert_allclose(*floats, rtol=1e-8 if grain == NOISY else 1e-9, atol=1e-11)
    ends = [(tmp_path / folder / "predicted.exr").read_bytes() for folder in ("file", "memory")]
    assert ends[0] == ends[1]
    sheets = [
        np.asarray(Image.open(tmp_path / folder / "comparison.png")).astype(int)
        for folder in ("file", "memory")
    ]
    assert np.abs(sheets[0] - sheets[1]).max() <= 1


@pytest.mark.nightly
@pytest.mark.long
@pytest.mark.parametrize("grain", [0.02, nightly(NOISY)])
def test_memory_of_a_large_film_is_that_of_a_few_pictures(
    tmp_path: Path, make_basis: Any, monkeypatch: pytest.MonkeyPatch, grain: float
) -> None:
    size = 360, 640
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small").mkdir()
    small = written(tmp_path / "small", make_basis, (36, 64))
    lp.paint_with_light(None, small["painting"], "warm", basis=small["basis"])  # imports
    files = written(tmp_path, make_basis, size, grain=grain)
    stay_in_the_file(monkeypatch, 2**15)
    tracemalloc.start()
    try:
        look = lp.paint_with_light(
            None, files["painting"], "results", basis=files["basis"], colors="own"
        )
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    # The diagnosis solves again without a reason, while the first answer stays.
    assert look.analysis.appearance.reasons or grain == NOISY
    assert peak < BYTES_A_PIXEL * size[0] * size[1]
