"""Build the site: stage its sources, run Sphinx, check the pages.

    pip install '.[docs]'
    ./docs/build            # the site
    ./docs/build --links    # checks links to other sites instead, over the network

Warnings are errors. The site is docs/_build/html; it needs no server and no network.
"""

import json
import re
import shutil
import sys
from pathlib import Path

from sphinx.cmd.build import build_main

DOCS = Path(__file__).resolve().parent.parent
BUILD = DOCS / "_build"

sys.path.insert(0, str(DOCS.parent))
sys.path.insert(0, str(DOCS / "site"))

from api_pages import write_api  # noqa: E402
from command_pages import write_commands  # noqa: E402
from message_pages import write_messages  # noqa: E402
from page_repair import mend_pages  # noqa: E402
from schema_pages import write_schemas  # noqa: E402
from site_check import check_site  # noqa: E402
from staging import stage  # noqa: E402


def main() -> int:
    """Build and check it, or check its links to other sites; return the exit code."""
    arguments = sys.argv[1:]
    if arguments not in ([], ["--links"]):
        print(f"expected nothing or --links, not: {' '.join(arguments)}", file=sys.stderr)
        return 2
    source, html, extra = (BUILD / name for name in ("source", "html", "extra"))
    for folder in (source, html, extra):
        shutil.rmtree(folder, ignore_errors=True)
    stage(source)
    write_commands(source / "commands")
    write_api(source / "api")
    write_schemas(source / "schemas", extra / "schemas")
    write_messages(source / "messages")
    if arguments:
        _stage_readme(source)
        return check_links(source, BUILD / "links")
    return _build(source, html)


def _build(source: Path, html: Path) -> int:
    """Build the pages and check them."""
    if code := _sphinx("html", source, html, BUILD / "doctrees"):
        return code
    mend_pages(html)
    if problems := check_site(html):
        print(*problems, sep="\n", file=sys.stderr)
        return 1
    megabytes = sum(file.stat().st_size for file in html.rglob("*") if file.is_file()) / 1e6
    pages = len(list(html.rglob("*.html")))
    print(f"{html / 'index.html'}: {pages} pages, {megabytes:.1f} MB, no dead link")
    return 0


def check_links(source: Path, results: Path) -> int:
    """Ask for each address of another site in the pages of `source`; return the exit code.

    Sphinx prints dead links, and lists all of them in `output.json` of the folder `results`.
    """
    shutil.rmtree(results, ignore_errors=True)
    (BUILD / "extra").mkdir(parents=True, exist_ok=True)  # schemas, to which no link is asked for
    code = _sphinx("linkcheck", source, results, results / "doctrees")
    if code == 0:
        lines = (results / "output.json").read_text(encoding="utf-8").splitlines()
        links = map(json.loads, lines)
        answered = {x["uri"] for x in links if x["status"] in ("working", "redirected")}
        print(f"{len(answered)} links to other sites, none of them dead")
    return code


def _stage_readme(source: Path) -> None:
    """Write a page with the links of the README, which is not a page of the site."""
    text = (DOCS.parent / "README.md").read_text(encoding="utf-8")
    links = re.findall(r"\]\((https?://[^)\s]+)\)", text)
    lines = ["---", "orphan: true", "---", "# README", "", *(f"- <{link}>" for link in links)]
    (source / "readme.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _sphinx(builder: str, source: Path, output: Path, doctrees: Path) -> int:
    """Run one of Sphinx's builders; warnings are errors. Return its exit code."""
    options = ["-W", "--keep-going", "-q", "-E", "-b", builder]
    return build_main([*options, "-c", str(DOCS), "-d", str(doctrees), str(source), str(output)])


if __name__ == "__main__":
    sys.exit(main())
