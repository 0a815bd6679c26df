"""What a session leaves for others: where it lies, and where not."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from renderer import write_room

import lightpaint as lp
from lightpaint.errors import OutputError, PaintError
from lightpaint.images.denoiser import denoised
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.paint.studio.session_exports import (
    answer_png,
    folder_name,
    new_folder,
    render_verification,
)
from lightpaint.paint.subject_factory import make_subject
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import SceneFile


@pytest.mark.filterwarnings("ignore:.*samples.*")
def test_a_verifying_render_writes_nothing_beside_the_scene(tmp_path: Path) -> None:
    """A kill would leave it there."""
    (tmp_path / "scene").mkdir()
    path = write_room(tmp_path / "scene")
    subject = make_subject(SceneFile(str(path)), tmp_path / "s", settings=Settings(spp=4))
    basis = lp.render_basis(subject.loaded_scene, spp=4)
    lighting = Lighting.of_weights(basis, 2 * basis.current_weights)
    files_before, progress_seen = set(path.parent.iterdir()), []

    def listen(label: str, done: int, total: int, unit: str = "passes") -> None:
        progress_seen.append(set(path.parent.iterdir()))

    picture, verdict, _ = render_verification(subject, basis, lighting, listen)
    assert progress_seen
    assert all(files == files_before for files in progress_seen)
    # It may end when it can tell, before all four samples.
    assert re.match(
        r"Rendered again with \d samples per pixel: nothing found against it\.$", verdict
    )
    np.testing.assert_allclose(picture.mean(), 2 * basis.current_look.mean(), rtol=0.1)  # noise


@pytest.mark.parametrize("transform", [lp.ViewTransform("srgb", 1.5), lp.ViewTransform("agx")])
def test_a_picture_of_the_answer_is_what_the_view_shows(
    tmp_path: Path, make_basis: Any, transform: lp.ViewTransform
) -> None:
    """Read back through that view, which it names, it is the answer's light."""
    y, x = np.mgrid[:9, :16] / 16
    images = np.stack([np.stack([y + 0.1, x + 0.1, 0.3 + 0 * x], -1), np.full((9, 16, 3), 0.2)])
    basis = make_basis(images=images, emission=np.ones((2, 3)))
    lighting = Lighting.of_weights(basis, np.array([[0.5, 0.4, 0.3], [0.2, 0.2, 0.6]]))
    path = tmp_path / "answer.png"
    path.write_bytes(answer_png(basis, lighting, transform))
    display = np.asarray(Image.open(path)) / 255
    combined = lp.combine(basis, lighting).image
    clean = denoised(combined, basis.features)
    np.testing.assert_allclose(display, transform.encode(clean), atol=0.5 / 255 + 1e-6)  # 8 bits
    target = lp.read_target(path)
    assert target.transform == transform
    np.testing.assert_allclose(transform.encode(target.image), display, atol=1e-3)


NAMES = {
    "Evening": "Evening",
    "  warm \n evening ": "warm evening",
    "A → B, 50 %": "A → B, 50 %",
    "../../etc/passwd": "-..-etc-passwd",
    ".hidden": "hidden",
    "act 1: storm?": "act 1- storm-",
    "a\u202eb\x1b": "ab",
    "ends with a point.": "ends with a point",
}


@pytest.mark.parametrize("name", NAMES)
def test_a_name_of_an_export_is_that_of_one_folder(tmp_path: Path, name: str) -> None:
    assert folder_name(name) == NAMES[name]
    with new_folder(tmp_path, name) as folder:
        assert folder == tmp_path / NAMES[name]
        assert folder.is_dir()


def test_a_long_name_is_cut_between_characters() -> None:
    cut = folder_name("ä" * 300)
    assert set(cut) == {"ä"}
    assert len(cut.encode()) <= 160


@pytest.mark.parametrize("name", ["", " ", "...", "///", "\x1b"])
def test_a_name_without_letters_is_refused(tmp_path: Path, name: str) -> None:
    with (
        pytest.raises(PaintError, match="give this export another name"),
        new_folder(tmp_path, name),
    ):
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_taken_name_gets_a_number_and_an_empty_folder_goes(tmp_path: Path) -> None:
    exports = tmp_path / "exports"
    names = []
    for content in ("first", "second", "third"):
        with new_folder(exports, "evening") as folder:
            (folder / "answer.png").write_text(content)
        names.append(folder.name)
    assert names == ["evening", "evening 2", "evening 3"]
    assert (exports / "evening" / "answer.png").read_text() == "first"
    with new_folder(exports, "evening") as folder:
        pass
    assert folder.name == "evening 4"
    assert not folder.exists()
    with new_folder(tmp_path / "none", "evening"):
        pass
    assert not (tmp_path / "none").exists()
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="cannot make"), new_folder(tmp_path / "file", "a"):
        pass
