"""The library speaks Python; the command line translates."""

import argparse
import ast
import inspect
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from package_source import statements, tree_of

import lightpaint
from lightpaint.batch.run_options import RunOptions
from lightpaint.cli.options.parser import command_parser
from lightpaint.cli.options.source_options import LOADING
from lightpaint.cli.output.vocabulary import BY_OPTION, OPTIONS, SPELLINGS, spoken
from lightpaint.dmx.mvr import read_rig
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.paint.launch import paint_in_browser
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import NOT_IN_GROUPS
from lightpaint.relit.exported_answer import Source
from lightpaint.sentences import Hint, Lead, Sentence, SourceKey, Word
from lightpaint.target.target_reader import read_target

PACKAGE = Path(lightpaint.__file__).parent

#: An option as a shell takes it, but for pip's; CSS has variables that look alike, with a colon
#: behind.
OPTION = re.compile(r"(?<![\w-])(?<!pip install )--[a-z][a-z-]+\b(?![:\w-])")

#: An argument that a text names instead of a `Hint`: `keyword=` with something behind.
KEYWORD = re.compile(r"(?<![^\s(])([a-z_]+)=(?=\S)")


def texts(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Line and text of every string, those of several parts whole, with V for their values."""
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


def _docstrings(tree: ast.Module) -> set[str]:
    kinds = ast.Module | ast.ClassDef | ast.FunctionDef
    nodes = (x for x in statements(tree) if isinstance(x, kinds))
    docstrings = (ast.get_docstring(x, clean=False) for x in nodes)
    return {text for text in docstrings if text}


#: The command line, and Blender's add-on, which is not part of the library and calls the program.
SPEAKS_OPTIONS = {"cli", "blender_addon"}

LIBRARY = [
    file
    for file in sorted(PACKAGE.rglob("*.py"))
    if not SPEAKS_OPTIONS & set(file.relative_to(PACKAGE).parts)
]


def _declarations(tree: ast.Module) -> set[str]:
    """The texts that declare options of settings."""
    calls = (x for x in ast.walk(tree) if isinstance(x, ast.Call))
    declared = [x for x in calls if ast.unparse(x.func).rpartition(".")[2] == "Option"]
    return {text for call in declared for _, text in texts(call)}


@pytest.mark.nightly
def test_the_library_names_no_option() -> None:
    with_options = []
    for file in LIBRARY:
        tree = tree_of(file)
        left_out = _docstrings(tree) | _declarations(tree)
        with_options += [
            (file, line, text)
            for line, text in texts(tree)
            if OPTION.search(text) and text not in left_out
        ]
    assert with_options == []


def test_no_text_names_an_argument_that_is_not_a_hint() -> None:
    found = []
    for file in LIBRARY:
        tree = tree_of(file)
        docstrings = _docstrings(tree)
        for line, text in texts(tree):
            # Markup has attributes.
            if text not in docstrings and "<" not in text and "\n" not in text:
                found += [f"{file}:{line}: {text}"] * bool(KEYWORD.search(text))
    assert found == []


def hints(file: Path) -> Iterator[str]:
    """The names of the arguments in the messages of a module."""
    if "Hint(" not in file.read_text(encoding="utf-8"):
        return
    for node in ast.walk(tree_of(file)):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Hint" and node.args:
            yield from (x.value for x in node.args[:1] if isinstance(x, ast.Constant))


def test_every_hint_is_in_the_table() -> None:
    spelt = {spelling.partition("=")[0] for spelling in SPELLINGS}
    unknown = {name for file in LIBRARY for name in hints(file)} - {*OPTIONS, *spelt}
    assert unknown == set()


def test_the_test_itself_finds_what_it_looks_for(tmp_path: Path) -> None:
    file = tmp_path / "bad.py"
    file.write_text('raise E(f"{x} is small: " "pass --resize or resized=True")', encoding="utf-8")
    [(_, text)] = texts(tree_of(file))
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
    keywords |= {*inspect.signature(read_rig).parameters}
    keywords |= {*inspect.signature(Constraints.of).parameters}
    assert {*NOT_IN_GROUPS, *LOADING} <= set(OPTIONS)
    assert {*OPTIONS, *(text.partition("=")[0] for text in SPELLINGS)} <= keywords


@pytest.mark.parametrize(
    ("hint", "python", "shell"),
    [
        (Hint("resize", True), "resize=True", "--resize"),
        (Hint("mask"), "mask=...", "--mask"),
        (Hint("find", False), "find=False", "--no-template"),
        (Hint("refine", 0), "refine=0", "--refine 0"),
        (Hint("refine", 1), "refine=1", "--refine 1"),
        (Hint("noise_correction", False), "noise_correction=False", "--no-correct-noise"),
        (Hint("space", Word("display")), 'space="display"', "--space display"),
        (Hint("pattern", "Light_{name}"), "pattern='Light_{name}'", "--pattern 'Light_{name}'"),
        (Hint("transform"), "transform=...", "--view"),
        (Hint("parameters", {"width": ...}), "parameters={'width': ...}", "-D width=VALUE"),
        (Hint("split", {"a sky": "9x4"}), "split={'a sky': '9x4'}", "--split a sky=9x4"),
        (Hint("use_cache", False), "use_cache=False", "--no-cache"),
        (Hint("unheard", 3), "unheard=3", "unheard=3"),
    ],
)
def test_words_of_the_command_line(hint: Hint, python: str, shell: str) -> None:
    sentence = Sentence("size differs: use ", hint, ", or leave it")
    assert sentence == f"size differs: use {python}, or leave it"
    assert spoken(sentence) == f"size differs: use {shell}, or leave it"


OPTIONS_SOURCE = SourceKey(BY_OPTION)


@pytest.mark.parametrize(
    ("key", "start"),
    [
        (OPTIONS_SOURCE / "light" / "a.b lamp" / "lock", "--lock a.b lamp is"),
        (OPTIONS_SOURCE / "light" / "key" / "limits" / "min", "--limit key is"),
        (OPTIONS_SOURCE / "light" / "key" / "duv", "--kelvin key is"),
        (OPTIONS_SOURCE / "light" / "key", "light.key is"),
        (OPTIONS_SOURCE / "new" / 2 / "count", "--add 2: count is"),
        (OPTIONS_SOURCE / "new", "--add: is"),
        (OPTIONS_SOURCE / "tie", "tie is"),
        (SourceKey("room.toml", "light", "key", "lock"), "room.toml: light.key.lock is"),
    ],
)
def test_keys_of_options(key: SourceKey, start: str) -> None:
    sentence = Sentence(key, " is 7: expected less")
    assert sentence == f"{key} is 7: expected less"
    assert spoken(sentence) == f"{start} 7: expected less"


@pytest.mark.parametrize(
    ("key", "lead"),
    [
        (OPTIONS_SOURCE / "light" / "kex", ""),
        (OPTIONS_SOURCE / "light" / "kex" / "move", "--move kex: "),
        (OPTIONS_SOURCE / "new" / 2 / "on", "--add 2: "),
        (OPTIONS_SOURCE / "new", "--add: "),
        (OPTIONS_SOURCE / "tie", "tie: "),
        (SourceKey("room.toml", "light", "kex"), "room.toml: light.kex: "),
    ],
)
def test_a_lead_may_be_left_out(key: SourceKey, lead: str) -> None:
    assert spoken(Sentence(Lead(key), "no light 'kex'")) == f"{lead}no light 'kex'"


@pytest.mark.parametrize(
    "text", ["no such scene file: spp=64", "pass resize=True", "count=3 lights", "a --resize"]
)
def test_a_text_is_never_read(text: str) -> None:
    assert spoken(text) == spoken(Sentence(text)) == text
