"""Messages of a session that is none: whole ones, with what a test does not care about made up."""

from typing import Any

import numpy as np

from lightpaint.paint.protocol import (
    VERSION,
    AnswerUpdate,
    Findings,
    ProgressReport,
    SampleCount,
    SessionPending,
    SessionState,
    TableInfo,
    TransformInfo,
    ViewInfo,
)


def fake_answer(**fields: Any) -> AnswerUpdate:
    weights = np.ones((2, 3))
    defaults = {"version": 0, "stroke": 0, "exact": False, "mode": "linear", "weights": weights}
    return AnswerUpdate(**{**defaults, **fields})


def fake_progress(task: str, done: int) -> ProgressReport:
    return ProgressReport(task=task, done=done, total=1000, unit="passes")


def fake_pending() -> SessionPending:
    fields = {"version": VERSION, "scene": "room", "folder": "/shows/room", "text": ""}
    return SessionPending(**fields, can_render=False, can_report=False, progress=None)  # type: ignore[arg-type]


def fake_state(resources: dict[str, int], **fields: Any) -> SessionState:
    defaults = {
        "version": VERSION,
        "scene": "room",
        "folder": "/shows/room",
        "can_render": False,
        "can_report": False,
        "size": (2, 3),
        "objects": (),
        "lights": (),
        "images": (),
        "views": (ViewInfo("", (2, 3), (), (), (2, 3)),),
        "transforms": ("srgb",),
        "transform": TransformInfo("srgb", 0.0),
        "lut": TableInfo(2, 0.0, 1.0),
        "resources": resources,
        "looks": (),
        "presets": (),
        "references": (),
        "basis": SampleCount(1, 1, True),
        "verifications": (),
        "is_new": True,
        "stroke": -1,
        "command": "",
        "answer": Findings(),
        "weights": np.ones((0, 3)),
    }
    return SessionState(**{**defaults, **fields})
