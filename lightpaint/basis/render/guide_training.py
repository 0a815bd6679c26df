"""Trains the emitter guide before a basis is rendered: which emitters matter where.

Training depends on the scene, its film and the seed alone, not on the number of samples, the budget
or the machine. So all machines choose emitters in the same way, and none has to wait for another.
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

#: Maximum numbers of camera samples in the training passes. Each pass uses what earlier ones
#: learned.
TRAINING_SAMPLES = (2**16, 2**17, 2**17)
#: Maximum number of them per pixel, since training for a small picture would take longer than its
#: samples; and, where many emitters are to choose from, that number for each emitter.
TRAINING_SPP, TRAINING_SPP_PER_EMITTER = 16, 0.5


def training_samples(scene: Scene) -> tuple[int, ...]:
    """Return the numbers of camera samples in the training passes for `scene`."""
    height, width = scene.size
    spp = max(TRAINING_SPP, TRAINING_SPP_PER_EMITTER * len({x.node for x in scene.emitters}))
    share = min(1.0, spp * height * width / sum(TRAINING_SAMPLES))
    return tuple(max(1, round(share * samples)) for samples in TRAINING_SAMPLES)


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
    """Train the guide of `tracer`, unless it has no choice, and return its table.

    let_others_through: called before each pass.
    """
    (height, width), done = tracer.scene.size, 0
    passes = training_samples(tracer.scene) if tracer.guide.has_choice else ()
    for k, samples in enumerate(passes):
        let_others_through()
        # In a large picture a subset of the rows suffices, a different one in each pass.
        step = min(-(-height * width // samples), height)
        rows = range(k * step // len(passes), height, step)
        spp = max(1, samples // (len(rows) * width))
        tracer.learn(rows, done, spp)
        done += spp
    return tracer.end_training()
