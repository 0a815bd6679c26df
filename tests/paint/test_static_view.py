"""A painter in a saved notebook: its last picture, and a mixer that needs no kernel."""

from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Thread
from typing import Any, ClassVar

import numpy as np
import pytest
from mixer_canvas import mixer_pixels

import lightpaint as lp
from lightpaint.paint.notebook.cell_views import static_view

pytest.importorskip("anywidget", reason="anywidget")

NAUGHTY = "a 'b' </script> & \"c\""

WIDGET = "application/vnd.jupyter.widget-view+json"

#: Characters of all that a cell keeps.
MAX_LENGTH = 400_000


@pytest.fixture
def painter(make_basis: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Of three lights whose images are smooth enough to be told apart."""
    # No kernel runs, nor a loop, as Playwright leaves one.
    monkeypatch.setattr("lightpaint.paint.notebook.cell_views._running_loop", lambda: None)
    y, x = np.mgrid[:54, :96] / 54
    images = [np.exp(-8 * np.hypot(y - 0.5, x - at))[..., None] * [1, 1, 1] for at in (0, 0.9, 1.7)]
    basis = make_basis(images=images, names=(NAUGHTY, "fill", "back"))
    painter = lp.Painter(basis, folder=tmp_path)
    yield painter
    painter.close()


@pytest.mark.nightly
def test_a_saved_painter_is_a_mixer(browser: Any, painter: Any, tmp_path: Path) -> None:
    painter.target = lp.Target.of(0.5 * painter._studio.snapshot().bases[0].images.sum(axis=0))
    data, _ = painter._repr_mimebundle_()
    assert WIDGET in data
    path = tmp_path / "saved.html"
    path.write_text(f'<!doctype html><body style="width: 740px">{data["text/html"]}', "utf-8")
    context = browser.new_context(offline=True, viewport={"width": 800, "height": 900})
    page, errors = context.new_page(), []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(path.as_uri())
    [frame] = page.frames[1:]
    frame.locator(".mixer-mix").wait_for()
    page.locator(".lightpaint-static > img").wait_for(state="hidden")
    assert frame.locator(".mixer-name").all_inner_texts() == [NAUGHTY, "fill", "back"]
    # It begins with the answer, and a slider changes it where its light is.
    basis = painter._studio.snapshot().bases[0]
    expected = basis.mix(painter.lighting.weights_for(basis))
    before = mixer_pixels(frame).astype(float)
    encoded = 255 * lp.ViewTransform().encode(expected)
    assert np.abs(before - np.clip(encoded, 0, 255)).mean() < 1
    frame.locator(".mixer-light").first.locator("input[type=range]").first.evaluate(
        "(input) => { input.value = input.max; input.dispatchEvent(new Event('input')) }"
    )
    change = np.abs(mixer_pixels(frame).astype(float) - before).mean(axis=(0, 2))
    assert change[:10].mean() > 20 > 10 * change[-10:].mean()
    # The frame shows all of the first light below the mix.
    box = page.locator("iframe").bounding_box()
    assert 300 < box["height"] <= 690
    assert errors == []
    context.close()


def test_without_scripts_the_picture_remains(browser: Any, painter: Any, tmp_path: Path) -> None:
    path = tmp_path / "saved.html"
    path.write_text(painter._repr_mimebundle_()[0]["text/html"], "utf-8")
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(path.as_uri())
    picture = page.locator(".lightpaint-static > img")
    assert picture.is_visible()
    assert "showed it last" in picture.get_attribute("alt")
    context.close()


@pytest.mark.parametrize("size", [(360, 640), (128, 128)])
def test_it_is_small_even_of_noise(make_basis: Any, size: tuple[int, int]) -> None:
    basis = make_basis(12, size)
    target = lp.Target.of(basis.current_look)
    page = static_view(basis, lp.Lighting.current(basis), target, lp.ViewTransform())
    assert len(page) < MAX_LENGTH


@pytest.fixture
def outputs(monkeypatch: pytest.MonkeyPatch) -> dict[str, list[Any]]:
    """All data of each output of cells, by its id."""
    by_id: dict[str, list[Any]] = {}

    def display(data: Any, *, display_id: str, **_: Any) -> None:
        by_id.setdefault(display_id, []).append(data)

    monkeypatch.setattr("IPython.display.display", display)
    monkeypatch.setattr("IPython.display.update_display", display)
    return by_id


def relit(painter: Any, level: float) -> lp.Lighting:
    """A lighting whose lights all have one level."""
    basis = painter._studio.snapshot().bases[0]
    return lp.Lighting.of_weights(basis, np.full((3, 3), level))


def test_cells_keep_the_last_picture(outputs: dict[str, list[Any]], painter: Any) -> None:
    """When the painter is closed, nothing remains that needs a kernel."""
    painter._ipython_display_()
    painter.lighting = relit(painter, 0.3)
    painter.close()
    painter.close()
    [(widget, ended), (shown, kept)] = outputs.values()
    assert WIDGET in widget
    assert WIDGET not in shown
    for data in (ended, kept):
        assert set(data) == {"text/plain", "text/html"}
    assert "<iframe" in kept["text/html"] != shown["text/html"]
    assert "<" not in ended["text/html"].removeprefix("<!--")


class Rest:
    """A timer that ends when a test says so."""

    waiting: ClassVar[list["Rest"]] = []

    def __init__(self, _: float, act: Callable[..., None], arguments: list[Any]) -> None:
        self._act, self._arguments = act, arguments
        self.daemon = False

    def start(self) -> None:
        """Wait for the test."""
        assert self.daemon  # else a kernel would wait for it at its end
        self.waiting.append(self)

    def cancel(self) -> None:
        """Wait no longer."""
        if self in self.waiting:
            self.waiting.remove(self)

    def end(self) -> None:
        """Do what waits in a thread of its own, as a timer does."""
        self.cancel()
        thread = Thread(target=self._act, args=self._arguments)
        thread.start()
        thread.join()


def test_a_saved_view_follows_what_is_painted(
    monkeypatch: pytest.MonkeyPatch, outputs: dict[str, list[Any]], painter: Any
) -> None:
    """It does so once the brush rests, and its widget stays as it is."""
    monkeypatch.setattr("lightpaint.paint.notebook.cell_views.Timer", Rest)
    monkeypatch.setattr(Rest, "waiting", [])
    painter.lighting = relit(painter, 0.2)
    assert Rest.waiting == []  # no cell shows it yet
    painter._ipython_display_()
    views = outputs[painter._saved_view]
    for level in (0.3, 0.4, 0.5):
        painter.lighting = relit(painter, level)
    [rest] = Rest.waiting
    rest.end()
    assert [painter._static_view() in view["text/html"] for view in views] == [False, True]
    painter._output.follow()
    [rest] = Rest.waiting
    rest.end()
    assert len(views) == 2  # nothing has changed since
    [widget] = [data for key, data in outputs.items() if key != painter._saved_view]
    assert len(widget) == 1
    painter.lighting = relit(painter, 0.6)
    [rest] = Rest.waiting
    painter.close()
    assert len(views) == 3
    rest.end()
    painter._output.follow()
    assert len(views) == 3
    assert Rest.waiting == []
