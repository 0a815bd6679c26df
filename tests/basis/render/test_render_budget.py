"""When a basis is kept while it is rendered, and when its render stops."""

import time
from typing import Any

import pytest

from lightpaint.basis.render.render_budget import KEEP_EVERY_S, Budget, Keeper, steps


def test_a_busy_machine_keeps_no_more_often(monkeypatch: pytest.MonkeyPatch):
    """Where others have the processor, 30 s on the clock are little work that a crash may cost."""
    now_s = {"clock": 0.0, "processor": 0.0}
    saves: list[Any] = []
    monkeypatch.setattr(time, "monotonic", lambda: now_s["clock"])
    monkeypatch.setattr(time, "process_time", lambda: now_s["processor"])

    def keep(basis: Any) -> bool:
        saves.append(basis)
        return True

    keeper = Keeper(keep)
    now_s.update(clock=10 * KEEP_EVERY_S, processor=KEEP_EVERY_S / 2)
    keeper.now_and_then(lambda: "busy")
    # Many processors work much in few seconds on the clock.
    now_s.update(clock=KEEP_EVERY_S / 2, processor=10 * KEEP_EVERY_S)
    keeper.now_and_then(lambda: "many processors")
    assert saves == []
    now_s.update(clock=1.1 * KEEP_EVERY_S)
    keeper.now_and_then(lambda: "due")
    assert saves == ["due"]


@pytest.mark.parametrize("time_s", [None, 1e6])
@pytest.mark.parametrize(
    ("goal", "clean_at", "expected"),
    [
        (64, 0, [8]),  # a quarter of both halves
        (64, 9, [8, 4]),
        (64, 31, [8, 4, 4, 4, 4, 4, 4]),  # the goal itself
        (64, 99, [8, 4, 4, 4, 4, 4, 4]),
        (16, 0, [4]),  # eight samples in both halves
        (7, 0, [4]),  # half of it, rounded up
    ],
)
def test_a_render_stops_as_soon_as_it_is_clean(
    time_s: float | None, goal: int, clean_at: int, expected: list[int]
):
    limits = {"spp": goal} if time_s is None else {"spp": 2, "time_s": time_s, "until_spp": goal}
    budget, done, calls = Budget(**limits, until_variance=0.01), [0], []

    def is_clean(variance: float) -> bool:
        assert variance == 0.01
        return done[0] >= clean_at

    def progress(label: str, count: int, total: int, *_: str) -> None:
        calls.append((count, total))

    taken = []
    for step in steps(100, budget, 0, progress, is_clean):
        taken.append(step)
        done[0] += step
    assert taken == expected
    if time_s is None:
        assert calls[-1][0] == calls[-1][1]
    # A render that was interrupted goes on from where it was.
    later = list(steps(100, budget, 5, lambda *_: None, lambda variance: False))
    assert sum(later) == max(0, -(-goal // 2) - 5)
