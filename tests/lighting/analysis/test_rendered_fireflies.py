"""A bulb in a glass ball: a rendered light that is nothing but stray bright pixels."""

from typing import Any

import numpy as np
import pytest
from renderer import LIGHTS, write_room

import lightpaint as lp
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render import basis_render
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.lighting.analysis.noise import uncertainty
from lightpaint.target.painted_target import Target

#: Outside of the picture, so that its light comes by way of what it lights.
BULB_IN_GLASS = """<shape type="sphere" id="bulb"><point name="center" x="-1.3" y="1.5" z="1.6"/>
        <float name="radius" value="0.12"/><emitter type="area">
        <rgb name="radiance" value="10 10 10"/></emitter></shape>
    <shape type="sphere"><point name="center" x="-1.3" y="1.5" z="1.6"/>
        <float name="radius" value="0.2"/><bsdf type="dielectric"/></shape>"""

#: Weights that the painting is a mix of; the last one is the bulb's.
TRUE_WEIGHTS = np.array([[1.0, 0.8, 0.6], [0.5, 0.5, 0.5], [40.0, 30.0, 20.0]])

SEEDS, SPP, LONG_SPP = 10, 16, 2**14


@pytest.fixture(scope="module")
def bases(tmp_path_factory: pytest.TempPathFactory) -> list[Basis]:
    """A basis of each seed, and a long one."""
    lights = LIGHTS["panel"] + LIGHTS["beam"] + BULB_IN_GLASS
    scene = lp.load_scene(write_room(tmp_path_factory.mktemp("room"), lights=lights))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(basis_render, "TRAINING_SAMPLES", (2**12,))
        short_bases = [render_basis(scene, spp=SPP, seed=seed) for seed in range(SEEDS)]
        return [*short_bases, render_basis(scene, spp=LONG_SPP, seed=SEEDS)]


def bars_of_seeds(bases: list[Basis]) -> list[Any]:
    """Error bars of a painting that is a mix of the lights, by each basis but the long one."""
    *short, long = bases
    target = Target(
        "mix", long.mix(TRUE_WEIGHTS), (~long.emitters_seen).astype(np.float32), everything=True
    )
    answers = (lp.correct_noise(lp.solve(basis, target, literal=True)) for basis in short)
    return [lp.error_bars(answer) for answer in answers]


def coverage_share(bars: list[Any], light: int) -> float:
    """The share of seeds and channels whose intervals hold the true weight of a light."""
    true = TRUE_WEIGHTS[light]
    ends = [(low[light], high[light]) for low, high in (bar.interval for bar in bars)]
    return float(np.mean([(low <= true) & (true <= high) for low, high in ends]))


@pytest.mark.nightly
def test_intervals_hold_the_weight_of_a_bulb_in_glass(
    bases: list[Basis], monkeypatch: pytest.MonkeyPatch
) -> None:
    bars = bars_of_seeds(bases)
    assert coverage_share(bars, 2) >= 0.9
    assert np.mean([bar.untold[2] for bar in bars]) >= 0.9
    # All are far too dim, and by half differences alone nobody would know.
    solved = np.array([bar.weights[2] for bar in bars])
    assert (solved < 0.5 * TRUE_WEIGHTS[2]).mean() > 0.9
    none = np.zeros(TRUE_WEIGHTS.shape)
    monkeypatch.setattr(uncertainty, "noise_doubts", lambda *_: none)
    assert coverage_share(bars_of_seeds(bases), 2) < 0.5
