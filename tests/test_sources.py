"""Files that a job is made of: read once, and anew where somebody says so."""

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lightpaint import Painting, SceneFile
from lightpaint.batch.work.work_items import SceneFilm
from lightpaint.images.formats.exr import write_rgb
from lightpaint.pipeline.job.sources import BasisFile, GroupsFile


def _painted(path: Path, light: float) -> None:
    write_rgb(path, np.full((4, 6, 3), light, np.float32))


def test_a_painting_is_read_once_and_anew_when_it_is_asked_for(tmp_path: Path) -> None:
    _painted(tmp_path / "p.exr", 0.25)
    painting = Painting(str(tmp_path / "p.exr"))
    assert painting.content.image.max() == 0.25
    _painted(tmp_path / "p.exr", 0.5)
    assert painting.content.image.max() == 0.25
    reread = painting.without_content()
    assert reread == painting
    assert reread.content.image.max() == 0.5


def test_what_was_read_is_not_sent(tmp_path: Path) -> None:
    _painted(tmp_path / "p.exr", 0.25)
    painting = Painting(str(tmp_path / "p.exr"), find=False)
    before = pickle.dumps(painting)
    assert painting.content is painting.content
    assert pickle.dumps(painting) == before
    _painted(tmp_path / "p.exr", 0.5)
    sent = pickle.loads(before)
    assert (sent, sent.content.image.max()) == (painting, 0.5)


@pytest.mark.parametrize(
    "file",
    [SceneFile("room.xml", parameters={"a": "1"}), BasisFile("a.exr"), GroupsFile("a", "b")],
)
def test_a_file_as_it_is_sent(file: Any) -> None:
    # As if it had been read.
    vars(file)["content"] = object()
    for sent_file in (file.without_content(), pickle.loads(pickle.dumps(file))):
        assert sent_file == file
        assert "content" not in vars(sent_file)
    if isinstance(file, SceneFile):
        film = SceneFilm(file, resolution="8x8")
        assert film.without_content() == film
        assert "content" not in vars(film.without_content().scene)
