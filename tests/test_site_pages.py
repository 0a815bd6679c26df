"""Pages of the built site in a browser: for everybody, at two widths, without a network."""

from pathlib import Path
from typing import Any

import pytest
from axe import axe_source, violations
from nightly import nightly
from renderer import REPOSITORY

SITE = REPOSITORY / "docs" / "_build" / "html"
PAGES = ("index", "first-look", "commands/solve", "api/relighting", "tutorials/index")


@pytest.fixture
def site() -> Path:
    if not (SITE / "index.html").exists():
        pytest.skip("the site (docs/build)")
    return SITE


@pytest.mark.parametrize(
    ("width", "names"), [(400, PAGES[:2]), nightly(400, PAGES[2:]), nightly(1440, PAGES)]
)
def test_pages_are_for_everybody_and_fit(
    site: Path, browser: Any, width: int, names: tuple[str, ...]
) -> None:
    source, foreign_requests = axe_source(), []
    page = browser.new_page(viewport={"width": width, "height": 900})
    page.on(
        "request",
        lambda x: x.url.startswith(("file:", "data:")) or foreign_requests.append(x.url),
    )
    for name in names:
        page.goto((site / f"{name}.html").as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") <= width, name
        page.evaluate(source)
        assert violations(page) == [], name
    assert foreign_requests == []
    page.close()


def test_the_search_works_without_a_server(site: Path, browser: Any) -> None:
    page = browser.new_page()
    page.goto(f"{(site / 'search.html').as_uri()}?q=kelvin")
    # Results are listed one after the other.
    page.wait_for_selector("#search-results li a[href*='lights.html']")
    page.close()
