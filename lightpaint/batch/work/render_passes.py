"""Final renders in ranges of passes, whose sums equal those of one render to the last bit."""

import gc
from typing import Any

from lightpaint.arrays import Doubles
from lightpaint.batch.manifest.keys import Final
from lightpaint.scene.runtime.render_lock import tracing
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import Stream, pass_sum, passes_of


class PassRenderer:
    """A renderer of passes of one relit scene, which stays loaded until `close`."""

    def __init__(self, scene: Scene, final: Final) -> None:
        self._scene, self._final = scene, final
        self._passes = passes_of(scene, final.spp)
        self._loaded_scene: Any = scene.load()

    def sum(self, passes: range) -> dict[int, Doubles]:
        """Return the undivided sums, (h, w, 3), of the given passes for each half, by the half."""
        sums: dict[int, Doubles] = {}
        for k in passes:
            half, spp = self._passes[k]
            seed, stream = self._final.seed, Stream.VERIFICATION
            with tracing():
                pass_total = pass_sum(
                    self._loaded_scene, self._scene, k, spp, seed=seed, stream=stream
                )
            sums[half] = sums[half] + pass_total if half in sums else pass_total
        return sums

    def close(self) -> None:
        """Release the scene."""
        self._loaded_scene = None
        gc.collect()
