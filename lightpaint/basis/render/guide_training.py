"""Trains the emitter guide before a basis is rendered: which emitters matter where.

Training depends on the scene and the seed alone, not on the number of samples, the budget or the
machine. So all machines choose emitters in the same way, and none has to wait for another.
"""

import gc
from collections.abc import Callable
from typing import TYPE_CHECKING

from lightpaint.arrays import Floats
from lightpaint.scene.runtime.render_lock import MITSUBA, tracing
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import view_seed

if TYPE_CHECKING:
    from lightpaint.basis.render.tracer.one_pass import Tracer

#: Numbers of camera samples in the training passes. Each pass uses what earlier ones learned.
TRAINING_SAMPLES = (2**16, 2**17, 2**17)


@MITSUBA.acquired()
def train_guide(scene: Scene, seed: int) -> Floats:
    """Train an emitter guide for `scene`, and return its `Basis.guide_table`."""
    from lightpaint.basis.render.tracer.one_pass import Tracer

    tracer = Tracer(scene, view_seed(seed, scene.sensor))
    try:
        with tracing() as let_others_through:
            return train(tracer, let_others_through)
    finally:
        tracer.close()
        gc.collect()


def train(tracer: "Tracer", let_others_through: Callable[[], None]) -> Floats:
    """Train the guide of `tracer`, and return its table.

    let_others_through: called before each pass.
    """
    (height, width), done = tracer.scene.size, 0
    for k, samples in enumerate(TRAINING_SAMPLES):
        let_others_through()
        # In a large picture a subset of the rows suffices, a different one in each pass.
        step = min(-(-height * width // samples), height)
        rows = range(k * step // len(TRAINING_SAMPLES), height, step)
        spp = max(1, samples // (len(rows) * width))
        tracer.learn(rows, done, spp)
        done += spp
    return tracer.end_training()
