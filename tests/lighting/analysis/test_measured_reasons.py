"""The stated cost of a reason equals the gain from removing it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lightpaint.basis.lights import BasisLight
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.lighting.analysis.appearance.answer_appearance import compare_appearance
from lightpaint.lighting.analysis.noise.noise_correction import correct_noise
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.constraints.light_constraints import ConstraintsByLight
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.solution import Solution
from lightpaint.target.painted_target import Target

SIZE = (90, 150)


@pytest.fixture
def studio(make_basis: Any) -> tuple[Any, Target]:
    """Three lamps on a rough wall with grain, and paint that no sample of pixels stands for."""
    rng = np.random.default_rng(3)
    x = np.linspace(0, 1, SIZE[1])[None, :, None]
    texture = rng.lognormal(0, 0.5, (*SIZE, 1))
    images = np.stack(
        [texture * np.exp(-np.square((x - centre) / 0.3)) for centre in (0.2, 0.5, 0.8)]
    )
    images = images.repeat(3, axis=-1)
    grain = rng.normal(0, 0.15, (2, *images.shape)) * images
    names = ["left", "middle", "right"]
    basis = make_basis(
        images=images + grain[0],
        half_differences=grain[1],
        names=names,
        emission=[[0.1] * 3] * 3,
    )
    image, importance = basis.current_look.copy(), np.zeros(SIZE, np.float32)
    importance[:, :60] = 1
    image[:, :60] *= rng.lognormal(0.9, 0.2, (SIZE[0], 60, 1)) * [0.6, 1, 0.6]
    target = Target.of(image.astype(np.float32), importance, name="painting")
    return basis, replace(target, over_look=True, through_view=True, transform=ViewTransform())


def _error(solution: Solution, target: Target) -> float:
    """Return Σ D ‖V(ψ) − V(x)‖² over the paint, in all its pixels."""
    encode, mixed = ViewTransform().encode, solution.basis.mix(solution.weights)
    residual = encode(target.image.astype(np.float64)) - encode(mixed.astype(np.float64))
    return float((target.importance[..., None] * np.square(residual)).sum())


@pytest.mark.nightly
def test_a_weaker_hold_removes_the_share_that_is_said(studio: Any):
    basis, target = studio
    before = correct_noise(solve(basis, target, hold=30.0))
    reason = next(x for x in compare_appearance(before).reasons if x.kind == "hold")
    assert reason.loosening is not None
    after = correct_noise(solve(basis, target, hold=reason.loosening.hold))
    gained = 1 - _error(after, target) / _error(before, target)
    assert gained > 0.1
    assert reason.loosening.share == pytest.approx(gained, abs=1e-9)


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["limits", "colors", "emitters"])
def test_the_first_reason_removes_the_share_that_is_said(studio: Any, kind: str):
    basis, target = studio
    limits = Constraints.of({"left": {"limits": {"max": 0.12}}})
    lamp = {"emitters": [{"name": "white", "rgb": [1, 1, 1], "Y": 0.1}]}
    options, free = {
        "limits": ({"constraints": limits, "colors": "free"}, {"colors": "free"}),
        "colors": ({"colors": "white"}, {"colors": "free"}),
        "emitters": (
            {"constraints": Constraints.of({"left": lamp}), "colors": "free"},
            {"colors": "free"},
        ),
    }[kind]
    before = correct_noise(solve(basis, target, hold=0.01, **options))
    reason = compare_appearance(before).reasons[0]
    assert reason.kind == kind
    gained = 1 - _error(correct_noise(solve(basis, target, hold=0.01, **free)), target) / _error(
        before, target
    )
    assert gained > 0.1
    assert reason.share == pytest.approx(gained, abs=1e-9)


def test_texels_of_an_image_are_released_together():
    names = [f"sky.x{x}.y{y}" for y in range(3) for x in range(2)]
    texels = [BasisLight(x, "envmap", "radiance", "W/(m² sr)", (1.0, 1.0, 1.0)) for x in names]
    bulbs = [BasisLight(x, "point", "intensity", "W/sr", (1.0, 1.0, 1.0)) for x in ("a", "b")]
    lights = [bulbs[0], *texels, bulbs[1]]
    by_light = ConstraintsByLight.of(Constraints(), lights)
    assert by_light.units([0, 1, 2, 5, 7]) == [[0], [1, 2, 5], [7]]


def test_with_many_lights_the_cost_of_a_lock_is_gained_by_the_weights_of_the_sample(
    studio: Any, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(
        "lightpaint.lighting.analysis.appearance.limiting_reasons.MAX_SOLVED_LIGHTS", 2
    )
    basis, target = studio
    locked = solve(basis, target, constraints=Constraints.of({"left": {"lock": True}}), hold=0.0)
    reason = next(x for x in compare_appearance(locked).reasons if x.kind == "lock")
    free = solve(basis, target, hold=0.0)
    gained = 1 - _error(free, target) / _error(locked, target)
    # The sample's weights gain a little less than the best ones.
    assert 0.9 * gained < reason.share < 1.001 * gained
