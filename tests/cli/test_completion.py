"""Completion, asked for as a shell asks."""

import os
import subprocess
import sys
from pathlib import Path

import pytest


def completions(folder: Path, line: str, **environment: str) -> list[str]:
    """What bash is told when TAB is pressed behind `line`."""
    answer = folder / ".answer"
    answer.unlink(missing_ok=True)
    variables = {
        "_ARGCOMPLETE": "1",
        "_ARGCOMPLETE_IFS": "\n",
        "_ARGCOMPLETE_SHELL": "bash",
        "_ARGCOMPLETE_SUPPRESS_SPACE": "1",
        "_ARGCOMPLETE_STDOUT_FILENAME": str(answer),
        "COMP_LINE": line,
        "COMP_POINT": str(len(line)),
    }
    completed = subprocess.run(
        [sys.executable, "-c", "import sys; from lightpaint.cli import main; sys.exit(main())"],
        cwd=folder,
        env={**os.environ, **variables, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert completed.stdout == completed.stderr == ""
    return sorted(answer.read_text(encoding="utf-8").split("\n")) if answer.is_file() else []


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("hall.xml", "hall.basis.exr", "warm.png", "notes.txt", "lighting.json"):
        (tmp_path / name).write_text("")
    (tmp_path / "looks").mkdir()
    return tmp_path


@pytest.mark.parametrize(
    ("line", "completions_offered"),
    [
        ("lightpaint so", ["solve"]),
        ("lightpaint cache c", ["clear"]),
        ("lightpaint solve --no-li", ["--no-lights-file"]),
        ("lightpaint solve --quality ", ["final", "preview"]),
        ("lightpaint lights h", ["hall.xml"]),
        ("lightpaint solve h", ["hall.basis.exr", "hall.xml"]),
        ("lightpaint solve hall.xml w", ["warm.png"]),
        ("lightpaint solve hall.xml l", ["looks/"]),
        ("lightpaint relight hall.xml l", ["lighting.json", "looks/"]),
        ("lightpaint solve hall.xml n", []),
        ("lightpaint solve hall.xml --spp 4 w", ["warm.png"]),
        ("lightpaint solve --spp 4 hall.xml --resize w", ["warm.png"]),
        ("lightpaint solve --suggest h", ["hall.basis.exr", "hall.xml"]),
        ("lightpaint solve hall.xml warm.png --quality ", ["final", "preview"]),
        ("lightpaint solve hall.xml --seed 1 --qual", ["--quality"]),
    ],
)
def test_what_is_offered(folder: Path, line: str, completions_offered: list[str]) -> None:
    assert [x for x in completions(folder, line) if x] == completions_offered


def test_nothing_is_rendered_or_loaded_for_it(folder: Path) -> None:
    """Neither where a shell asks, nor argcomplete where none does."""
    code = (
        "import sys, lightpaint.cli as c\n"
        "try: c.main(['--help'])\n"
        "finally: print('argcomplete' in sys.modules)"
    )
    completed = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert completed.stdout.endswith("False\n")


def test_without_argcomplete_there_is_no_answer_and_no_noise(folder: Path) -> None:
    (folder / "argcomplete.py").write_text("raise ImportError")
    path = os.pathsep.join([str(folder), *sys.path])
    assert completions(folder, "lightpaint so", PYTHONPATH=path) == []


def test_the_shell_finds_it() -> None:
    """What global completion looks for, in the module and in what the script imports."""
    import lightpaint.cli

    for file in (Path(lightpaint.cli.__file__), Path(lightpaint.cli.__file__).parents[1]):
        file = file / "__main__.py" if file.is_dir() else file
        assert "PYTHON_ARGCOMPLETE_OK" in file.read_text(encoding="utf-8")[:1024]
