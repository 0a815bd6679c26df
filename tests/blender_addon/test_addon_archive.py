"""`lightpaint blender`: the archive that it writes, and what is in it."""

import ast
import io
import re
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from blender import in_blender
from command import run, run_refused

import lightpaint
from lightpaint.blender_addon.painter.program import WRITER_FILE
from lightpaint.cli.commands.program_commands import ADDON_NAME, own_program, packed_addon

FOLDER = Path(lightpaint.__file__).parent / "blender_addon"
MODULES = sorted(FOLDER.rglob("*.py"))


def test_the_archive_is_an_extension_and_an_addon() -> None:
    archive = zipfile.ZipFile(io.BytesIO(packed_addon()))
    names = archive.namelist()
    assert {Path(name).parts[0] for name in names} == {ADDON_NAME}
    assert {Path(name).suffix for name in names} == {".py", ".toml", ""}
    manifest = tomllib.loads(archive.read(f"{ADDON_NAME}/blender_manifest.toml").decode())
    assert (manifest["id"], manifest["blender_version_min"]) == ("lightpaint", "4.2.0")
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"]
    # Blender refuses these texts if they end with a full stop, or are longer than 64 characters.
    texts = [manifest["tagline"], *manifest["permissions"].values()]
    assert [text for text in texts if text.endswith(".") or len(text) > 64] == []
    info = ast.parse(archive.read(f"{ADDON_NAME}/__init__.py").decode()).body
    [addon] = (x.value for x in info if isinstance(x, ast.Assign))
    assert ast.literal_eval(addon)["blender"] == (3, 4, 0)
    version = ".".join(map(str, ast.literal_eval(addon)["version"]))
    assert version == manifest["version"] == lightpaint.__version__


def test_the_archive_names_the_program_that_has_written_it() -> None:
    packed = zipfile.ZipFile(io.BytesIO(packed_addon("/opt/light paint/bin/lightpaint")))
    named = packed.read(f"{ADDON_NAME}/{WRITER_FILE.name}").decode()
    assert named == "/opt/light paint/bin/lightpaint\n"
    assert set(packed.namelist()) - {f"{ADDON_NAME}/{WRITER_FILE.name}"} == set(
        zipfile.ZipFile(io.BytesIO(packed_addon())).namelist()
    )


def test_equal_sources_make_equal_archives() -> None:
    assert packed_addon() == packed_addon()


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(FOLDER)))
def test_the_addon_is_under_its_licence_and_needs_no_library(path: Path) -> None:
    text = path.read_text("utf-8")
    assert text.startswith("# SPDX-License-Identifier: GPL-3.0-or-later\n")
    tree = ast.parse(text, feature_version=(3, 10))  # the Python of Blender 3.4
    known = {"bpy", "bpy_extras", "blf", *sys.stdlib_module_names}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            assert {name.name.partition(".")[0] for name in node.names} <= known
        elif isinstance(node, ast.ImportFrom) and not node.level:
            assert str(node.module).partition(".")[0] in known


def test_nothing_of_the_library_imports_the_addon() -> None:
    others = set(FOLDER.parent.rglob("*.py")) - set(MODULES)
    importing = [
        path
        for path in others
        if re.search(r"import.*blender_addon|blender_addon\.", path.read_text("utf-8"))
    ]
    assert importing == []


def test_the_command_replaces_its_own_archives_only(tmp_path: Path) -> None:
    assert run(tmp_path, "blender").returncode == 0
    assert run(tmp_path, "blender").returncode == 0
    assert (tmp_path / "lightpaint-blender.zip").read_bytes() == packed_addon(own_program())
    (tmp_path / "mine.zip").write_bytes(b"mine")
    assert "--force" in run_refused(tmp_path, "blender", "-o", "mine.zip")
    assert (tmp_path / "mine.zip").read_bytes() == b"mine"
    assert run(tmp_path, "blender", "-o", "mine.zip", "--force").returncode == 0


@pytest.mark.nightly
@pytest.mark.long
def test_blender_installs_the_archive(
    blender: list[str], tmp_path: Path, variables: dict[str, str]
) -> None:
    archive = tmp_path / "lightpaint-blender.zip"
    archive.write_bytes(packed_addon("/opt/bin/lightpaint"))
    script = Path(__file__).parent / "install.py"
    in_blender(blender, script, archive, variables=variables)
