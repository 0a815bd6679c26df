"""The file by which programs find a painter: its owner's alone, and of the painter that runs."""

import json
import os
import stat
from pathlib import Path
from typing import Any

import pytest

from lightpaint.errors import OutputError
from lightpaint.paint.launch import CONNECTION_FILE, ConnectionFile


def connection_fields(token: str) -> dict[str, Any]:
    return {"address": "http://127.0.0.1:8421/", "token": token, "version": "1", "protocol": 2}


@pytest.mark.parametrize("mask", [0, 0o022, 0o077])
def test_only_its_owner_reads_it_whatever_the_mask(tmp_path: Path, mask: int) -> None:
    before = os.umask(mask)
    try:
        file = ConnectionFile(tmp_path, connection_fields("a"))
        file.write()
    finally:
        os.umask(before)
    assert stat.S_IMODE(file.path.stat().st_mode) == 0o600
    assert json.loads(file.path.read_text()) == connection_fields("a")
    file.remove()
    assert list(tmp_path.iterdir()) == []
    file.remove()


def test_what_a_killed_painter_left_is_replaced_whoever_could_read_it(tmp_path: Path) -> None:
    ConnectionFile(tmp_path, connection_fields("killed")).write()
    path = tmp_path / CONNECTION_FILE
    path.chmod(0o644)
    with path.open() as reader:  # who has it open reads the old one
        file = ConnectionFile(tmp_path, connection_fields("new"))
        file.write()
        assert json.loads(reader.read())["token"] == "killed"
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert json.loads(path.read_text())["token"] == "new"


def test_a_link_is_replaced_and_not_followed(tmp_path: Path) -> None:
    other_folder, folder = tmp_path / "elsewhere", tmp_path / "room.paint"
    other_folder.write_text("mine")
    folder.mkdir()
    (folder / CONNECTION_FILE).symlink_to(other_folder)
    file = ConnectionFile(folder, connection_fields("a"))
    file.write()
    assert other_folder.read_text() == "mine"
    assert not file.path.is_symlink()
    file.remove()
    assert other_folder.read_text() == "mine"


def test_that_of_another_painter_stays(tmp_path: Path) -> None:
    first, second = (
        ConnectionFile(tmp_path, connection_fields("a")),
        ConnectionFile(tmp_path, connection_fields("b")),
    )
    first.write()
    second.write()
    first.remove()
    assert json.loads(second.path.read_text())["token"] == "b"
    second.path.write_text("no JSON")
    second.remove()
    assert second.path.exists()


def test_where_it_cannot_be_written_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match=r"cannot write .*painter.json"):
        ConnectionFile(tmp_path / "file", connection_fields("a")).write()
