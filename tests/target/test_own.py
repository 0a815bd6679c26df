"""A painting that was made here comes back as it was, and is answered so."""

from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest

import lightpaint as lp
from lightpaint.target.painted_target import KEY, write_painting


def _target(**options: Any) -> lp.Target:
    rng = np.random.default_rng(3)
    image = rng.random((6, 8, 3), np.float32) * 4
    importance = np.where(rng.random((6, 8)) < 0.5, 0, rng.random((6, 8))).astype(np.float32)
    return lp.Target("painting", image, importance, everything=False, **options)


@pytest.mark.parametrize(
    "options",
    [
        {"over_look": True, "through_view": True, "transform": lp.ViewTransform("agx", 1.5)},
        {"over_look": True},
        {},
    ],
)
def test_a_painting_comes_back_to_the_last_bit(tmp_path: Path, options: Any):
    target = _target(**options)
    write_painting(tmp_path / "painting.exr", target)
    reread = lp.read_target(tmp_path / "painting.exr")
    np.testing.assert_array_equal(reread.image, target.image)
    np.testing.assert_array_equal(reread.importance, target.importance)
    for name in ("name", "over_look", "through_view", "transform", "everything", "at_least"):
        assert getattr(reread, name) == getattr(target, name)


def test_another_view_may_be_asked_for(tmp_path: Path):
    write_painting(tmp_path / "a.exr", _target(through_view=True, transform=lp.ViewTransform()))
    reread = lp.read_target(tmp_path / "a.exr", transform=lp.TransformChoice("agx"))
    assert reread.transform == lp.ViewTransform("agx")


@pytest.mark.parametrize(
    "text", ["{", "[]", '{"format": "lightpaint-painting 9"}', '{"stops": "x"}', '{"view": "no"}']
)
def test_a_damaged_word_is_said(tmp_path: Path, text: str):
    path = tmp_path / "a.exr"
    header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION, KEY: text}
    pixels = {c: np.ones((4, 4), np.float32) for c in "RGBW"}
    OpenEXR.File(header, pixels).write(str(path))
    with pytest.raises(lp.LightpaintError, match=r"lightpaint\.painting|view transform"):
        lp.read_target(path)
