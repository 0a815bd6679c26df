"""What the documents say of the code is so: names of files, public names, the corridor."""

import ast
import re
import tomllib
from argparse import ArgumentParser
from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

import lightpaint as lp
from lightpaint.basis.cache.basis_cache import MAX_BYTES
from lightpaint.batch.dask_engine import LIMIT_FACTOR, MIN_LIMIT_S
from lightpaint.batch.manifest.checks import SOLVE_STEPS
from lightpaint.batch.manifest.entries import MAX_LOOKS
from lightpaint.batch.manifest.file_names import MAX_VISITED
from lightpaint.batch.manifest.keys import MAX_FRAMES
from lightpaint.cli.commands.render_commands import template_lines
from lightpaint.cli.options.parser import command_parser
from lightpaint.colour.lamp import MAX_EMITTERS
from lightpaint.dmx.console_link import PRIORITY
from lightpaint.dmx.console_receiver import LOOPBACK, USUAL_PRIORITY
from lightpaint.lighting.answer.lighting_file import MAX_BYTES as MAX_LIGHTING
from lightpaint.lighting.constraints.light_constraints import LAMP_KELVINS
from lightpaint.lighting.fit import DEFAULT_HOLD
from lightpaint.paint.message_frames import MAX_CHARACTERS, MAX_VALUES
from lightpaint.paint.server.address import DEFAULT_PORT
from lightpaint.paint.server.client import MAX_QUEUED, MAX_QUEUED_BYTES
from lightpaint.paint.server.http_server import MAX_UNAUTHENTICATED
from lightpaint.paint.server.session_clients import MAX_PAGES
from lightpaint.paint.session.picture_table import MAX_PAGE_VALUES
from lightpaint.photometry.measure import DEFAULT_ERROR
from lightpaint.pipeline.job.settings import MAX_SUGGEST
from lightpaint.scene.lights.light_choice import MAX_SEPARATE
from lightpaint.scene.lights.lights_file import MAX_BYTES as MAX_LIGHTS_FILE
from lightpaint.scene.quality_presets import PRESETS
from lightpaint.scene.scene_reader import load_scene
from lightpaint.target.template import PLAIN_FILES
from lightpaint.validation import MAX_LISTED, MAX_NAME, MAX_PRIMARIES, MAX_SPP

ROOT = Path(__file__).parent.parent
#: Of the root, the documentation and its tutorials.
DOCUMENTS = [
    path
    for folder in (".", "docs", "docs/tutorials")
    for path in sorted((ROOT / folder).glob("*.md"))
]
FILES = {"/" + path.relative_to(ROOT).as_posix() for path in ROOT.glob("[a-z]*/**/*.py")}

#: A file that is written, and an option of another program.
OTHER_FOLDER = {"set_lights.py", "set_scene.py", "--colorconvert"}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_files_that_are_named_are_there(document: Path):
    named_files = set(re.findall(r"`([\w/]+\.py)`", document.read_text())) - OTHER_FOLDER
    assert [
        x for x in sorted(named_files) if not any(file.endswith("/" + x) for file in FILES)
    ] == []


def test_architecture_is_a_start_of_a_few_pages() -> None:
    """What stands in it is read whole by whoever changes something; reasons have their own page."""
    text = (ROOT / "docs" / "architecture.md").read_text()
    assert len(text.split()) <= 1500


def test_decisions_are_numbered_and_short() -> None:
    """A title is what was decided; one to four sentences say why."""
    text = (ROOT / "docs" / "decisions.md").read_text()
    records = [x.partition("\n") for x in re.split(r"^### ", text, flags=re.M)[1:]]
    numbers = [title.partition(".")[0] for title, _, _ in records]
    assert numbers == [str(n) for n in range(1, len(records) + 1)]
    reasons = {title: body.partition("\n## ")[0].split() for title, _, body in records}
    assert [x for x, words in reasons.items() if not 5 <= len(words) <= 85] == []
    ends = {x: sum(word.endswith((".", ".)")) for word in words) for x, words in reasons.items()}
    assert [x for x, count in ends.items() if not 1 <= count <= 4] == []


#: Characters of a paragraph: six lines of 100, and half a word at the end of each.
LONGEST = 620


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_paragraphs_are_short(document: Path) -> None:
    """Six lines of 100 characters, however the file is wrapped; tables and code aside."""
    text = re.sub(r"```.*?```", "", document.read_text(), flags=re.DOTALL)
    blocks = re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d\.) )", text)
    prose = [" ".join(x.split()) for x in blocks if not re.match(r"\s*[|<#]|    ", x)]
    assert [x[:60] for x in prose if len(x) > LONGEST] == []


def test_rooms_that_are_named_are_there():
    text = (ROOT / "docs" / "architecture.md").read_text()
    rooms = set(re.findall(r"`([a-z_]+(?:/[a-z_]+)*)/`", text))
    assert len(rooms) > 15
    assert [room for room in rooms if not (ROOT / "lightpaint" / room).is_dir()] == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_public_names_and_options_that_are_named_are_there(document: Path):
    text = document.read_text()
    public = set(re.findall(r"\blp\.(\w+)", text))
    assert sorted(public - {*lp.__all__, *lp._EXTRAS}) == []
    options = set(re.findall(r"`(--[a-z-]+)(?:[ `=])", text)) - OTHER_FOLDER
    assert sorted(options - _options()) == []


