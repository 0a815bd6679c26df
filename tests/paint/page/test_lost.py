"""What a painter's page says when something fails, is refused, or is elsewhere."""

from typing import Any

import pytest
from painter_page import Painter


@pytest.mark.nightly
def test_a_tab_that_comes_second_says_where_the_painter_is(new_painter: Any) -> None:
    painter = new_painter("elsewhere", until=".lightpaint .banner")
    notice = painter.page.get_by_role("alert")
    assert "the painter is open in another tab" in notice.inner_text().lower()
    assert painter.page.get_by_role("progressbar").count() == 0
    assert painter.page.get_by_text("Opening the scene").count() == 0
    box, view = notice.bounding_box(), painter.page.locator(".view").bounding_box()
    assert abs(box["x"] + box["width"] / 2 - view["x"] - view["width"] / 2) < 2
    notice.get_by_role("button", name="Take over").click()
    painter.page.locator(".lightpaint .tag").first.wait_for()
    assert painter.requests("take_over")
    assert notice.count() == 0


def test_what_fails_is_said_and_the_painter_lives(painter: Painter) -> None:
    painter.page.evaluate("() => { window.host.fails = 'the disk is full'; }")
    painter.button("Save look").click()
    painter.page.get_by_text("the disk is full").wait_for()
    painter.button("Dismiss").click()
    assert not painter.page.get_by_text("the disk is full").is_visible()
    painter.button("Save look").click()
    assert len(painter.requests("save_look")) == 2


def test_a_session_that_is_lost_or_taken(painter: Painter) -> None:
    painter.tell(kind="connection", state="lost")
    assert painter.page.get_by_role("alert").get_by_text("connection is lost").is_visible()
    painter.tell(kind="connection", state="open")
    assert not painter.page.get_by_role("alert").is_visible()
    painter.tell(kind="closed", reason="taken", text="It is open on another page.")
    painter.stroke()
    assert not painter.calls("begin")  # who does not have it does not paint on it
    painter.button("Take over").click()
    assert painter.requests("take_over")
    assert not painter.page.get_by_role("alert").is_visible()


#: Small pictures that are shown, but for those of answers to choose from, and how many are there.
THUMBS = (
    "() => { const all = [...document.querySelectorAll('.lightpaint .thumb')]"
    ".filter((one) => !one.closest('.answer-choice'));"
    " return [all.length, all.filter((one) => one.width > 1).length]; }"
)


@pytest.mark.nightly
def test_a_place_that_has_lost_the_painter_gets_its_pictures_when_it_has_it_again(
    new_painter: Any,
) -> None:
    """In a notebook it asks for them over the same line by which it is told of its loss."""
    painter = new_painter("model=taken&engine")
    take_over = painter.button("Take over")
    take_over.wait_for()
    painter.page.wait_for_timeout(100)
    assert painter.page.evaluate(THUMBS) == [7, 0]
    assert painter.ui("toasts") == []
    take_over.click()
    painter.page.wait_for_function(f"() => ({THUMBS})()[1] === 7")
    painter.page.wait_for_function(
        "() => engine.mirror.isReady && !engine.mirror.loader.missingSlots().length"
    )
    painter.stroke()
    assert painter.requests("paint")


def fail_next_request(painter: Painter) -> None:
    """Have what is said next fail, and not what is on its way."""
    painter.still()
    painter.page.evaluate("() => { host.fails = 'That cannot be done.'; }")


@pytest.mark.nightly
def test_what_is_refused_is_shown_no_longer(painter: Painter) -> None:
    """Nor does it go along with what is asked next."""
    painter.page.get_by_role("button", name="key", exact=True).click()
    painter.type("Min", "20")
    before = {name: painter.ui(name) for name in ("constraints", "ties", "settings", "weights")}
    at_most = painter.page.get_by_role("textbox", name="Max")
    fail_next_request(painter)
    painter.type("Max", "1e308")
    painter.still()
    assert at_most.input_value() == ""
    painter.choose("Colour", "kelvin")
    constraints = {"limits": {"min": "20%"}, "kelvin": [2700, 6500]}
    assert painter.requests("constrain_light")[-1]["constraints"] == constraints
    fail_next_request(painter)
    painter.choose("Colour", "any")
    painter.still()
    assert painter.ui("constraints") == {"key": constraints}
    before["constraints"] = painter.ui("constraints")
    for act in (
        lambda: painter.choose("Tie to", "cove"),
        lambda: painter.page.evaluate("() => void painter.session.changeSetting('sparse', 99)"),
        lambda: painter.page.evaluate("() => painter.session.lockLight(2, [9, 9, 9], true)"),
    ):
        fail_next_request(painter)
        act()
        painter.still()
        assert {name: painter.ui(name) for name in before} == before


@pytest.mark.nightly
def test_what_is_refused_leaves_what_is_on_its_way(painter: Painter) -> None:
    painter.page.evaluate(
        """() => {
          const { session } = painter;
          host.fails = 'That cannot be done.';
          session.constrainLight(0, { limits: { max: '1e308%' } });
          session.constrainLight(1, { off: true });
        }"""
    )
    painter.still()
    assert painter.ui("constraints") == {"window left": {"off": True}}


