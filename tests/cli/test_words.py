"""The library speaks Python; the command line translates."""

import argparse
import ast
import inspect
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import lightpaint
from lightpaint.batch.run_options import RunOptions
from lightpaint.cli.options.parser import command_parser
from lightpaint.cli.options.source_options import LOADING
from lightpaint.cli.output.vocabulary import _ARGUMENT, OPTIONS, SPELLINGS, spoken
from lightpaint.paint.launch import paint_in_browser
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import NOT_IN_GROUPS
from lightpaint.relit.export_format import Source
from lightpaint.target.target_reader import read_target

PACKAGE = Path(lightpaint.__file__).parent

#: An option as a shell takes it; CSS has variables that look alike, with a colon behind.
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]+\b(?![:\w-])")

#: What a message may name: `keyword=` with something behind.
KEYWORD = re.compile(r"(?<![^\s(])([a-z_]+)=(?=\S)")


def texts(file: Path) -> Iterator[tuple[int, str]]:
    """Line and text of every string, those of several parts whole, with V for their values."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    parts = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            parts |= {id(value) for value in node.values}
            message = "".join(
                str(x.value) if isinstance(x, ast.Constant) else _value(x) for x in node.values
            )
            yield node.lineno, message
        elif (
            isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in parts
        ):
            yield node.lineno, node.value


def _value(node: ast.expr) -> str:
    """What stands for a value: as `!r` would show it, or not."""
    is_quoted = isinstance(node, ast.FormattedValue) and node.conversion == ord("r")
    return "'V'" if is_quoted else "V"


def _docstrings(file: Path) -> set[str]:
    tree = ast.parse(file.read_text(encoding="utf-8"))
    kinds = ast.Module | ast.ClassDef | ast.FunctionDef
    docstrings = (ast.get_docstring(x, clean=False) for x in ast.walk(tree) if isinstance(x, kinds))
    return {text for text in docstrings if text}


#: The command line, and Blender's add-on, which is not part of the library and calls the program.
SPEAKS_OPTIONS = {"cli", "blender_addon"}

LIBRARY = [
    file
    for file in sorted(PACKAGE.rglob("*.py"))
    if not SPEAKS_OPTIONS & set(file.relative_to(PACKAGE).parts)
]


@pytest.mark.nightly
def test_the_library_names_no_option() -> None:
    with_options = [
        (file, line, text) for file in LIBRARY for line, text in texts(file) if OPTION.search(text)
    ]
    assert with_options == []


def test_every_argument_that_a_message_names_is_in_the_table() -> None:
    unknown = []
    for file in LIBRARY:
        docstrings = _docstrings(file)
        for line, text in texts(file):
            # Markup has attributes.
            if text in docstrings or "<" in text or "\n" in text:
                continue
            for match in KEYWORD.finditer(text):
                if any(text.startswith(spelling, match.start()) for spelling in SPELLINGS):
                    continue
                if match[1] not in OPTIONS or not _ARGUMENT.match(text, match.start()):
                    unknown.append(f"{file}:{line}: {text}")
    assert unknown == []


def test_the_test_itself_finds_what_it_looks_for(tmp_path: Path) -> None:
    file = tmp_path / "bad.py"
    file.write_text('raise E(f"{x} is small: " "pass --resize or resized=True")', encoding="utf-8")
    [(_, text)] = texts(file)
    assert OPTION.search(text)
    assert [match[1] for match in KEYWORD.finditer(text)] == ["resized"]
    assert not OPTION.search('style="--aspect: 1.5"')


def test_every_option_of_the_table_is_there() -> None:
    [commands] = [
        action
        for action in command_parser()._actions
        if isinstance(action, argparse._SubParsersAction)
    ]
    options_in_use = {
        option
        for command in commands.choices.values()
        for action in command._actions
        for option in action.option_strings
    }
    assert set(OPTIONS.values()) <= options_in_use
    assert {spelling.split()[-1] for spelling in SPELLINGS.values()} <= options_in_use


def test_every_word_of_the_table_is_an_argument_of_the_library() -> None:
    keywords = {*inspect.signature(Settings).parameters, *inspect.signature(read_target).parameters}
    keywords |= {*inspect.signature(lightpaint.load_scene).parameters}
    keywords |= {*inspect.signature(lightpaint.read_light_groups).parameters}
    keywords |= {*inspect.signature(lightpaint.paint_with_light).parameters}
    keywords |= {*inspect.signature(lightpaint.Job).parameters}
    keywords |= {*inspect.signature(paint_in_browser).parameters}
    keywords |= {*inspect.signature(Source).parameters, *inspect.signature(RunOptions).parameters}
    keywords |= {*inspect.signature(lightpaint.relight_frames).parameters}
    assert {*NOT_IN_GROUPS, *LOADING} <= set(OPTIONS)
    assert {*OPTIONS, *(text.partition("=")[0] for text in SPELLINGS)} <= keywords


@pytest.mark.parametrize(
    ("python", "shell"),
    [
        ("export it at that size, or pass resize=True", "export it at that size, or pass --resize"),
        ("by alpha or mask=... what was painted", "by alpha or --mask what was painted"),
        ("pass find=False if all of it counts", "pass --no-template if all of it counts"),
        ("weighed against it: use refine=0", "weighed against it: use --refine 0"),
        ("use noise_correction=False, and", "use --no-correct-noise, and"),
        ('space="display" fits', "--space display fits"),
        ("like pattern='Light_{name}'; its", "like --pattern 'Light_{name}'; its"),
        ("profile (transform=..., mask=...), or", "profile (--view, --mask), or"),
        ("set it with parameters={'width': ...}", "set it with -D width=VALUE"),
        ("(use_cache=False renders it again)", "(--no-cache renders it again)"),
        ("spp=..., refine=... cannot", "--spp, --refine cannot"),
        # Names of files and of other things stay as they are.
        ("no such image file: runs/seed=3/a.exr", "no such image file: runs/seed=3/a.exr"),
        ("no such image file: seed=3/a.exr", "no such image file: seed=3/a.exr"),
        ("no such scene file: spp=64.exr", "no such scene file: spp=64.exr"),
        ("count=3 lights", "count=3 lights"),
    ],
)
def test_words_of_the_command_line(python: str, shell: str) -> None:
    assert spoken(python) == shell
