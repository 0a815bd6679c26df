"""The site: what stands in the repository is led into it, and what is wrong with it is found."""

import ast
import inspect
import re
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest
from page_texts import all_sentences
from renderer import REPOSITORY

import lightpaint as lp
from lightpaint.cli.options.parser import COMMANDS, command_parser
from lightpaint.sentences import Hint, Word

sys.path.insert(0, str(REPOSITORY / "docs" / "site"))

from api_pages import GROUPS, PARTS
from command_pages import DOCUMENTS, write_commands
from page_repair import short_type
from site_check import check_site
from staging import stage


@pytest.fixture(scope="module")
def staged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    source = tmp_path_factory.mktemp("site") / "source"
    stage(source)
    return source


def test_every_public_name_has_one_place_in_the_reference() -> None:
    names = [name for _, _, names in GROUPS.values() for name in names]
    assert sorted(names) == sorted({*lp.__all__, *lp._EXTRAS} - {"__version__"})


#: Classes of public attributes that a program has no use for: they hold files, nodes and unknowns.
INTERNAL = {
    *("Backend", "Emitter", "Features", "Film", "Integrator", "IntegratorChoice", "ParsedScene"),
    *("BasisFile", "GroupsFile", "PaintedView", "PlacementFile", "PlacementRecord", "ResultFolder"),
    *("Loss", "Reduction", "SceneRequests", "Sentence", "Software", "SourceKey"),
    *("Squares", "Stream", "SurfaceFilter"),
    *("HungLuminaire", "MeasuringPoints", "Requirements"),
    *("TexelLayout", "Views"),
}


def test_what_public_attributes_hold_is_in_the_reference() -> None:
    public = [getattr(lp, name) for name in lp.__all__ if name != "__version__"]
    documented = {name for names in PARTS.values() for name in names} | set(lp.__all__)
    seen: set[str] = set()
    for value in (x for x in public if isinstance(x, type)):
        for hint in [*attribute_types(value)]:
            seen |= {x.__name__ for x in classes_in(hint)}
    assert seen - documented - INTERNAL == set()
    parts = {name for names in PARTS.values() for name in names}
    assert parts & (set(lp.__all__) | INTERNAL) == set()


def attribute_types(kind: type) -> Iterator[Any]:
    """The annotations of a class's public attributes and of what its properties return."""
    hints = get_type_hints(kind)
    yield from (hint for name, hint in hints.items() if not name.startswith("_"))
    for name, value in vars(kind).items():
        getter = getattr(value, "fget", None) or getattr(value, "func", None)
        if getter is not None and not name.startswith("_"):
            yield get_type_hints(getter).get("return")


def classes_in(hint: Any) -> Iterator[type]:
    """The classes of lightpaint in an annotation."""
    if isinstance(hint, type) and hint.__module__.startswith("lightpaint."):
        yield hint
    for part in get_args(hint):
        yield from classes_in(part)


def test_the_reference_names_nothing_that_readers_cannot_find() -> None:
    """Modules, and names that begin with an underscore, are of those who read the code."""
    values = [getattr(lp, name) for name in lp.__all__ if name != "__version__"]
    values += [
        getattr(import_module(f"lightpaint.{module}"), name)
        for module, names in PARTS.items()
        for name in names
    ]
    texts = [(value.__name__, inspect.getdoc(value) or "") for value in values]
    for value in (x for x in values if isinstance(x, type)):
        members = {k: x for k, x in vars(value).items() if not k.startswith("_")}
        texts += [(f"{value.__name__}.{k}", inspect.getdoc(x) or "") for k, x in members.items()]
    assert len(texts) > 400
    modules = "|".join(path.stem for path in (REPOSITORY / "lightpaint").rglob("*.py"))
    hidden = re.compile(rf"\b(?:{modules})\.py\b|`_\w+|\(see `?\w+\.\w+")
    found = [(name, hidden.findall(text)) for name, text in texts]
    assert [x for x in found if x[1]] == []


def test_names_of_arguments_are_shown_as_code() -> None:
    def mix(red: float, green: float, blue: float) -> None:
        """Mix."""

    pytest.importorskip("docutils", reason="docutils")
    spec = spec_from_file_location("site_conf", REPOSITORY / "docs" / "conf.py")
    assert spec is not None
    assert spec.loader is not None
    conf = module_from_spec(spec)
    spec.loader.exec_module(conf)
    lines = ["Mix.", "", "red: the first. green, blue: others: two; red: twice.", "Args:", "red: x"]
    conf.mark_names(None, "function", "mix", mix, None, lines)
    assert lines[2] == "`red`: the first. `green`, `blue`: others: two; `red`: twice."
    assert lines[3:] == ["Args:", "red: x"]


def test_types_are_shown_without_modules() -> None:
    array = "numpy.ndarray[tuple[Any, ...], numpy.dtype[numpy.float64]]"
    assert short_type(f"{array} | None") == "array of float64 | None"
    place = "lightpaint.scene.properties.site.EmitterPlace"
    assert short_type(f"tuple[{place}, ...]") == "tuple[EmitterPlace, ...]"


