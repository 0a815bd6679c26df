"""Searches for places on the page: their time before they start, two ways to stop, the trace."""

from typing import Any

import pytest
from axe import violations
from painter_page import Painter

#: Answers of the session to what only a real one has.
SESSION = """() => {
  host.estimate_place = () => ({ kind: 'place_estimate', is_measured: host.isMeasured ?? false,
    text: 'key: slide by up to 0.6.', seconds: [48, 130] });
  host.place = ({ run }) => ({ kind: 'started', task: run ? 'place' : 'stop' });
  host.show_rig = () => ({ kind: 'started', task: 'rig' });
  const steps = host.list_steps.bind(host);
  host.list_steps = (fields) => ({ ...steps(fields), searches: host.searches ?? [] });
}"""


#: Sends the places of lights.
RIG = """() => host.tell({ kind: 'rig', up: 1, low: [0, 0, 0], high: [9, 5, 8], surfaces: [],
  skies: [], objects: [], cameras: [{ origin: [5, 2, 12], x_axis: [.04, 0, 0],
    y_axis: [0, -.07, 0], forward: [-1, 1, -1], is_parallel: false }],
  lights: host.room.lights.map((_, k) => ({ position: [1 + k, 4, 4], direction: null,
    target: null, cutoff: null, beam: null, rail: null, immovable_reason: '' })) })"""


@pytest.fixture
def painter(new_painter: Any, axe: str) -> Painter:
    opened: Painter = new_painter(axe=axe)
    opened.page.evaluate(SESSION)
    opened.stroke()
    lights = opened.page.evaluate("() => host.exact().lights")
    advice = {"kind": "reach", "names": [], "gain": None, "hold": None}
    answer = {"version": 900, "exact": True, "lights": lights, "delta_e": 9.0, "sentences": []}
    opened.tell(kind="answer", headline="Far.", help=advice, **answer)
    return opened


@pytest.mark.nightly
def test_it_says_how_long_it_takes_before_it_starts(painter: Painter) -> None:
    dialog = painter.page.get_by_role("dialog")
    painter.button("Let lights move").click()
    dialog.get_by_text("About 50 s to 2 min.").wait_for()
    assert "key: slide by up to 0.6." in dialog.inner_text()
    assert not painter.requests("place")
    assert violations(painter.page) == []
    dialog.get_by_role("button", name="Cancel").click()
    assert dialog.count() == 0
    painter.page.evaluate("() => { host.isMeasured = true; }")
    painter.button("Let lights move").click()
    dialog.get_by_text("as an earlier search here").wait_for()
    dialog.get_by_role("button", name="Begin").click()
    assert [request["run"] for request in painter.requests("place")] == [True]
    painter.page.evaluate("() => painter.store.set({ placementProgress: null })")
    painter.page.evaluate(
        "() => { host.estimate_place = () => ({ kind: 'failed', text: 'no light is free' }); }"
    )
    painter.button("Let lights move").click()
    painter.page.get_by_text("no light is free").wait_for()
    assert dialog.count() == 0


@pytest.mark.nightly
def test_where_a_light_of_its_own_is_missing_its_fields_come_into_view(painter: Painter) -> None:
    lights = painter.page.evaluate("() => host.exact().lights")
    advice = {"kind": "light", "names": [], "gain": None, "hold": None}
    answer = {"version": 901, "exact": True, "lights": lights, "delta_e": 9.0, "sentences": []}
    painter.tell(kind="answer", headline="No light reaches it alone.", help=advice, **answer)
    assert painter.page.get_by_role("button", name="Let lights move").count() == 0
    painter.page.locator(".answer").get_by_role("button", name="Add a light").click()
    painter.page.evaluate(RIG)
    fields = painter.page.locator(".add-light")
    fields.wait_for()
    assert painter.ui("newLight")["surface"] == "anywhere"
    fields.get_by_role("button", name="Find places").wait_for()
    painter.page.wait_for_function("() => painter.store.value.isNewLightSought === false")
    box, side = fields.bounding_box(), painter.page.locator(".side").bounding_box()
    assert box["y"] + box["height"] <= side["y"] + side["height"] + 1


def test_it_stops_with_the_best_so_far_or_with_nothing(painter: Painter) -> None:
    chip = painter.page.locator(".working", has_text="places")
    painter.page.evaluate("() => void painter.session.placeLights()")
    painter.button("Stop with the best so far").click()
    request = painter.requests("place")[-1]
    assert request == {"kind": "place", "run": False, "keeps_best": True}
    assert "Checking the best so far" in chip.inner_text()
    assert painter.page.get_by_role("button", name="Stop with the best so far").count() == 0
    painter.button("Stop, move nothing").click()
    assert painter.requests("place")[-1] == {"kind": "place", "run": False}
    painter.tell(kind="placed", text="Stopped: every light stays where it was.", names=[])
    assert chip.count() == 0


@pytest.mark.nightly
def test_a_search_leaves_its_trace_beside_the_steps(painter: Painter) -> None:
    painter.button("History").click()
    search = {
        "id": 1,
        "after": 1,
        "title": "let lights move",
        "text": "Nothing better within these freedoms.",
        "tried": ["key, fill: slide by up to 0.6.", "sun: turn by up to 60°."],
        "stamp": 1.7e9,
        "seconds": 94.0,
    }
    painter.page.evaluate("(search) => { host.searches = [search]; }", search)
    painter.tell(kind="placed", text="Nothing better within these freedoms.", names=[])
    rows = painter.page.locator(".steps > li")
    note = painter.page.locator(".search-note")
    note.wait_for()
    assert rows.nth(0).inner_text().startswith("Let lights move")  # above the step that it followed
    assert "Nothing better" in note.inner_text()
    count = len(painter.requests("go_to_step"))
    note.get_by_role("button").click()
    assert "Took 2 min" in note.inner_text()
    assert "sun: turn by up to 60°." in note.inner_text()
    assert len(painter.requests("go_to_step")) == count
    assert violations(painter.page, ".steps") == []
