"""The search for missing lights: it tests point lights all over the scene, and suggests the best.

Candidates stand in free space and shine on visible surfaces. One pass renders the images of all of
them, like a basis, on a small film; algebra then gives the gain of each (additions.py). Further
passes search near the best ones.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import RGB, Floats, Position, as_rgb
from lightpaint.basis.basis import Basis
from lightpaint.basis.render.basis_render import render_planes_only
from lightpaint.basis.render.integrators import why_not_one_pass
from lightpaint.errors import SceneError
from lightpaint.keywords import keywords
from lightpaint.lighting.solution import Solution
from lightpaint.placement.search_views import on_small_film
from lightpaint.placement.space.free_space import (
    FreeSpace,
    as_position,
    far_apart,
    free_space,
    pixels_of,
)
from lightpaint.placement.suggestions.additions import Addition, find_additions
from lightpaint.placement.suggestions.candidates import Candidates
from lightpaint.placement.suggestions.suggestion import Suggestion
from lightpaint.progress import Progress, silent
from lightpaint.scene.checks.tokens import tag
from lightpaint.scene.lights.light import free_names
from lightpaint.scene.probe_lights import lit_by_points
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import Stream, pass_seed

#: The default number of suggestions.
SUGGESTED = 3

#: Number of trial positions in each pass: all over, near the best of these, nearer, and the best
#: again with all samples; and the minimum, on a film that cannot be reduced.
TRIED, FEWEST = (96, 48, 24, 0), 8

#: Additional positions for a closer search, since the best of few is not near the optimum.
BESIDE = 5

#: Pixels of the candidates' film, if possible; maximum number of values in all their images; camera
#: samples of a pass.
PIXELS, VALUES, SAMPLES = 2**14, 2**24, 2**19

#: RMS error below which the current lights reproduce the painting.
NOTHING_MISSED = 0.01

#: Smallest gain, as a share of the error, that is worth a light.
SMALLEST_SHARE = 0.01

#: Least distance of two suggestions, relative to the spread of visible points.
APART = 0.25


def check_suggestible(scene: Scene) -> None:
    """Raise SceneError, before rendering, for a scene in which no lights can be suggested."""
    if reason := why_not_one_pass(scene):
        raise SceneError(
            f"suggesting lights renders many in one pass, and {reason}: leave it out, or use "
            "the integrator path and a variant like llvm_ad_rgb"
        )


@keywords()
def suggest_lights(
    scene: Scene,
    basis: Basis,
    solution: Solution,
    *,
    count: int = SUGGESTED,
    seed: int = 0,
    progress: Progress = silent,
) -> tuple[Suggestion, ...]:
    """Suggest point lights that would bring `solution` closest to its painting, the best first.

    Args:
        scene: The scene of `basis`, on the same film or a larger one.
        basis: The basis of the solution, of that one view.
        solution: The solution to improve.
        count: Maximum number of suggestions; none if no light reliably removes 1 % of the error.
        seed: Of the positions and their images.
        progress: Receives progress.

    Raises:
        SceneError: For scenes that one pass cannot serve.

    Examples:
        >>> lp.suggest_lights(lp.load_scene("room.xml"), basis, lp.solve(basis, target))
        ()
    """
    if count < 1:
        raise SceneError(f"{count} lights cannot be suggested: ask for one or more")
    check_suggestible(scene)
    norm2 = float(solution.norm2.sum())
    if sum(solution.certificate.objective) <= NOTHING_MISSED**2 * norm2:
        return ()
    # The gains belong to the last linear problem, which may have another scale.
    total = solution.energy
    small = on_small_film(scene, basis, PIXELS)
    space = small.while_loaded(lambda loaded: free_space(small, loaded, seed=seed))
    if not len(space.places):
        return ()
    best: Floats = np.zeros((0, 3))
    radius = np.inf
    additions: list[Addition] = []
    progress("candidates", 0, len(TRIED))
    for k, tried in enumerate(TRIED):
        places = _places(space, best, radius, _most(small, tried))
        lit = _render(small, places, pass_seed(seed, Stream.CANDIDATES, 1 + k))
        is_last = k + 1 == len(TRIED)
        additions = find_additions(
            Candidates.of(basis, solution, lit),
            count=count if is_last else count + BESIDE,
            least=SMALLEST_SHARE * total if is_last else 0.0,
            # With few samples far from the best places, only the last pass is reliable.
            surely=is_last,
            too_near=_too_near(places, space),
        )
        progress("candidates", k + 1, len(TRIED))
        if not additions:
            break
        best = places[[addition.candidate for addition in additions]]
        radius = _spacing(places) if k == 0 else radius / 2
    return _suggestions(scene, additions, best, total) if additions else ()


def _most(small: Scene, tried: int) -> int:
    """Return how many of `tried` positions fit into one pass."""
    height, width = small.size
    return min(tried, max(VALUES // (height * width * 3), FEWEST))


def _places(space: FreeSpace, best: Floats, radius: float, count: int) -> Floats:
    """Return the best so far, and `count` more positions within `radius` of these, far apart."""
    if not len(best):
        return far_apart(space.places, count)
    near = [best]
    for place in best:
        nearby = space.places[np.linalg.norm(space.places - place, axis=1) < radius]
        near.append(far_apart(nearby, count // len(best), start=np.concatenate(near)))
    return np.concatenate(near)


def _spacing(places: Floats) -> float:
    """Return the median distance between neighbours."""
    between = np.linalg.norm(places[:, None] - places[None], axis=2)
    np.fill_diagonal(between, np.inf)
    return float(np.median(between.min(axis=1)))


def _too_near(places: Floats, space: FreeSpace) -> npt.NDArray[np.bool_]:
    between = np.linalg.norm(places[:, None] - places[None], axis=2)
    return np.asarray(between < APART * space.spread)


def _render(small: Scene, places: Floats, seed: int) -> Basis:
    height, width = small.size
    spp = max(4, SAMPLES // (height * width))
    lit = lit_by_points(small, [as_position(place) for place in places])
    return render_planes_only(lit, spp=spp, seed=seed)


def _suggestions(
    scene: Scene, additions: Sequence[Addition], places: Floats, total: float
) -> tuple[Suggestion, ...]:
    seen = scene.while_loaded(lambda loaded: pixels_of(scene, loaded, places))
    names = free_names("suggested", len(additions), [x.name for x in scene.emitters])
    suggestions = []
    missed = total
    for k, addition in enumerate(additions):
        missed -= addition.gain
        emission = as_rgb(f"{v:.4g}" for v in addition.weights[-1])
        position = as_position(f"{v:.6g}" for v in places[k])
        suggestions.append(
            Suggestion(
                name=names[k],
                position=position,
                emission=emission,
                gain_share=addition.gain / total,
                missed_share=max(missed, 0.0) / total,
                xml=emitter_xml(names[k], position, emission),
                seen_at=seen[k],
                without=addition.without,
                with_it=addition.with_it,
            )
        )
    return tuple(suggestions)


def emitter_xml(name: str, position: Position, intensity: RGB) -> str:
    """Return a point light as an element for <scene>."""
    x, y, z = (f"{v:g}" for v in position)
    lines = [
        tag("point", name="position", x=x, y=y, z=z),
        tag("rgb", name="intensity", value=" ".join(f"{v:g}" for v in intensity)),
    ]
    inner = "".join(f"    {line}\n" for line in lines)
    return f'<emitter type="point" id="{name}">\n{inner}</emitter>'