def test_every_option_of_every_command_is_in_the_reference(tmp_path: Path) -> None:
    write_commands(tmp_path / "commands")
    [commands] = (x for x in command_parser()._actions if isinstance(x.choices, dict))
    for name, parser in commands.choices.items():
        page = (tmp_path / "commands" / f"{name}.rst").read_text("utf-8")
        shown = " ".join(re.findall(r"^\.\. option:: (.*)$", page, re.MULTILINE))
        options = [x for action in parser._actions for x in action.option_strings]
        assert [x for x in options if not re.search(rf"(?<![\w-]){x}(?![\w-])", shown)] == []


def test_the_reference_says_what_each_command_prints_for_programs() -> None:
    assert set(DOCUMENTS) == set(COMMANDS)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_its_function_and_its_guide(name: str) -> None:
    command = COMMANDS[name]
    assert callable(getattr(import_module(f"lightpaint.cli.commands.{command.module}"), name))
    assert (REPOSITORY / "docs" / f"{command.guide}.md").exists()


def test_links_out_of_the_documents_lead_into_the_site(staged: Path) -> None:
    assert "](changelog.md)" in (staged / "stability.md").read_text("utf-8")
    assert "](decisions.md#51-" in (staged / "security.md").read_text("utf-8")
    lights = (staged / "lights.md").read_text("utf-8")
    assert "](notebooks/01_constraints.ipynb)" in lights
    for page in staged.rglob("*.md"):
        text = re.sub(r"```.*?```", "", page.read_text("utf-8"), flags=re.DOTALL)
        for link in re.findall(r"\]\(([^)\s#]+)", text):
            if "://" not in link:
                assert (page.parent / link).resolve().is_relative_to(staged), (page, link)


def test_a_page_that_is_broken_is_found(tmp_path: Path) -> None:
    (tmp_path / "whole.html").write_text(
        '<h1 id="top">x</h1><a href="#top">x</a><a href="https://example.org">x</a>', "utf-8"
    )
    assert check_site(tmp_path) == []
    (tmp_path / "broken.html").write_text(
        '<a href="whole.html#bottom">x</a><a href="lost.html">x</a><img src="whole.html">'
        '<script src="https://example.org/x.js"></script>',
        "utf-8",
    )
    problems = check_site(tmp_path)
    assert [problem.partition(": ")[2].partition(" ")[0] for problem in problems] == [
        "dead",
        "dead",
        "loads",
        "no",
    ]


def test_messages_that_are_explained_are_those_of_the_code() -> None:
    """`…` stands for what differs; each piece between has to stand in one literal."""
    page = (REPOSITORY / "docs" / "troubleshooting.md").read_text("utf-8")
    messages = [" ".join(x.split()) for x in re.findall(r"\*\*`([^`]+)`\*\*", page)]
    assert len(messages) > 50
    literals = "\n".join(_literals())
    missing = [
        piece
        for message in messages
        for piece in re.split(r"\s*…\s*", message)
        if len(piece) > 3 and piece.strip(":; ") not in literals
    ]
    assert missing == []


def _literals() -> Iterator[str]:
    """Yield the texts of the package: its own literals, with … for each expression in them."""
    trees = [
        ast.parse(path.read_text("utf-8")) for path in (REPOSITORY / "lightpaint").rglob("*.py")
    ]
    constants = {
        x.targets[0].id: x.value
        for tree in trees
        for x in tree.body
        if isinstance(x, ast.Assign) and isinstance(x.targets[0], ast.Name)
    }
    for tree in trees:
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and len(node.args) > 1:
                # A sentence of several parts.
                yield "".join(_text_of(x, constants) for x in node.args)
            elif isinstance(node, ast.JoinedStr):
                yield _text_of(node, constants)
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield node.value
    for text in all_sentences().values():
        yield from [text] if isinstance(text, str) else text.values()


def _text_of(node: ast.expr, constants: Mapping[str, ast.expr]) -> str:
    """The text of an expression as far as the code has it, with … for the rest.

    constants: what the names of all modules stand for.
    """
    match node:
        case ast.JoinedStr():
            return "".join(_text_of(x, constants) for x in node.values)
        case ast.Constant():
            return str(node.value)
        case ast.Call(func=ast.Name("Hint")):
            with suppress(NameError):  # of an argument that the code computes
                return str(eval(ast.unparse(node), {"Hint": Hint, "Word": Word}))
        case ast.Call(func=ast.Name("Sentence" | "Remedy")):
            return "".join(_text_of(x, constants) for x in node.args)
        case ast.Name() if isinstance(constants.get(node.id), ast.Call):
            return _text_of(constants[node.id], {})
    return "…"


def test_the_version_is_the_same_everywhere() -> None:
    yaml = pytest.importorskip("yaml", reason="PyYAML")
    citation = yaml.safe_load((REPOSITORY / "CITATION.cff").read_text("utf-8"))
    assert citation["version"] == lp.__version__
    assert citation["cff-version"] == "1.2.0"
    titles = [citation["title"], *(x["title"] for x in citation["references"])]
    page = " ".join((REPOSITORY / "docs" / "cite.md").read_text("utf-8").split())
    assert [title for title in titles if title not in page] == []
    assert f"version = {{{lp.__version__}}}" in page
    versions = re.findall(r"^## (\d\S+)", (REPOSITORY / "CHANGELOG.md").read_text("utf-8"), re.M)
    assert versions[0] == lp.__version__
