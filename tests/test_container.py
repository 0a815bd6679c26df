"""The container's recipe: what it copies is there, what it installs exists, and nobody is root."""

import re
import shlex
import tomllib
from fnmatch import fnmatch
from pathlib import Path

from packaging.specifiers import SpecifierSet
from renderer import REPOSITORY

RECIPE = (REPOSITORY / "Dockerfile").read_text("utf-8")
PROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text("utf-8"))["project"]


def steps() -> list[tuple[str, str]]:
    """Instruction and arguments of each step, comments left out and lines joined."""
    lines = [line for line in RECIPE.splitlines() if not line.lstrip().startswith("#")]
    text = re.sub(r"\\\n\s*", "", "\n".join(lines))
    split = (line.partition(" ") for line in text.splitlines() if line.strip())
    return [(word, rest.strip()) for word, _, rest in split]


def copied() -> list[str]:
    """What is copied from the checkout."""
    sources = [shlex.split(rest) for word, rest in steps() if word == "COPY"]
    return [x for words in sources if not words[0].startswith("--") for x in words[:-1]]


def reaches(path: str) -> bool:
    """Whether a path gets past .dockerignore, of which the last rule that fits holds."""
    is_in = True
    for rule in (REPOSITORY / ".dockerignore").read_text("utf-8").splitlines():
        if not rule or rule.startswith("#"):
            continue
        pattern = rule.removeprefix("!")
        parts = Path(path).parts
        places = ["/".join(parts[: k + 1]) for k in range(len(parts))]
        if any(fnmatch(x, pattern) for x in places):
            is_in = rule.startswith("!")
    return is_in


def test_all_that_is_copied_is_there_and_sent_along() -> None:
    assert len(copied()) >= 8
    for path in copied():
        assert (REPOSITORY / path).exists(), path
        assert reaches(path), path
    assert not reaches("docs/batch.md")
    assert not reaches(".git/config")


def test_the_package_needs_nothing_that_is_not_copied() -> None:
    """Links of the package lead into folders that come along."""
    for link in (REPOSITORY / "lightpaint").rglob("*"):
        if link.is_symlink():
            link_target = link.resolve().relative_to(REPOSITORY.resolve()).as_posix()
            assert any(link_target.startswith(f"{path}/") for path in copied()), link
    named_files = [PROJECT["readme"], *PROJECT["license-files"]]
    for file in named_files:
        assert any(file == path or file.startswith(f"{path}/") for path in copied()), file


def test_extras_exist_and_the_python_will_do() -> None:
    [extras] = re.findall(r"'\.\[([\w,]+)\]'", RECIPE)
    assert set(extras.split(",")) <= set(PROJECT["optional-dependencies"])
    bases = [rest for word, rest in steps() if word == "FROM"]
    versions = {re.match(r"python:(\d+\.\d+)-slim", base)[1] for base in bases}  # type: ignore[index]
    assert len(bases) == 2
    assert len(versions) == 1
    assert SpecifierSet(PROJECT["requires-python"]).contains(f"{versions.pop()}.0")


def test_it_is_run_by_nobody_and_begins_with_the_command() -> None:
    words = [word for word, _ in steps()]
    last = dict(steps())
    assert last["USER"] not in ("0", "root")
    assert max(k for k, word in enumerate(words) if word == "RUN") < words.index("USER")
    assert last["ENTRYPOINT"] == '["lightpaint"]'
    assert "lightpaint" in PROJECT["scripts"]
    assert last["WORKDIR"].startswith("/")
    # Shells of several commands stop at the first that fails, and leave no lists behind.
    for word, rest in steps():
        assert word != "RUN" or ";" not in rest
        assert "apt-get install" not in rest or "rm -rf /var/lib/apt/lists" in rest
