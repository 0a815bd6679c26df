"""A final render by many workers."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from lightpaint.batch.distribution.engine import Engine
from lightpaint.batch.work.task import Task
from lightpaint.batch.work.work_items import SAMPLE_S, Passes
from lightpaint.errors import SceneError
from lightpaint.images.estimate import Estimate
from lightpaint.pipeline.job.sources import SceneFile
from lightpaint.progress import Listener
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import estimate_of, passes_of, ranges_of


def distributed_renderer(
    engine: Engine, task: Task, variant: str | None, listen: Listener
) -> Callable[[Scene], Estimate]:
    """Return a function that renders a look's relit scene by `engine`, in ranges of passes.

    variant: Mitsuba variant of the look's scene.
    """

    def render(relit: Scene) -> Estimate:
        # The answer has written this scene; writing it again gives the same file.
        path = str(Path(task.output_folder) / "relit.xml")
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
        items = []
        for range_ in ranges_of(relit, passes):
            samples = height * width * sum(passes[k][1] for k in range_)
            name, expected_s = f"{task.look} {range_.start}", samples * SAMPLE_S
            bounds = range_.start, range_.stop
            items.append(Passes(name, scene, task.final, *bounds, files, expected_s))
        results = {}
        sums, next_item = np.zeros((2, height, width, 3), np.float64), 0
        for count, result in enumerate(engine.run(items)):
            if result.failure:
                raise SceneError(result.failure)
            results[result.look] = result.value
            while next_item < len(items) and items[next_item].name in results:
                for half, half_sum in results.pop(items[next_item].name).items():
                    sums[half] += half_sum
                next_item += 1
            listen("relit", count + 1, len(items), "ranges of passes")
        return estimate_of(sums, passes)

    return render
