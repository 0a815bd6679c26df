"""Progress of stages, the time that is left, and work that ends when it is cancelled."""

import signal
import threading
import time
from types import SimpleNamespace
from typing import Any

import pytest
from patience import PATIENCE_S

from lightpaint import progress
from lightpaint.cli.output import terminal
from lightpaint.cli.output.lines import OutputMode, using_output_mode
from lightpaint.cli.output.terminal import TerminalListener
from lightpaint.pipeline.job_bases import _RenderWatch
from lightpaint.progress import (
    Pace,
    announce,
    cancellable,
    spoken_duration,
    stage,
    with_progress,
)
from lightpaint.sentences import Hint, Sentence
from lightpaint.threads import (
    CHECK_S,
    end_background_work,
    parallel_map,
    run_apart,
    start_in_background,
)


class Reports:
    """A listener that keeps what it is told."""

    def __init__(self) -> None:
        self.counts: list[tuple[str, int, int, str]] = []
        self.remarks: list[str] = []

    def __call__(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        self.counts.append((label, done, total, unit))

    def say(self, text: str) -> None:
        self.remarks.append(text)

    note = at_work = lambda *_: None


@pytest.fixture
def reports(monkeypatch: pytest.MonkeyPatch) -> Reports:
    """A listener of stages that report from their first step on."""
    monkeypatch.setattr(progress, "QUIET_S", 0)
    return Reports()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """A clock that the test sets. A second is long for a stage."""
    monkeypatch.setattr(progress, "QUIET_S", 1.0)
    hands = SimpleNamespace(now_s=0.0)
    monkeypatch.setattr(time, "monotonic", lambda: hands.now_s)
    return hands


class StoppedError(Exception):
    """The end of cancelled work."""


def stop() -> None:
    raise StoppedError


def test_the_first_loop_of_a_stage_is_reported_and_those_within_it_are_not(reports: Reports):
    with stage("solving", reports):
        for _ in with_progress("ab", "rows"):
            list(with_progress(range(5)))
        list(with_progress(range(2)))
        with stage("error bars"):
            parallel_map(str, range(2), unit="parts")
            parallel_map(str, range(9))
    list(with_progress(range(3)))
    assert reports.counts == [
        ("solving", 1, 2, "rows"),
        ("solving", 2, 2, "rows"),
        ("solving", 1, 2, "blocks"),
        ("solving", 2, 2, "blocks"),
        ("error bars", 1, 2, "parts"),
        ("error bars", 2, 2, "parts"),
    ]
    assert reports.remarks == []


def test_stages_side_by_side_speak_one_after_the_other(reports: Reports):
    speaking = threading.Lock()

    def listen(label: str, done: int, total: int, unit: str = "passes") -> None:
        assert speaking.acquire(blocking=False)
        time.sleep(0.001)
        reports(label, done, total, unit)
        speaking.release()

    def work(label: str) -> None:
        with stage(label):
            list(with_progress(range(10)))

    with stage("analysis", listen):
        parallel_map(work, ["a", "b", "c"])
    for label in "abc":
        assert [done for name, done, _, _ in reports.counts if name == label] == [*range(1, 11)]


def test_a_stage_of_less_than_a_second_says_nothing(clock: SimpleNamespace):
    reports = Reports()
    with stage("solving", reports):
        for _ in with_progress(range(4)):
            clock.now_s += 0.3
    assert [done for _, done, _, _ in reports.counts] == [4]


def test_a_stage_of_more_than_a_minute_says_so_first_and_what_skips_it(clock: SimpleNamespace):
    """At a twentieth of its steps, once, from how long those took."""
    reports = Reports()
    advice = Sentence(" (", Hint("report", False), " skips it)")
    with stage("report", reports, advice):
        for k in with_progress(range(100)):
            assert len(reports.remarks) == (k > 4)
            clock.now_s += 2
    assert reports.remarks == ["report takes 4 min or more (report=False skips it)"]
    assert isinstance(reports.remarks[0], Sentence)
    reports = Reports()
    with stage("report", reports, advice):
        for _ in with_progress(range(100)):
            clock.now_s += 0.5
    assert reports.remarks == []


def test_a_render_of_more_than_a_minute_says_so_first_and_what_shortens_it(clock: SimpleNamespace):
    reports = Reports()
    watch = _RenderWatch(reports, has_moved=False, names_cache=True)
    for done in range(21):
        watch.report("basis", done, 20)
        assert len(reports.remarks) == (done >= 1)
        clock.now_s += 9
    [remark] = reports.remarks
    assert remark.startswith("rendering takes 3 min or more: fewer samples or pixels take less")
    assert "spp=..." in remark
    assert len(reports.counts) == 21
    watch = _RenderWatch(reports, has_moved=False, names_cache=False)
    for done in range(21):  # of a budget of seconds
        watch.report("basis", 10 * done, 200, "seconds")
        clock.now_s += 10
    assert reports.remarks == [remark]


def test_the_time_left_follows_from_the_steps_that_were_counted(clock: SimpleNamespace):
    pace = Pace(first=10)
    clock.now_s += 6
    assert pace.left_s(10, 40) is None
    assert pace.left_s(12, 40) == 6 / 2 * 28
    assert pace.left_s(40, 40) == 0


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.2, "1 s"), (119, "119 s"), (121, "3 min"), (7199, "120 min"), (7201, "3 h")],
)
def test_durations_in_words(seconds: float, text: str):
    assert spoken_duration(seconds) == text


