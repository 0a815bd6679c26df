"""The answer under the brush and the exact one are one picture, for every preset."""

from pathlib import Path

import numpy as np
import pytest
from nightly import nightly

import lightpaint as lp
from lightpaint.basis.light_basis import meter_exposure
from lightpaint.colour.color import delta_e
from lightpaint.errors import PaintError
from lightpaint.paint import protocol
from lightpaint.paint.presets.lighting_presets import PRESETS
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.session_file import MemoryStore
from lightpaint.pipeline.job.settings import Settings

SCENES = Path(__file__).parents[2] / "scenes"

#: Largest mean ΔE between the two: under the brush a few thousand blocks stand for all pixels.
SAME = 0.5

#: Answers under a brush that rests for a moment; each is one step from the last.
STEPS = 8


@pytest.mark.parametrize(
    ("name", "size", "seed", "every"),
    [
        ("gallery", "80x45", 0, 3),
        ("stage", "80x45", 0, 2),
        *(
            nightly(name, size, seed, 1)
            for name in ("gallery", "stage")
            for size, seed in (("80x45", 0), ("160x90", 1), ("320x180", 0))
        ),
    ],
)
def test_live_and_exact_answers_are_one_picture(
    name: str, size: str, seed: int, every: int
) -> None:
    """Of every so many presets."""
    scene = lp.load_scene(SCENES / name / "scene.xml").reduced(size)
    basis = lp.render_basis(scene, spp=128, seed=seed)
    transform = lp.ViewTransform("srgb", meter_exposure(basis.current_look, basis))

    def displayed(image: np.ndarray) -> np.ndarray:
        return np.asarray(transform.decode(transform.encode(image)) * 2**transform.stops)

    differences = {}
    for preset in list(PRESETS)[::every]:
        store = MemoryStore(Identity.of([basis]))
        session = Session(
            [basis], [basis.current_look], store, settings=Settings(), transform=transform
        )
        try:
            session.handle(protocol.ApplyPreset(preset), {})
        except PaintError:  # it finds nothing to be about
            continue
        for _ in range(STEPS):
            session.live_answer.solve()
        exact = session.snapshot().solution()
        assert exact is not None
        live_picture, exact_picture = (basis.mix(x) for x in (session.weights, exact.weights))
        differences[preset] = float(
            delta_e(displayed(live_picture), displayed(exact_picture)).mean()
        )
    assert len(differences) >= 8 // every
    assert max(differences.values()) <= SAME, differences