def alert_text(painter: Painter) -> str:
    """What has to be known now, or nothing."""
    return " ".join(painter.page.get_by_role("alert").all_inner_texts())


@pytest.mark.nightly
def test_a_kernel_that_does_not_answer_is_said_to_until_it_does(new_painter: Any) -> None:
    painter = new_painter("model", is_fresh=True)
    painter.page.clock.install(time=0)
    painter.page.clock.pause_at(60_000)  # else it goes on, as long as this test takes
    painter.page.evaluate("() => { model.isBusy = true; }")
    painter.stroke()
    painter.page.clock.run_for(9_000)
    assert alert_text(painter) == ""
    painter.page.clock.run_for(1_100)
    assert "has not answered for 10 s" in alert_text(painter)
    painter.page.clock.resume()
    painter.page.evaluate("() => { model.isBusy = false; void model.work(); }")
    painter.page.wait_for_function("() => !document.querySelector('[role=alert]')")
    assert painter.requests("paint")[-1]["is_final"] is True
    assert alert_text(painter) == ""
    painter.page.clock.fast_forward(60_000)  # nothing is waited for
    assert alert_text(painter) == ""
    # Nor is what was lost on its way.
    painter.page.evaluate(
        """() => {
          model.isBusy = true;
          painter.session.host.fetch('thumb/0');
          model.waiting.length = 0;
          model.isBusy = false;
          return painter.session.host.fetch('thumb/0').then(() => {});
        }"""
    )
    painter.page.clock.fast_forward(60_000)
    assert alert_text(painter) == ""


@pytest.mark.nightly
@pytest.mark.parametrize("model", ["model", "model=taken"])
def test_a_kernel_that_has_ended_is_said_to_have(new_painter: Any, model: str) -> None:
    """Nothing is painted for nobody, and nobody is there to take it over from."""
    painter = new_painter(model)
    assert painter.page.get_by_role("button", name="Take over").count() == (model != "model")
    painter.page.evaluate("() => model.trigger('comm_live_update')")
    painter.still()
    assert "The kernel has ended. Run the cell again" in alert_text(painter)
    assert painter.page.get_by_role("button", name="Take over").count() == 0
    painter.stroke()
    assert not painter.calls("begin")


def running_tasks(painter: Painter) -> set[str]:
    """What is shown to be: writing files, rendering, finding out why it is not closer."""
    ui = painter.page.evaluate("() => painter.store.value")
    flags = {
        "export": ui["isExporting"],
        "verify": ui["verificationProgress"],
        "explain": ui["isExplaining"],
    }
    return {name for name, is_so in flags.items() if is_so}


def ask_for_all(painter: Painter) -> None:
    """Ask for everything that takes long."""
    painter.page.evaluate(
        "() => { const { session, store } = painter; store.set({ isExporting: true });"
        " session.send('export', { outputs: [] }); session.verify(); session.explain(); }"
    )
    painter.still()


LOST = "Promise.reject(new Error('there is no connection to the painter'))"


@pytest.mark.nightly
def test_what_could_not_be_asked_for_is_not_under_way(painter: Painter) -> None:
    painter.page.evaluate(f"() => {{ host.send = () => {LOST}; }}")
    ask_for_all(painter)
    assert running_tasks(painter) == set()
    painter.button("Export").click()
    painter.page.get_by_role("dialog").get_by_role("button", name="Export", exact=True).click()
    assert (
        painter.page.get_by_role("dialog")
        .get_by_role("button", name="Export", exact=True)
        .is_enabled()
    )
    painter.page.keyboard.press("Escape")
    painter.button("Analysis").click()
    painter.button("Out of reach").click()  # asks for what it shows, and once
    painter.page.wait_for_function("() => painter.store.value.display.overlay === null")


@pytest.mark.nightly
def test_what_fails_is_under_way_no_more_and_the_rest_is(painter: Painter) -> None:
    painter.page.evaluate("() => { host.send = () => new Promise(() => {}); }")
    ask_for_all(painter)
    assert running_tasks(painter) == {"export", "verify", "explain"}
    painter.tell(kind="notice", text="The scene does not load.", tone="warn")
    painter.tell(kind="failed", text="A stroke is too large.")
    assert running_tasks(painter) == {"export", "verify", "explain"}
    for task in ("verify", "explain", "export"):
        assert task in running_tasks(painter)
        painter.tell(kind="notice", text="It does not render.", tone="warn", task=task)
        assert task not in running_tasks(painter)


@pytest.mark.nightly
def test_what_ended_while_the_connection_was_lost_is_not_waited_for(painter: Painter) -> None:
    painter.page.evaluate("() => { host.send = () => new Promise(() => {}); }")
    ask_for_all(painter)
    painter.page.evaluate("() => host.tell(host.state())")  # another round of samples is there
    assert running_tasks(painter) == {"export", "verify", "explain"}
    painter.tell(kind="connection", state="lost")
    painter.page.evaluate("() => host.tell(host.state())")
    assert running_tasks(painter) == set()
    painter.tell(kind="progress", task="verification", done=5, total=16, unit="passes")
    assert running_tasks(painter) == {"verify"}  # which still goes on
    painter.tell(kind="closed", reason="taken", text="It is open on another page.")
    painter.page.evaluate("() => host.tell(host.state())")
    assert running_tasks(painter) == set()