def test_a_log_says_now_and_then_how_much_is_left(
    clock: SimpleNamespace, capfd: pytest.CaptureFixture[str]
):
    listen = TerminalListener()
    listen("basis", 0, 40)
    for done in range(1, 41):
        clock.now_s += 3
        listen("basis", done, 40)
    with stage("report", listen):  # heard of after a second, with the pace since it began
        for _ in with_progress(range(20), "planes"):
            clock.now_s += 0.4
    lines = capfd.readouterr().err.splitlines()
    assert lines[:3] == [
        "basis: 40 passes",
        "basis: 4 of 40 passes, 108 s left",
        "basis: 8 of 40 passes, 96 s left",
    ]
    assert lines[-1] == "report: 3 of 20 planes, 7 s left"
    assert len(lines) == 11
    with using_output_mode(OutputMode(json_progress=True)):
        listen("basis", 1, 3)
        clock.now_s += 4
        listen("basis", 2, 3)
    first, second = capfd.readouterr().err.splitlines()
    assert first.endswith('"left_s": null}')
    assert second.endswith('"left_s": 4.0}')


def test_the_bars_of_a_terminal_count_down(clock: SimpleNamespace):
    column = terminal._TimeLeft()
    fields: dict[str, Any] = {"end_s": 90.0}
    task: Any = SimpleNamespace(fields=fields, finished=False)
    assert column.render(task).plain == "90 s left"
    clock.now_s += 60.5
    assert column.render(task).plain == "30 s left"
    assert column.render(SimpleNamespace(fields={}, finished=False)).plain == ""  # type: ignore[arg-type]


def test_loops_end_before_the_next_step_when_they_are_cancelled():
    steps: list[int] = []
    with pytest.raises(StoppedError), cancellable(lambda: stop() if len(steps) == 3 else None):
        steps.extend(with_progress(range(10)))
    assert steps == [0, 1, 2]


def press_ctrl_c() -> None:
    """Interrupt the main thread, also where it waits."""
    ident = threading.main_thread().ident
    assert ident is not None
    signal.pthread_kill(ident, signal.SIGINT)


#: Steps of a millisecond: as long as tests wait.
ENDLESS = range(int(1000 * PATIENCE_S))


def test_an_interrupt_cancels_jobs_of_other_threads_that_have_begun():
    begun, ended, reached = threading.Event(), threading.Event(), list[int]()

    def work(is_long: bool) -> None:
        if not is_long:
            begun.wait(PATIENCE_S)
            threading.Timer(0.1, press_ctrl_c).start()
            return
        try:
            for k in with_progress(ENDLESS):
                reached[:] = [k]
                begun.set()
                time.sleep(0.001)
        finally:
            ended.set()

    # Whichever thread has the long job: it ends, and is waited for.
    with pytest.raises(KeyboardInterrupt):
        parallel_map(work, (False, True))
    assert ended.is_set()
    assert reached[0] < ENDLESS[-1]


def test_a_call_that_runs_apart_is_left_to_itself():
    assert run_apart(divmod, 7, 4) == (1, 3)
    with pytest.raises(ZeroDivisionError):
        run_apart(divmod, 1, 0)
    may_end = threading.Event()
    try:
        with pytest.raises(StoppedError), cancellable(stop):
            run_apart(may_end.wait, PATIENCE_S)
        threading.Timer(0.1, press_ctrl_c).start()
        with pytest.raises(KeyboardInterrupt):
            run_apart(may_end.wait, PATIENCE_S)
        assert not may_end.is_set()
    finally:
        may_end.set()


def test_work_in_the_background_ends_with_the_command():
    begun, ended = threading.Event(), threading.Event()

    def work() -> None:
        try:
            for _ in with_progress(ENDLESS):
                begun.set()
                time.sleep(0.001)
        finally:
            ended.set()

    start_in_background(work, name="test")
    assert begun.wait(PATIENCE_S)
    end_background_work()
    assert ended.wait(PATIENCE_S / 2)


def test_a_stage_that_knows_its_time_says_so_before_its_first_step(clock: SimpleNamespace):
    """Once, in place of the remark that follows from its steps, and with an advice of its own."""
    reports = Reports()
    announce(90)  # outside a stage nobody listens
    with stage("analysis", reports, Sentence(": fewer pixels")):
        announce(59)
        assert reports.remarks == []
        announce(600, Sentence(" (", Hint("error_bars", False), " skips it)"))
        for _ in with_progress(range(100)):
            clock.now_s += 6
    assert reports.remarks == ["analysis takes 10 min or more (error_bars=False skips it)"]


def test_a_stage_is_shown_while_a_call_counts_no_steps(reports: Reports):
    """As LAPACK, for which a step takes long: once for each step, and no other time."""

    def wait_apart() -> None:
        run_apart(time.sleep, 4 * CHECK_S)

    with stage("comparison", reports):
        wait_apart()
        wait_apart()
    assert reports.counts == [("comparison", 0, 1, "steps")]
    reports.counts.clear()
    with stage("similar lights", reports):
        for _ in with_progress(range(2), "channels"):
            wait_apart()
        wait_apart()  # no step goes back
    channels = [("similar lights", k, 2, "channels") for k in range(3)]
    assert reports.counts == channels
    run_apart(time.sleep, 2 * CHECK_S)  # outside a stage nobody listens
