"""The tutorials: their commands exist, each step has a picture, and files are small."""

import re
import shlex
from pathlib import Path

import pytest
from PIL import Image

from lightpaint.cli.options.parser import command_parser

ROOT = Path(__file__).parent.parent
TUTORIALS = sorted((ROOT / "docs" / "tutorials").glob("*.md"))
PICTURES = ROOT / "docs" / "images" / "tutorials"
FILES = ROOT / "docs" / "tutorials" / "files"

#: Of a picture: bytes, and pixels across. Of all pictures: bytes. Of a file to download: bytes.
MAX_PICTURE, MAX_WIDTH, MAX_PICTURES, MAX_FILE = 120_000, 1280, 6_000_000, 300_000

#: Folders of the repository from which commands read.
FOLDERS = ("scenes/", "targets/", "docs/")

each_tutorial = pytest.mark.parametrize("tutorial", TUTORIALS, ids=lambda path: path.stem)


def commands(tutorial: Path) -> list[list[str]]:
    """Return the words of each command that a tutorial gives; output is in blocks of `text`."""
    text = tutorial.read_text(encoding="utf-8")
    blocks = re.findall(r"^```(\w*)\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    shell = "\n".join(code for language, code in blocks if not language)
    return [shlex.split(line) for line in shell.replace("\\\n", " ").splitlines() if line.strip()]


def steps(tutorial: Path) -> list[str]:
    """Return the text of each numbered step."""
    text = tutorial.read_text(encoding="utf-8")
    return re.findall(r"^## \d+\. .*?(?=^## |\Z)", text, re.DOTALL | re.MULTILINE)


@each_tutorial
def test_commands_are_parsed_and_what_they_read_is_there(
    tutorial: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = [words[1:] for words in commands(tutorial) if words[0] == "lightpaint"]
    assert own
    for words in own:
        try:
            command_parser().parse_args(words)
        except SystemExit:
            pytest.fail(f"{shlex.join(words)}: {capsys.readouterr().err}")
    named = {
        word.partition("=")[2] if "=" in word else word
        for words in commands(tutorial)
        for word in words
    }
    read = [word for word in named if word.startswith(FOLDERS)]
    assert [word for word in read if not (ROOT / word).exists()] == []


@each_tutorial
def test_steps_are_numbered_and_each_has_a_picture(tutorial: Path) -> None:
    numbers = [int(step.split()[1].rstrip(".")) for step in steps(tutorial)]
    assert numbers == list(range(1, len(numbers) + 1))
    assert len(numbers) >= 5
    assert [step.splitlines()[0] for step in steps(tutorial) if "![" not in step] == []


@each_tutorial
def test_a_tutorial_offers_files_and_says_what_makes_its_pictures(tutorial: Path) -> None:
    text = " ".join(tutorial.read_text(encoding="utf-8").split())
    assert re.search(r"\]\(files/[\w.-]+\)", text)
    [script] = re.findall(r"`python docs/images/tutorials/(\w+\.py)` makes the pictures", text)
    assert (PICTURES / script).is_file()


def test_pictures_are_small_and_all_are_used() -> None:
    text = " ".join(tutorial.read_text(encoding="utf-8") for tutorial in TUTORIALS)
    pictures = sorted(PICTURES.glob("*.jpg"))
    assert [path.name for path in pictures if f"images/tutorials/{path.name})" not in text] == []
    assert [path.name for path in pictures if path.stat().st_size > MAX_PICTURE] == []
    assert sum(path.stat().st_size for path in pictures) <= MAX_PICTURES
    for path in pictures:
        with Image.open(path) as picture:
            assert picture.width <= MAX_WIDTH, path.name


def test_files_to_download_are_small_and_all_are_offered() -> None:
    text = " ".join(tutorial.read_text(encoding="utf-8") for tutorial in TUTORIALS)
    files = sorted(FILES.iterdir())
    assert [path.name for path in files if f"(files/{path.name})" not in text] == []
    assert [path.name for path in files if path.stat().st_size > MAX_FILE] == []
