"""Training of the emitter guide, which learns which emitter matters where, before a render.

It depends on the scene and the seed alone, not on the number of samples, the budget or the machine.
So all machines choose emitters alike, and none waits for another.
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

#: Camera samples of the training passes. Each pass uses what the earlier ones have learned.
TRAINING_SAMPLES = (2**16, 2**17, 2**17)


@MITSUBA.acquired()
def train_guide(scene: Scene, seed: int) -> Floats:
    """Learn which emitters to choose where in `scene`, and return the `Basis.guide_table`."""
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

    let_others_through: called between passes.
    """
    (height, width), done = tracer.scene.size, 0
    for k, samples in enumerate(TRAINING_SAMPLES):
        let_others_through()
        # In a large picture some rows are enough, other ones in each pass.
        step = min(-(-height * width // samples), height)
        rows = range(k * step // len(TRAINING_SAMPLES), height, step)
        spp = max(1, samples // (len(rows) * width))
        tracer.learn(rows, done, spp)
        done += spp
    return tracer.end_training()
