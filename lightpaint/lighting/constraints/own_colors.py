"""The restriction to their own colours, for all lamps whose colour is open: they only dim."""

from collections.abc import Sequence

from lightpaint.basis.lights import BasisLight
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.light_patterns import lights_of_open_color
from lightpaint.lighting.constraints.start_lighting import start_weights

#: That restriction in few words, for tables.
OWN_COLOR_LABEL = "own colour"


def keep_own_colors(constraints: Constraints, lights: Sequence[BasisLight]) -> Constraints:
    """Return constraints in which every light of open colour also keeps its current one.

    A light that is off has no colour, and is white.
    """
    own = start_weights(constraints.start, lights)
    own_colors = {
        lights[k].name: {"color": own[k].tolist() if own[k].any() else "#fff"}
        for k in lights_of_open_color(constraints, lights)
    }
    return constraints.and_then(Constraints.of(own_colors))


def own_color_labels(
    labels: Sequence[str], constraints: Constraints, lights: Sequence[BasisLight]
) -> tuple[str, ...]:
    """Return the labels (n,) of lights under `constraints` together with that restriction."""
    open_lights = set(lights_of_open_color(constraints, lights))
    return tuple(
        ", ".join(filter(None, [label, OWN_COLOR_LABEL])) if k in open_lights else label
        for k, label in enumerate(labels)
    )
