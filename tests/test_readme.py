"""The two commands of README: each is one block to copy, which does all of its set-up."""

import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import lightpaint as lp
from lightpaint.cli.options.command_arguments import values_of
from lightpaint.cli.options.parser import command_parser

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text("utf-8")
BEGIN, TESTS = (
    block for block in re.findall(r"^```\n(.*?)^```", README, re.M | re.S) if "venv" in block
)

#: A program that notes how it was called and in which environment, and fails if it is told to.
NOTES = """#!/bin/sh
printf '%s\\n' "$VIRTUAL_ENV" "${0##*/}" "$@" "" >>"$NOTES"
[ "${0##*/}" != "$FAILS" ]
"""

#: The system's Python, whose environments have no pip, for that would use the network.
PYTHON = """#!/bin/sh
exec "$REAL_PYTHON" "$@" --without-pip
"""


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """A folder in which README's commands run, and note what they would install and start."""
    folder = tmp_path / "a clone"
    programs = {"check": NOTES, "bin/pip": NOTES, "bin/lightpaint": NOTES, "bin/python3": PYTHON}
    (folder / "bin").mkdir(parents=True)
    for name, text in programs.items():
        (folder / name).write_text(text)
        (folder / name).chmod(0o755)
    return folder


def called_programs(clone: Path, block: str, *, fails: str = "", shell: str = "sh") -> list[str]:
    """Run a block as somebody pastes it, and return the calls of programs in its environment.

    fails: the program that fails. Raises CalledProcessError if the block does and nothing should.
    """
    notes = clone / "notes"
    notes.unlink(missing_ok=True)
    environment = {
        "PATH": f"{clone / 'bin'}{os.pathsep}{os.defpath}",
        "REAL_PYTHON": sys.executable,
        "NOTES": str(notes),
        "FAILS": fails,
    }
    subprocess.run([shell], input=block, text=True, cwd=clone, env=environment, check=not fails)
    calls = [call.splitlines() for call in notes.read_text().split("\n\n") if call]
    assert {environment for environment, *_ in calls} == {str(clone / ".venv")}
    return [shlex.join(words) for _, *words in calls]


def test_a_block_makes_an_environment_installs_and_starts(clone: Path) -> None:
    for shell in ("sh", "bash"):
        install, *starts = called_programs(clone, BEGIN, shell=shell)
        assert install == "pip install '.[paint]'"
        assert [call.split()[1] for call in starts] == ["demo", "paint"]
    install = "pip install -c constraints.txt '.[test]'"
    assert called_programs(clone, TESTS) == [install, "check"]


@pytest.mark.parametrize("block", [BEGIN, TESTS], ids=["begin", "tests"])
def test_a_block_ends_where_something_fails(clone: Path, block: str) -> None:
    """For it is one command, so that the error is the last that is read."""
    assert len(called_programs(clone, block, fails="pip")) == 1


def test_what_a_block_names_is_there(clone: Path) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    calls = [
        shlex.split(call) for block in (BEGIN, TESTS) for call in called_programs(clone, block)
    ]
    for name, *words in calls:
        if name == "pip":
            [extras] = re.findall(r"\[([\w,]+)\]", " ".join(words))
            assert set(extras.split(",")) <= set(project["optional-dependencies"])
    assert (ROOT / "constraints.txt").is_file()
    assert os.access(ROOT / "check", os.X_OK)
    demo, paint = (
        command_parser().parse_args(words) for name, *words in calls if name == "lightpaint"
    )
    # What the demo writes, the painter opens.
    scene = lp.write_demo(clone / values_of(demo, [])["folder"]).scene
    assert [scene] == [clone / source for source in paint.sources]


def test_all_checks_are_installed_as_it_says() -> None:
    """By the script that checks every change, which says the same words."""
    script = (ROOT / ".ci" / "run").read_text("utf-8")
    _, _, install, check = TESTS.strip().split(" && ")
    assert re.search(rf"^{re.escape(install)}", script, re.M)
    assert script.splitlines()[-1] == check
