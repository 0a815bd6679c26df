"""Promises of buttons and previews: the answer after the click has the numbers that they gave."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from nightly import nightly, seeds

from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.images.object_map import Objects
from lightpaint.lighting.analysis.answer_analysis import Analysis, analyse
from lightpaint.lighting.analysis.appearance.answer_appearance import INVISIBLE
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.paint.protocol import Advice
from lightpaint.paint.session.session_messages import advice, sketch_headline
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.pipeline.job.settings import Settings
from lightpaint.report.phrases import spoken_amount, spoken_changed
from lightpaint.target.painted_target import Target

SIZE, LEFT = (45, 75), np.s_[:, :30]


def room(make_basis: Any, seed: int) -> Any:
    """Three lamps that spill over a rough wall, with grain; the wall's right third is a trim."""
    rng = np.random.default_rng(seed)
    x = np.linspace(0, 1, SIZE[1])[None, :, None]
    texture = rng.lognormal(0, 0.5, (*SIZE, 1))
    centres, width = (0.15, 0.5, 0.85) + 0.05 * rng.normal(size=3), 0.25 + 0.2 * rng.random()
    images = np.stack([texture * np.exp(-np.square((x - c) / width)) for c in centres])
    images = images.repeat(3, axis=-1)
    grain = rng.normal(0, 0.1, (2, *images.shape)) * images
    basis = make_basis(
        images=images + grain[0],
        half_differences=grain[1],
        names=["left", "middle", "right"],
        emission=[[0.1] * 3] * 3,
    )
    index = np.zeros(SIZE, np.int32)
    index[:, 50:] = 1
    return replace(basis, objects=Objects(index, ("wall", "trim")))


def snapshot(make_basis: Any, seed: int, *, tint: float = 0.0, **settings: Any) -> SessionSnapshot:
    """A session in which the left of a room was painted brighter, and greener by a tint."""
    rng, basis = np.random.default_rng(seed), room(make_basis, seed)
    image, importance = basis.current_look.copy(), np.zeros(SIZE, np.float32)
    importance[LEFT] = 1
    colour = np.array([1, 1 + tint, 1]) * np.exp(0.1 * rng.normal(size=3))
    image[LEFT] *= rng.lognormal(0.9, 0.05, (SIZE[0], 30, 1)) * colour
    target = Target.of(np.clip(image, 0, 1).astype(np.float32), importance, name="painting")
    target = replace(target, over_look=True, through_view=True, transform=ViewTransform())
    constraints = Constraints.of(settings.pop("constraints", {}))
    options = Settings(**settings), constraints, ViewTransform()
    return SessionSnapshot(1, (basis,), (target,), SessionRequests(), *options)


def released(before: SessionSnapshot, given: Advice) -> SessionSnapshot:
    """The session after the button was pressed."""
    if given.kind == "hold":
        return replace(before, settings=replace(before.settings, hold=given.hold))
    if given.kind == "colors":
        return replace(before, settings=replace(before.settings, colors="free"))
    assert given.kind == "limits"
    return replace(before, constraints=Constraints())


def judged(session: SessionSnapshot) -> Analysis:
    solution = session.solution()
    assert solution is not None
    [analysis] = analyse(solution)
    return analysis


CASES: list[Any] = [
    ("hold", {"hold": 30.0}),
    nightly("colors", {"hold": 0.01, "colors": "white", "tint": 2.0}),
    nightly(
        "limits",
        {"hold": 0.01, "colors": "free", "constraints": {"left": {"limits": {"max": 0.02}}}},
    ),
]


@pytest.mark.parametrize("seed", seeds(1, 3))
@pytest.mark.parametrize(("kind", "settings"), CASES)
def test_the_answer_after_the_click_is_what_was_promised(
    make_basis: Any, kind: str, settings: dict[str, Any], seed: int
):
    session = snapshot(make_basis, seed, **settings)
    before = judged(session)
    given = advice(before.appearance)
    assert given is not None
    assert given.kind == kind
    after = judged(released(session, given)).appearance
    # The same solve, with the same correction for noise, in the same measure.
    assert given.delta_e == pytest.approx((before.appearance.delta_e, after.delta_e), abs=1e-6)
    preview = released(session, given).preview(before.solution.weights)
    numbers = f"ΔE {spoken_amount(after.delta_e)} instead of "
    assert f"{numbers}{spoken_amount(before.appearance.delta_e)}" in preview.text
    rest = after.unpainted_change
    assert rest is not None
    # And at the same place: the change from the current scene, not from the last answer.
    is_told = f"and changes {spoken_changed(rest)}." in preview.text
    assert is_told == (rest.worst >= INVISIBLE)
    if after.changes_unpainted:
        assert f"ΔE {spoken_amount(rest.worst)}" in sketch_headline(after)
    if kind == "colors":
        [choice] = [x for x in before.color_choices if x.colors == "free"]
        assert choice.delta_e == given.delta_e[1]
    if kind == "hold":
        loosening = before.appearance.causes[0].loosening
        assert loosening is not None
        assert loosening.unpainted_change == rest
        assert loosening.present_hold == settings["hold"]
