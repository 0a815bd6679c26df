"""Restrictions for all lamps whose colour is open: to whites, or to their own colours."""

from collections.abc import Sequence

from lightpaint.arrays import Doubles
from lightpaint.basis import BasisLight
from lightpaint.colour import cct_and_duv
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.light_patterns import lights_of_open_color
from lightpaint.lighting.constraints.start_lighting import start_weights

#: The range of usual lamps, in kelvin.
LAMP_KELVINS = (2200, 9000)

#: Whites that the range is widened to where warmer or bluer ones are painted, up to moonlight.
WARMER_KELVINS, BLUER_KELVINS = (2000.0,), (12_000.0, 16_000.0, 20_000.0, 25_000.0)

#: Largest distance from Planck's locus at which a painted colour is a white.
WHITE_DUV = 0.02

#: Ratio by which a range reaches beyond the mean white that is painted.
BEYOND_MEAN = 1.1

#: The range of white of each light, in kelvin.
WhiteLimits = tuple[tuple[float, float], ...]

#: That restriction in few words, for tables.
OWN_COLOR_LABEL = "own colour"


def painted_whites(emission: Doubles) -> WhiteLimits:
    """Return the ranges of lights that are painted as emission (n, 3): that of usual lamps, and as
    far as bluer or warmer whites are painted.
    """
    return tuple(_painted_white(color) for color in emission)


def _painted_white(color: Doubles) -> tuple[float, float]:
    white = cct_and_duv(color)
    low, high = map(float, LAMP_KELVINS)
    if white is None or abs(white[1]) > WHITE_DUV:
        return low, high
    kelvin, _ = white
    low = next((x for x in (low, *WARMER_KELVINS) if x <= kelvin), WARMER_KELVINS[-1])
    wanted = BEYOND_MEAN * kelvin
    return low, next((x for x in (high, *BLUER_KELVINS) if x >= wanted), BLUER_KELVINS[-1])


def whiten_open_lights(
    constraints: Constraints, lights: Sequence[BasisLight], whites: WhiteLimits | None = None
) -> Constraints:
    """Return constraints in which every light of open colour also stays between two whites.

    whites: of each light, in kelvin; None for LAMP_KELVINS.
    """
    limits = whites or (LAMP_KELVINS,) * len(lights)
    return constraints.and_then(
        Constraints.of(
            {
                lights[k].name: {"kelvin": list(limits[k])}
                for k in lights_of_open_color(constraints, lights)
            }
        )
    )


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
