"""What a session leaves for others: where it lies, and where not."""

from pathlib import Path

import numpy as np
import pytest
from renderer import write_room

import lightpaint as lp
from lightpaint.lighting.lighting import Lighting
from lightpaint.paint.exports import verified
from lightpaint.paint.launch import subject_of
from lightpaint.settings import Settings
from lightpaint.sources import SceneFile


@pytest.mark.filterwarnings("ignore:.*samples.*")
def test_a_verifying_render_writes_nothing_beside_the_scene(tmp_path: Path) -> None:
    """A kill would leave it there."""
    (tmp_path / "scene").mkdir()
    path = write_room(tmp_path / "scene")
    subject = subject_of(SceneFile(str(path)), tmp_path / "s", settings=Settings(spp=4))
    basis = lp.render_basis(subject.loaded, spp=4)
    lighting = Lighting.of_weights(basis, 2 * basis.present_weights)
    there, seen = set(path.parent.iterdir()), []

    def hears(label: str, done: int, total: int, unit: str = "passes") -> None:
        seen.append(set(path.parent.iterdir()))

    picture, said, _ = verified(subject, basis, lighting, hears)
    assert seen
    assert all(files == there for files in seen)
    assert "A render of 4 samples per pixel" in said
    np.testing.assert_allclose(picture.mean(), 2 * basis.present_look.mean(), rtol=0.1)  # noise
