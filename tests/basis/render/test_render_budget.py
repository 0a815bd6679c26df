"""When a basis is kept while it is rendered."""

import time
from typing import Any

import pytest

from lightpaint.basis.render.render_budget import KEEP_EVERY_S, Keeper


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
