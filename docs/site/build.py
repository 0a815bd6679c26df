"""Build the site: stage its sources, run Sphinx, check the pages.

    pip install '.[docs]'
    ./docs/build

Warnings are errors. The site is docs/_build/html; it needs no server and no network.
"""

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
from page_repair import mend_pages  # noqa: E402
from schema_pages import write_schemas  # noqa: E402
from site_check import check_site  # noqa: E402
from staging import stage  # noqa: E402


def main() -> int:
    """Build and check it; return the exit code."""
    source, html, extra = (BUILD / name for name in ("source", "html", "extra"))
    for folder in (source, html, extra):
        shutil.rmtree(folder, ignore_errors=True)
    stage(source)
    write_commands(source / "commands")
    write_api(source / "api")
    write_schemas(source / "schemas", extra / "schemas")
    options = ["-W", "--keep-going", "-q", "-E", "-b", "html"]
    places = ["-c", str(DOCS), "-d", str(BUILD / "doctrees"), str(source), str(html)]
    if code := build_main([*options, *places]):
        return code
    mend_pages(html)
    if problems := check_site(html):
        print(*problems, sep="\n", file=sys.stderr)
        return 1
    megabytes = sum(file.stat().st_size for file in html.rglob("*") if file.is_file()) / 1e6
    pages = len(list(html.rglob("*.html")))
    print(f"{html / 'index.html'}: {pages} pages, {megabytes:.1f} MB, no dead link")
    return 0


if __name__ == "__main__":
    sys.exit(main())
