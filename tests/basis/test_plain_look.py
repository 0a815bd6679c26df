"""The picture of a scene as it is that stands in until its lights are rendered."""

from pathlib import Path

import numpy as np
import pytest
from renderer import write_room

import lightpaint as lp
from lightpaint.basis.light_basis import meter_exposure
from lightpaint.basis.render import plain_look
from lightpaint.basis.render.plain_look import render_plain_look


@pytest.fixture
def scene(tmp_path: Path) -> lp.Scene:
    return lp.load_scene(write_room(tmp_path))


def test_it_is_the_scene_as_an_ordinary_render_shows_it(
    scene: lp.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plain_look, "LOOK_SPP", 64)
    look, basis = render_plain_look(scene), lp.render_basis(scene, spp=64)
    assert look.origin.is_plain_look
    assert not basis.origin.is_plain_look
    assert look.origin.spp == 0
    assert (look.names, look.size) == (basis.names, basis.size)
    assert look.origin.scene_identity == basis.origin.scene_identity
    # Noise of the mean of either, and what a denoiser adds to it.
    np.testing.assert_allclose(
        look.current_look.mean(axis=(0, 1)), basis.current_look.mean(axis=(0, 1)), rtol=0.05
    )
    assert meter_exposure(look.current_look, look) == meter_exposure(basis.current_look, basis)
    # The basis counts pixels of which any part shows an emitter, and this those whose middle does.
    assert not (look.emitters_seen & ~basis.emitters_seen).any()
    assert 0.8 * basis.emitters_seen.sum() < look.emitters_seen.sum()


def test_it_has_the_size_of_a_film_that_fills_no_whole_blocks(
    scene: lp.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = render_plain_look(scene).current_look
    height, width = scene.size
    monkeypatch.setattr(plain_look, "LOOK_PIXELS", height * width // 8)
    look = render_plain_look(scene)
    assert look.size == scene.size
    assert (height % 3, width % 3) != (0, 0)
    np.testing.assert_allclose(
        look.current_look.mean(axis=(0, 1)), whole.mean(axis=(0, 1)), rtol=0.2
    )
