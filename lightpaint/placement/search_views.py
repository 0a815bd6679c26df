"""The views and looks that a search for places works on, and their small films."""

from collections.abc import Sequence

from lightpaint.basis.basis import Basis
from lightpaint.errors import SceneError
from lightpaint.images.pixel_blocks import whole_factor
from lightpaint.lighting.solution import Solution
from lightpaint.scene.properties.film import reduction_to
from lightpaint.scene.scene import Scene

#: Number of pixels of the small films, on which all places are compared, and of the larger films
#: for the last steps; of all views together, if possible.
PIXELS, FINE_PIXELS = 2**12, 2**14


def check_views(
    scenes: Scene | Sequence[Scene], bases: Basis | Sequence[Basis]
) -> list[tuple[Scene, Basis]]:
    """Return the checked views. Raises SceneError unless they are of one scene."""
    all_scenes = [scenes] if isinstance(scenes, Scene) else list(scenes)
    all_bases = [bases] if isinstance(bases, Basis) else list(bases)
    if not all_scenes or len(all_scenes) != len(all_bases):
        raise SceneError(
            f"{len(all_scenes)} scenes and {len(all_bases)} bases: give one of each for every view"
        )
    first = all_scenes[0]
    for other in all_scenes[1:]:
        if (other.path, other.parameters) != (first.path, first.parameters):
            raise SceneError(
                f"{first.path} and {other.path} are two scenes: views differ in the sensor alone"
            )
    return list(zip(all_scenes, all_bases, strict=True))


def check_looks(
    solution: Solution | Sequence[Solution], bases: Sequence[Basis]
) -> list[tuple[Solution, list[int]]]:
    """Return each solution, and the places of its views among `bases`.

    Raises SceneError for a look of another view, and without any look.
    """
    if isinstance(solution, Solution):
        return [(solution, list(range(len(bases))))]
    known = [(basis.origin.sensor, basis.size) for basis in bases]
    looks = []
    for its in solution:
        views = [(basis.origin.sensor, basis.size) for basis in its.problem.views.bases]
        if missing := [sensor for sensor, size in views if (sensor, size) not in known]:
            raise SceneError(
                f"a look is through the sensor {missing[0]!r}, but no basis of its size is: give "
                "the bases of all views"
            )
        looks.append((its, [known.index(view) for view in views]))
    if not looks:
        raise SceneError("no look to place lights for: give a solution")
    return looks


def films_of(views: Sequence[tuple[Scene, Basis]]) -> tuple[list[Scene], list[Scene]]:
    """Return the scene of each view on a small film, and on a larger one for the last steps.

    Raises SceneError if a basis is of another film than its scene.
    """
    large = [on_small_film(scene, basis, FINE_PIXELS // len(views)) for scene, basis in views]
    return [reduced_film(scene, PIXELS // len(views)) for scene in large], large


def on_small_film(scene: Scene, basis: Basis, pixels: int) -> Scene:
    """Return `scene` on a film whose pixels are blocks of those of `basis`, `pixels` or fewer.

    Raises SceneError if the basis is of another film.
    """
    (height, width), (mine_h, mine_w) = scene.size, basis.size
    if whole_factor(scene.size, basis.size) is None:
        raise SceneError(
            f"the basis is {mine_w}x{mine_h}, whose pixels are not blocks of those of the film "
            f"of {scene.path}, {width}x{height}: make it again"
        )
    return reduced_film(scene.reduced(f"{mine_w}x{mine_h}"), pixels)


def reduced_film(scene: Scene, pixels: int) -> Scene:
    """Return `scene` on a film of at most `pixels`, if possible without incomplete blocks."""
    return scene.reduced(f"1/{reduction_to(scene.film, pixels)}")
