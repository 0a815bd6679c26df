"""Lights that moved, stayed and came, for tests of what is exported for other programs."""

from typing import Any

import numpy as np

from lightpaint.scene.properties.site import EmitterPlace, Site

RGB = (2.0, 1.0, 0.25)
DOWN, WAY = (0.0, -1.0, 0.0), (0.6, -0.8, 0.0)

#: A spot that moved and turned, another that stayed, a sun that turned, and new lights; y is up.
OLD = Site((1.0, 2.0, 3.0), DOWN, 30.0, 20.0)
PLACES = (
    EmitterPlace("spot", (1.5, 2.5, 3.0), WAY, 40.0, 10.0, moved_from=OLD),
    EmitterPlace("bulb", (4.0, 1.0, -2.0)),
    EmitterPlace("sun", None, WAY, moved_from=Site(None, DOWN)),
    EmitterPlace("key", (0.0, 3.0, 1.0), WAY, 25.0, 5.0, new="spot"),
    EmitterPlace("fill", (0.5, 3.0, 1.0), new="point"),
    EmitterPlace("window light", (0.0, 2.0, -1.0), WAY, new="panel", size=(2.0, 0.5)),
)


def z_up(point: Any) -> np.ndarray:
    """A point or direction of a scene whose y is up, in axes whose z is up."""
    x, y, z = point
    return np.array([x, -z, y])
