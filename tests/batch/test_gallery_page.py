"""The gallery in a browser: failures first, filter, order, two looks under a border, the table."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from batches import NAMES, run_all, write_batch

from lightpaint.batch.gallery import gallery_page
from lightpaint.batch.summary import LightRow, Row


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """The system's Chromium, or the one that Playwright has installed."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright")
    with playwright.sync_playwright() as started:
        names = ("chromium", "chromium-browser", "google-chrome")
        path = next(filter(None, map(shutil.which, names)), started.chromium.executable_path)
        if not Path(path).exists():
            pytest.skip("a browser (chromium)")
        opened = started.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield opened
        opened.close()


@pytest.fixture
def page(browser: Any) -> Iterator[Any]:
    """A page that may load nothing from a network and complain of nothing."""
    made, said = browser.new_page(viewport={"width": 1100, "height": 800}), []
    made.on("console", lambda message: said.append(message.text))
    made.on("pageerror", lambda error: said.append(str(error)))
    made.route("http*://**", lambda route: said.append(route.request.url) or route.abort())
    yield made
    made.close()
    assert said == []


def _names(page: Any) -> list[str]:
    return list(page.locator("#cards .name").all_text_contents())


def test_two_looks_under_a_border(page: Any, tmp_path: Path) -> None:
    run_all(str(write_batch(tmp_path)), str(tmp_path / "out"))
    page.goto((tmp_path / "out" / "index.html").as_uri())
    assert _names(page) == NAMES
    assert page.locator("#wipe").is_hidden()
    page.get_by_label("p0 as A", exact=True).click()
    page.get_by_label("dusk-1 as B", exact=True).click()
    assert page.locator("#wipe").is_visible()
    assert page.locator(".stage span").all_text_contents() == ["p0", "dusk-1"]
    shown = page.locator(".stage img").evaluate_all("all => all.map((x) => x.naturalWidth)")
    assert min(shown) > 0
    page.locator("#slide").fill("25")
    assert page.locator(".stage").evaluate("x => x.style.getPropertyValue('--p')") == "25%"
    page.get_by_label("p1 as A", exact=True).click()
    assert page.locator("[data-side=a][aria-pressed=true]").count() == 1
    # Links lead to what is there, and the table has a row for each look.
    links = page.locator("#cards a").evaluate_all("all => all.map((x) => x.href)")
    assert all(Path(link.removeprefix("file://")).is_file() for link in links)
    assert page.locator("#lights tbody tr").count() == len(NAMES)
    assert page.locator("#lights thead th").all_text_contents()[1:] == [
        "lamp 0",
        "lamp 1",
        "lamp 2",
    ]


def test_a_thousand_looks_are_filtered_and_ordered(page: Any, tmp_path: Path) -> None:
    lights = (LightRow("<b>key", 0.0), LightRow("fill", 2.5, "#ff8800", stops=-1.25))
    rows = [Row("broken", "failed", "no such file: <i>x</i>", "broken")]
    rows += [
        Row(f"look {k}", "done", "", f"look {k}", delta_e=k % 17 / 2, lights=lights)
        for k in range(1000)
    ]
    (tmp_path / "index.html").write_text(gallery_page(tmp_path, "many", rows), encoding="utf-8")
    page.goto((tmp_path / "index.html").as_uri())
    assert page.locator("#count").text_content() == "1001 of 1001"
    assert _names(page)[0] == "broken"
    assert page.locator(".why").text_content() == "no such file: <i>x</i>"
    page.locator("#filter").fill("LOOK 99")
    assert len(_names(page)) == 19  # with both words, in any place
    page.locator("#filter").fill("")
    page.locator("#order").select_option("delta_e")
    assert _names(page)[0] == "look 16"
    page.locator("#state").select_option("failed")
    assert _names(page) == ["broken"]
    cells = page.locator("#lights tbody tr").first.locator("td").all_text_contents()
    assert cells == ["off", "2.5 (−1.3)"]