@pytest.mark.nightly
@pytest.mark.long
@pytest.mark.usefixtures("short_search")
def test_snippets_of_python_run_one_after_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    for library in ("anywidget", "pandas", "xarray"):
        pytest.importorskip(library, reason=library)
    text = (ROOT / "docs" / "python.md").read_text()
    snippets = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert len(snippets) > 5
    for name in ("scenes", "targets"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)

    def small(path: str) -> lp.Scene:
        return replace(load_scene(path).reduced("1/10"), spp=2)

    monkeypatch.setattr(lp, "load_scene", small)
    names: dict[str, Any] = {}
    try:
        for snippet in snippets:
            if "import marimo" not in snippet:  # which keeps states for its own cells only
                exec(snippet.replace("spp=64", "spp=2"), names)
    finally:
        if "painter" in names:
            names["painter"].close()


def _parsers() -> list[ArgumentParser]:
    """Those of all sub-commands."""
    [commands] = (x for x in command_parser()._actions if isinstance(x.choices, dict))
    return list(commands.choices.values())


@cache
def _options() -> set[str]:
    return {
        option
        for parser in _parsers()
        for action in parser._actions
        for option in action.option_strings
    }


#: Of options whose help has a number that is not that of the parser itself: what the code has.
DEFAULTS = {
    "--hold": f"{DEFAULT_HOLD:g} if the current look was painted over, else 0",
    "--port": f"{DEFAULT_PORT}, or any free one if that is taken",
    "--exposure": "0",
    "--error": f"{DEFAULT_ERROR:.0%}",
    "--space": "8 or 16 bits",
    "--priority": f"{PRIORITY}, below the {USUAL_PRIORITY} of consoles, which win",
    "--interface": f"{LOOPBACK}, for programs of this machine",
    "--task-limit": f"{LIMIT_FACTOR:g} times what it is expected to take, at least {MIN_LIMIT_S:g}",
}


def test_numbers_that_the_help_gives_as_defaults_are_those_of_the_code():
    """Help is shown without loading what the numbers come from, so it has them a second time."""
    defaults = {
        (action.option_strings[-1], default)
        for parser in _parsers()
        for action in parser._actions
        for default in re.findall(r"\(default: (.*\d.*)\)", action.help or "")
    }
    assert {option for option, _ in defaults} == set(DEFAULTS)
    assert [(x, text) for x, text in sorted(defaults) if DEFAULTS[x] not in text] == []


def test_numbers_in_other_words_of_the_help_are_those_of_the_code():
    texts = " ".join(
        " ".join((action.help or "").split()) for parser in _parsers() for action in parser._actions
    )
    preview, final = PRESETS["preview"], PRESETS["final"]
    pixels = round(preview.pixels or 0, -4)
    for phrase in (
        f"preview: {preview.spp} samples per pixel on about {pixels:,} pixels",
        f"final: {final.spp} on the whole film",
        f"white: {LAMP_KELVINS[0]} to {LAMP_KELVINS[1]} K",
        f"more than {MAX_SEPARATE} are similar",
    ):
        assert phrase in texts


def test_numbers_of_settings_are_the_same_in_documents_and_on_the_page():
    page = ROOT / "lightpaint" / "paint" / "page"
    solving, method = ((ROOT / "docs" / name).read_text() for name in ("solving.md", "method.md"))
    panel = (page / "ui" / "settings_panel.js").read_text()
    assert f"const DEFAULT_HOLD = {DEFAULT_HOLD:g};" in panel
    assert f"`--hold {DEFAULT_HOLD:g}`" in solving
    assert f"It is {DEFAULT_HOLD:g} by default where something was painted over" in method
    for text in (panel, solving):
        assert f"{LAMP_KELVINS[0]} to {LAMP_KELVINS[1]} K" in text
    assert f"`--kelvin '*={LAMP_KELVINS[0]}:{LAMP_KELVINS[1]}'`" in method


def test_which_files_are_painted_over_is_said_alike():
    """In the first look, in the document on targets, and by `lightpaint template` itself."""
    listed = {
        match[1]
        for line in template_lines(
            Path("template"), [Path("template") / name for name in PLAIN_FILES]
        )
        if (match := re.match(r"template/(\S+): .*paint over", line))
    }
    look = (ROOT / "docs" / "first-look.md").read_text()
    [section] = re.findall(r"The first command writes (.*?)Paint over one of the two", look, re.S)
    files = re.findall(r"`(\w+\.(?:png|exr))`", section)
    targets = (ROOT / "docs" / "targets.md").read_text()
    [targets_named] = re.findall(
        r"Open `([\w.]+)` \(16 bits, sRGB\) or `([\w.]+)` \(linear", targets
    )
    assert listed == set(files) == set(targets_named)


