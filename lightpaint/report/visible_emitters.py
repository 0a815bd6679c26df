"""Remarks on emitters in view: the painted pixels that they exclude, and their brightness in the
answer.
"""

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats, Indices, in_all_channels, in_any_channel
from lightpaint.basis import Basis, joined_texels, texel_lights
from lightpaint.colour import luminance
from lightpaint.display_text import some_of
from lightpaint.images import Estimate, sum_by_bands
from lightpaint.lighting import Solution, ignored_paint
from lightpaint.scene.lights.texels import image_of
from lightpaint.sentences import Hint, Sentence, Word
from lightpaint.target import Target

#: Ratio to the painted brightness from which an emitter that does not count is worth a warning.
MIN_RATIO = 4.0

#: The argument that makes emitters in view count.
COUNT_EMITTERS = Hint("emitters", Word("count"))

#: Share of the painted energy from which emitters that count dominate the answer.
DOMINANT_SHARE = 0.5


def emitter_remarks(target: Target, solution: Solution, predicted: Estimate) -> list[str]:
    """Return remarks for the user. target: of one view, as given to the solve."""
    sees_emitter = solution.basis.emitters_seen
    painted = target.importance > 0
    ignored = ignored_paint(target, sees_emitter, solution.problem.fit.emitters)
    if ignored.any():
        return [
            Sentence(
                f"{_share(ignored, painted)}, and count nothing; ",
                COUNT_EMITTERS,
                " holds the emitters themselves to how bright they were painted",
            ),
            *_known_by_sight_alone(solution, ignored),
            *_too_bright(target, solution, predicted, ignored),
        ]
    counted = sees_emitter & painted
    [read] = solution.problem.views.targets
    if read.at_least is not None:
        counted &= ~in_all_channels(read.at_least)
    if not counted.any():
        return []

    def energies(D: Floats, image: Floats, pixels: Bools) -> Floats:
        energy = D[..., None] * np.square(image, dtype=np.float64)
        return np.array([energy[pixels].sum(), energy.sum()])

    emitter_energy, total_energy = sum_by_bands(
        energies, target.importance, target.image, counted
    ).tolist()
    if (part := emitter_energy / (total_energy or 1)) >= DOMINANT_SHARE:
        return [
            Sentence(
                f"{_share(counted, painted)}, which make up {100 * part:.0f} % of the painted "
                "energy and rule the fit: ",
                Hint("emitters", Word("skip")),
                " leaves them out",
            )
        ]
    return []


def _share(selected: Bools, painted: Bools) -> str:
    count, total = int(selected.sum()), int(painted.sum())
    return (
        f"emitters are seen in {count} of {total} painted pixels "
        f"({100 * count / total:.{1 if count < 0.1 * total else 0}f} %)"
    )


def _known_by_sight_alone(solution: Solution, ignored: Bools) -> list[str]:
    """Return a warning of undetermined lights that are seen where nothing counts.

    A bulb in a glass ball, say: many samples see it, and few paths find its light elsewhere.
    """
    # Noise may have solved it far too dim.
    weights = np.maximum(solution.weights, solution.basis.current_weights)
    brightest = _brightest_lights(solution.basis, weights, ignored)
    lights = solution.lighting.lights
    names = [lights[k].name for k in np.unique(brightest) if lights[k].untold]
    if not names:
        return []
    pronoun, clause = ("it", "it is") if len(names) == 1 else ("them", "they are")
    return [
        Sentence(
            f"WARNING: too few samples show the light of {some_of(joined_texels(names), room=300)} "
            f"on surfaces, but the camera sees {pronoun}: ",
            COUNT_EMITTERS,
            f" solves {pronoun} by how bright {clause} painted",
        )
    ]


def _brightest_lights(basis: Basis, weights: Doubles, pixels: Bools) -> Indices:
    """Return the brightest light in each of some pixels, (p,). weights: (n, 3). pixels: (h, w)."""
    if not pixels.any():
        return np.zeros(0, np.intp)
    images = basis.planes.pixels(np.flatnonzero(pixels)) * weights[:, None].astype(np.float32)
    return np.asarray(np.argmax(luminance(images), axis=0))


def _too_bright(
    target: Target, solution: Solution, predicted: Estimate, ignored: Bools
) -> list[str]:
    """Return a warning of lights that come out far brighter in view than they were painted."""
    basis = solution.basis
    # Where the painting means "at least this bright", nothing is too bright.
    if target.at_least is not None:
        ignored = ignored & ~in_any_channel(target.at_least)
    brightest_light = _brightest_lights(basis, solution.weights, ignored)
    predicted_light, painted_light = (
        np.asarray(luminance(x[ignored])) for x in (predicted.image, target.image)
    )
    is_texel = texel_lights(basis.lights)
    names = [image_of(x) if is_texel[k] else x for k, x in enumerate(basis.names)]
    texts = []
    for name in dict.fromkeys(names[k] for k in np.unique(brightest_light)):
        lights = [k for k, x in enumerate(names) if x == name and not basis.is_fixed[k]]
        is_its = np.isin(brightest_light, lights)
        reached, goal = predicted_light[is_its].sum(), np.maximum(painted_light[is_its], 0).sum()
        if reached > MIN_RATIO * goal:
            texts.append(f"{name} ({_times(float(reached), float(goal))})")
    if not texts:
        return []
    return [
        Sentence(
            f"WARNING: brighter than painted where they are seen: {some_of(texts, room=300)}; ",
            COUNT_EMITTERS,
            " holds them to the painting",
        )
    ]


def _times(reached: float, goal: float) -> str:
    if goal <= 0:
        return "painted black"
    return f"{reached / goal:,.{0 if reached >= 10 * goal else 1}f} times"


def answer_remarks(solution: Solution) -> list[Sentence]:
    """Return remarks on what a solve made of its painting."""
    problem, remarks = solution.problem, list[Sentence]()
    if problem.filter_share:
        remarks.append(
            Sentence(
                "the painting seems to be rendered with a wider reconstruction filter than a box: "
                "the answer allows for its softer edges and halos"
            )
        )
    elif problem.is_render:
        remarks.append(
            Sentence(
                "the lights make all of the painting but noise, as of a render: it is fitted as it "
                "is, and noise makes no wishes"
            )
        )
    elif problem.is_render is None:
        remarks.append(
            Sentence(
                "noise hides whether the painting is a render: it is read as a sketch (",
                Hint("literal", True),
                " fits it as light)",
            )
        )
    if problem.holding is not None:
        remarks.append(
            Sentence(
                "lights stay about as they are: larger changes lead away from the paint (",
                Hint("literal", True),
                " makes those of the least squares)",
            )
        )
    return remarks
