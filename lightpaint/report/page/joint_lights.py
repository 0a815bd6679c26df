"""Lights that a mixer sets together: the texels of an image, and all lights with small shares.

Each has two planes, the mix of its lights in the answer and in the scene.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.basis.basis import Basis
from lightpaint.basis.light_images import LightImage, light_images
from lightpaint.colour.color import luminance
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.report.page.lights_table import most_visible_lights


@dataclass(frozen=True)
class JointLights:
    """Several lights in one row of a mixer.

    label: of the row. lights: their indices. image: if they are the texels of one.
    """

    label: str
    lights: Indices
    image: LightImage | None = None

    def level(self, weights: Doubles, current: Doubles) -> float:
        """Return the brightness of an image relative to that in the scene; 1 without one.

        weights, current: (n, 3), in a look and in the scene.
        """
        if self.image is None:
            return 1.0
        now, new = (float(luminance(self.image.mean(x))) for x in (current, weights))
        return new / now if now > 0 and new > 0 else 1.0

    def mixes(self, lighting: Lighting, basis: Basis) -> list[Doubles]:
        """Return the weights (n, 3) of its planes: in the answer at the level 1, and in the
        scene.
        """
        answer, current = lighting.weights_for(basis), basis.current_weights
        is_its = np.isin(np.arange(len(current)), self.lights)[:, None]
        level = self.level(answer, current)
        return [np.where(is_its, x, 0) for x in (answer / level, current)]

    def data(self, basis: Basis, lighting: Lighting) -> dict[str, Any]:
        """Return its record for the page. `columns` and `places` are those of its map, if any."""
        answer, current = lighting.weights_for(basis), basis.current_weights
        image = self.image if self.image is not None and self.image.is_whole else None

        def by_name(weights: Doubles) -> dict[str, list[float]]:
            lights = [k for k in self.lights if not basis.is_fixed[k]]
            return {basis.names[k]: weights[k].tolist() for k in lights}

        return {
            "label": self.label,
            "columns": 0 if image is None else image.size[0],
            "places": [] if image is None else image.map_order,
            "levels": {"answer": self.level(answer, current), "present": 1.0},
            "answer": by_name(answer / self.level(answer, current)),
            "present": by_name(current),
        }


def rows_of_mixer(basis: Basis, lighting: Lighting) -> tuple[Indices, Sequence[JointLights]]:
    """Return the lights with a row of their own, and those that share one."""
    images = light_images(basis.lights)
    texels = [k for image in images for k in image.lights]
    singles = np.setdiff1d(np.arange(len(basis.lights)), texels)
    shown = most_visible_lights(basis, lighting, among=singles)
    joint = [JointLights(image.name, image.lights, image) for image in images]
    if (others := np.setdiff1d(singles, shown)).size:
        joint.append(JointLights(f"{len(others)} more lights together", others))
    return shown, joint
