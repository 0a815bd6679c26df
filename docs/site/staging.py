"""The sources of the site: the documents, with links that lead out of docs/ led into the site.

On GitHub a document links to notebooks, scenes and the files of the root by their places in the
repository. The site has pages of some of these; of other files it offers a copy to download, and a
link to a folder becomes plain text.
"""

import json
import re
import shutil
from os.path import relpath
from pathlib import Path

DOCS = Path(__file__).resolve().parent.parent
ROOT = DOCS.parent

#: Documents of the root, and their pages.
ROOT_PAGES = {
    "README.md": "index.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "SECURITY.md": "security.md",
}

#: Tutorials in the order in which somebody learns, and the picture of each; others follow.
TUTORIALS = {
    "an-evening-in-the-gallery": "evening-6-warmer",
    "a-paint-over-from-gimp-or-krita": "paint-over-3-layers",
    "a-stage-from-two-seats": "two-seats-4-dawn",
    "a-blender-shot": "blender-6-keyed",
    "the-sky-for-a-picture": "sky-2-painting",
    "hang-three-lights": "three-lights-1-painting",
    "a-rig-that-follows": "rig-5-console",
    "fifty-looks-overnight": "fifty-3-gallery",
}

_LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")
_FENCE = re.compile(r"(^ *(?:```|~~~).*?^ *(?:```|~~~) *$)", re.MULTILINE | re.DOTALL)
#: A percent sign that begins a line of text: MyST takes such a line for a comment.
_PERCENT = re.compile(r"^( {0,3})%", re.MULTILINE)


def stage(source: Path) -> None:
    """Write the documents, notebooks, pictures and tables into a new folder `source`."""
    for document in sorted(DOCS.glob("*.md")):
        _write(source, document, source / document.name)
    for name, page in ROOT_PAGES.items():
        if page != "index.md":
            _write(source, ROOT / name, source / page)
    for notebook in sorted((ROOT / "notebooks").glob("*.ipynb")):
        _write(source, notebook, source / "notebooks" / notebook.name)
    _list_notebooks(source / "notebooks")
    shutil.copytree(DOCS / "images", source / "images", ignore=shutil.ignore_patterns("*.py"))
    shutil.copytree(DOCS / "benchmarks", source / "benchmarks")
    _stage_tutorials(source)


def _stage_tutorials(source: Path) -> None:
    """Write the tutorials with their files, and a page that lists them."""
    pages, order = [], {name: number for number, name in enumerate(TUTORIALS)}
    for path in sorted((DOCS / "tutorials").rglob("*")):
        place = source / path.relative_to(DOCS)
        if path.suffix == ".md":
            _write(source, path, place)
            pages.append(path)
        elif path.is_file() and "__pycache__" not in path.parts:
            place.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, place)
    pages.sort(key=lambda page: (page.stem not in order, order.get(page.stem, 0), page))
    cards = "".join(_card(page.stem, page.read_text(encoding="utf-8")) for page in pages)
    text = _TUTORIALS + (f"\n::::{{grid}} 1 1 2 2\n:gutter: 3\n{cards}::::\n" if cards else "")
    index = source / "tutorials" / "index.md"
    index.parent.mkdir(parents=True, exist_ok=True)
    index.write_text(text + _toctree([page.stem for page in pages], "hidden"), encoding="utf-8")


def _card(name: str, text: str) -> str:
    """Return the card of a tutorial: a picture of it, its title and its first paragraph."""
    title, first, *_ = (x.strip() for x in text.split("\n\n"))
    pictures = re.findall(r"^!\[([^\]]*)\]\(([^)\s]+)\)", text, re.MULTILINE)
    shown = ""
    if pictures:
        chosen = [x for x in pictures if Path(x[1]).stem == TUTORIALS.get(name)]
        caption, path = [*pictures, *chosen][-1]
        shown = f":img-top: {path}\n:img-alt: {' '.join(caption.split())}\n"
    head = f":::{{grid-item-card}} {title.removeprefix('# ')}\n:link: {name}\n:link-type: doc\n"
    return f"\n{head}{shown}\n{first}\n:::\n"


def _list_notebooks(folder: Path) -> None:
    """Write the page that lists the notebooks."""
    names = sorted(path.stem for path in folder.glob("*.ipynb"))
    (folder / "index.md").write_text(_NOTEBOOKS + _toctree(names), encoding="utf-8")


_NOTEBOOKS = """# Notebooks

`notebooks/` in the repository has these, with the outputs of their last run. Each runs from its
first cell to its last.
"""

_TUTORIALS = """# Tutorials

Each tutorial is a whole job, from the files it begins with to a picture that you can show.
"""


def _toctree(names: list[str], option: str = "titlesonly") -> str:
    if not names:
        return "\nNone is here yet; [first look](../first-look.md) is the place to start.\n"
    return f"\n```{{toctree}}\n:{option}:\n\n" + "\n".join(names) + "\n```\n"


def _write(source: Path, original: Path, place: Path) -> None:
    place.parent.mkdir(parents=True, exist_ok=True)
    text = original.read_text(encoding="utf-8")

    def led(match: re.Match[str]) -> str:
        return _led(match, source, original, place)

    if original.suffix == ".ipynb":
        notebook = json.loads(text)
        for cell in notebook["cells"]:
            if cell["cell_type"] == "markdown":
                cell["source"] = [_LINK.sub(led, "".join(cell["source"]))]
        place.write_text(json.dumps(notebook), encoding="utf-8")
        return
    # Code between fences stays as it is.
    parts = _FENCE.split(text)
    is_code = [part.lstrip().startswith(("```", "~~~")) for part in parts]
    place.write_text(
        "".join(
            part if code else _PERCENT.sub(r"\1\\%", _LINK.sub(led, part))
            for part, code in zip(parts, is_code, strict=True)
        ),
        encoding="utf-8",
    )


def _led(match: re.Match[str], source: Path, original: Path, place: Path) -> str:
    """Return a link as the page at `place` has to have it."""
    mark, text, link = match.groups()
    path, hash_, anchor = link.partition("#")
    if "://" in link or link.startswith("mailto:") or not path:
        return match[0]
    file = (original.parent / path).resolve()
    if file.is_dir():
        return text
    if not file.is_relative_to(ROOT):
        raise ValueError(f"{original.name} links to {link}, which is outside of the repository")
    name = file.relative_to(ROOT).as_posix()
    if name in ROOT_PAGES:
        target = source / ROOT_PAGES[name]
    elif file.is_relative_to(DOCS):
        target = source / file.relative_to(DOCS)
    elif file.suffix == ".ipynb":
        target = source / name
    else:
        target = source / "files" / name
        if not target.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(file, target)
    return f"{mark}[{text}]({Path(relpath(target, place.parent)).as_posix()}{hash_}{anchor})"
