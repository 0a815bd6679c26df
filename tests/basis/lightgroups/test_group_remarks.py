"""Remarks on missing groups and beauties name the renderer's setting that adds them."""

import html
from pathlib import Path

import numpy as np
import pytest
from light_groups import channels, interleaved, pictures, write

import lightpaint as lp
from lightpaint.basis.lightgroups.light_groups import read_light_groups
from lightpaint.basis.lightgroups.naming_conventions import CONVENTIONS

#: Prefix of a layer of a light, and the whole picture.
NAMES = {
    "Blender Cycles": ("ViewLayer.Combined_{}", "ViewLayer.Combined"),
    "Arnold": ("RGBA_{}", "RGBA"),
    "Karma": ("C_{}", "C"),
    "RenderMan or Redshift": ("Beauty_{}", "Beauty"),
    "V-Ray or Corona": ("LightSelect_{}", ""),
    "Octane": ("Light {}", "Main"),
}


def remarks(path: Path, renderer: str, *, share: float, has_beauty: bool = True) -> str:
    """Remarks on two lights, next to a beauty with so much of a third that has no group."""
    layer, beauty = NAMES[renderer]
    images = pictures(3)
    layers = {layer.format(k): image for k, image in enumerate(images[:2], 1)}
    if has_beauty:
        layers[beauty] = images[0] + images[1] + share * images[2]
    groups = read_light_groups(interleaved(path / "shot.exr", layers))
    assert groups.renderer == renderer
    return "\n".join(groups.remarks)


@pytest.mark.parametrize("renderer", NAMES)
def test_a_light_in_no_group(tmp_path: Path, renderer: str):
    setting = next(x.group_setting for x in CONVENTIONS if x.renderer == renderer)
    assert f"a light in no group gets one by {setting}" in remarks(tmp_path, renderer, share=0.5)
    assert setting not in remarks(tmp_path, renderer, share=0)


@pytest.mark.parametrize("renderer", NAMES)
def test_no_whole_picture(tmp_path: Path, renderer: str):
    setting = next(x.beauty_setting for x in CONVENTIONS if x.renderer == renderer)
    text = remarks(tmp_path, renderer, share=0, has_beauty=False)
    assert f"render it with them ({setting})" in text


def test_light_that_fast_gi_adds_is_the_rest(tmp_path: Path):
    """Cycles adds ambient occlusion of method Add to the whole picture, and to no group."""
    key, fill, occlusion = pictures(3)
    names = {"ViewLayer.Combined_key": key, "ViewLayer.Combined_fill": fill}
    whole = {"ViewLayer.Combined": key + fill + 0.2 * occlusion}
    groups = read_light_groups(interleaved(tmp_path / "shot.exr", names | whole))
    [remark] = [x for x in groups.remarks if "Fast GI Approximation of method Add" in x]
    assert remark.endswith("is in none")
    rest = groups.basis.images[groups.basis.names.index("rest")]
    # Precision: sums of float32.
    np.testing.assert_allclose(rest, 0.2 * occlusion, rtol=0, atol=4e-7 * whole.popitem()[1].max())
    assert groups.basis.is_fixed.tolist() == [False, False, True]


def test_other_renderers_have_no_fast_gi(tmp_path: Path):
    assert "Fast GI" not in remarks(tmp_path, "Arnold", share=0.5)


def test_remarks_on_groups_are_in_the_report(tmp_path: Path):
    images = pictures(2)
    layers = {"RGBA_a": images[0], "RGBA_b": images[1], "RGBA": images.sum(axis=0)}
    groups = read_light_groups(interleaved(tmp_path / "shot.exr", layers))
    painting = tmp_path / "painting.exr"
    write(painting, ("rgb", channels("", 2 * images[0])))
    lp.paint_with_light(None, painting, tmp_path / "out", basis=groups)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    for remark in groups.remarks:
        assert remark in html.unescape(page)
