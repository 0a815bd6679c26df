"""One final render by many workers."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from lightpaint.batch.plan.cost_estimate import SAMPLE_S
from lightpaint.batch.work.engine import Engine
from lightpaint.batch.work.task import Task
from lightpaint.batch.work.work_items import Passes
from lightpaint.errors import SceneError
from lightpaint.images.estimate import Estimate
from lightpaint.pipeline.sources import SceneFile
from lightpaint.progress import Listener
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import estimate_of, passes_of, ranges_of


def rendered_by(
    engine: Engine, task: Task, variant: str | None, listen: Listener
) -> Callable[[Scene], Estimate]:
    """What has `engine` render the scene of a look that is answered, in ranges of passes.

    variant: Mitsuba's, of the look's own scene.
    """

    def rendered(relit: Scene) -> Estimate:
        # As the answer has left it, which comes out the same when it is written anew.
        path = str(Path(task.writes) / "relit.xml")
        scene = SceneFile(
            path,
            relit.sensor,
            parameters=dict(relit.parameters),
            variant=variant,
            use_lights_file=False,
        )
        files = tuple(map(str, scene.content.read_files))
        height, width = relit.size
        passes = passes_of(relit, task.final.spp)
        errands = []
        for some in ranges_of(relit, passes):
            samples = height * width * sum(passes[k][1] for k in some)
            name, expected_s = f"{task.look} {some.start}", samples * SAMPLE_S
            which = some.start, some.stop
            errands.append(Passes(name, scene, task.final, *which, files, expected_s))
        came = {}
        sums, following = np.zeros((2, height, width, 3), np.float64), 0
        for count, done in enumerate(engine.run(errands)):
            if done.failure:
                raise SceneError(done.failure)
            came[done.look] = done.value
            while following < len(errands) and errands[following].name in came:
                for half, its in came.pop(errands[following].name).items():
                    sums[half] += its
                following += 1
            listen("relit", count + 1, len(errands), "ranges of passes")
        return estimate_of(sums, passes)

    return rendered