def test_the_corridor_is_quoted_as_it_stands():
    text = (ROOT / "docs" / "architecture.md").read_text()
    [quoted] = re.findall(r"```python\n((?:@\w+\(\)\n)?def run.*?)```", text, re.DOTALL)
    module = ast.parse((ROOT / "lightpaint" / "pipeline/job_run.py").read_text())
    [run] = (x for x in module.body if isinstance(x, ast.FunctionDef) and x.name == "run")
    del run.body[0]  # the docstring
    assert ast.dump(ast.parse(quoted).body[0]) == ast.dump(run)


def test_the_walls_are_drawn_as_they_stand() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    [layers] = (x["layers"] for x in contracts["contracts"] if x["name"] == "Rooms import one way")
    text = (ROOT / "docs" / "architecture.md").read_text()
    [drawn] = re.findall(r"Imports run one way, downwards:\n\n((?:    .*\n)+)", text)
    assert drawn.split() == " ".join(x for x in layers if x != "__main__").split()


def _anchors(document: Path) -> set[str]:
    """Return what headings of a document are linked by, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", document.read_text(), re.M)
    words = (re.sub(r"[^\w\- ]", "", heading.lower()) for heading in headings)
    return {word.replace(" ", "-") for word in words}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_somewhere(document: Path) -> None:
    text = re.sub(r"```.*?```", "", document.read_text(), flags=re.DOTALL)
    broken_links = []
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        path, _, anchor = link.partition("#")
        if "://" in link:
            continue
        file = (document.parent / path).resolve() if path else document
        if not file.exists() or (anchor and anchor not in _anchors(file)):
            broken_links.append(link)
    assert broken_links == []


def test_every_option_is_in_some_document() -> None:
    """Or in the help of a command alone, for those that say all there is to say of themselves."""
    text = " ".join(document.read_text() for document in DOCUMENTS)
    options = set(re.findall(r"(?<![\w-])(--?[a-zA-Z][a-z-]*)", text))
    undocumented = {
        action.option_strings[-1]
        for parser in _parsers()
        for action in parser._actions
        if action.option_strings and not options & set(action.option_strings)
    }
    assert sorted(undocumented) == []


def test_snippets_name_what_there_is() -> None:
    """Names that snippets of Python import from modules, in all documents."""
    missing_names = []
    for document in DOCUMENTS:
        for snippet in re.findall(r"```python\n(.*?)```", document.read_text(), re.DOTALL):
            for node in ast.walk(ast.parse(snippet)):
                if isinstance(node, ast.ImportFrom) and str(node.module).startswith("lightpaint."):
                    module = import_module(str(node.module))
                    missing_names += [x.name for x in node.names if not hasattr(module, x.name)]
    assert missing_names == []


def test_numbers_in_documents_are_those_of_the_code() -> None:
    def text(name: str) -> str:
        return " ".join((ROOT / "docs" / name).read_text().split())

    assert (
        f"by default {LIMIT_FACTOR:g} times what is expected, and {MIN_LIMIT_S:g} at least"
        in text("batch.md")
    )
    *most, last = (f"`{step}`" for step in SOLVE_STEPS)
    assert f"by default {', '.join(most)} and {last}" in text("batch.md")
    assert f"chooses the port ({DEFAULT_PORT}, or any if that is taken)" in text("painter.md")
    assert f"Of such connections {MAX_UNAUTHENTICATED} may be open" in text("painter.md")
    assert f"More than {MAX_SEPARATE} emitters that are alike" in text("lights.md")
    assert f"{MAX_BYTES // 2**30} GiB at most" in text("solving.md")
    limits = text("limits.md")
    for phrase in (
        f"at most {MAX_PAGES} tabs at a time",
        f"{MAX_UNAUTHENTICATED} connections that have not shown its key",
        f"{MAX_QUEUED} messages or {MAX_QUEUED_BYTES // 2**20} MiB of a page",
        f"A batch has {MAX_LOOKS:,} looks, beside {MAX_FRAMES:,} frames",
        f"a name has {MAX_NAME} characters",
        f"mixes {MAX_PRIMARIES} primaries, a lamp has {MAX_EMITTERS} emitters",
        f"`--suggest` takes {MAX_SUGGEST} lights, `--spp` {MAX_SPP:,} samples per pixel",
        f"names {MAX_LISTED:,} lights, groups and patterns, in {MAX_LIGHTS_FILE // 2**20} MiB",
        f"`lighting.json` {MAX_LIGHTING // 2**20} MiB",
        f"lists {MAX_LISTED:,} sensors or paintings",
        f"scans {MAX_VISITED:,} files",
        f"texts of {MAX_CHARACTERS} characters and lists of {MAX_VALUES} values",
        f"at most {round(MAX_PAGE_VALUES / 1e6)} million pixels of all lights",
    ):
        assert phrase in limits
    solving = text("solving.md")
    for preset in PRESETS.values():
        assert f"{preset.spp} samples per pixel" in solving
