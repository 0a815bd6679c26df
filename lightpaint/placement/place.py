"""Lights that move to where the painting wants them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.errors import SceneError
from lightpaint.images.pixel_blocks import block_mean
from lightpaint.keywords import keywords
from lightpaint.lighting.solution import Solution
from lightpaint.placement.candidates import pull_with_more, reduced_goal
from lightpaint.placement.free_space import as_position, free_space
from lightpaint.placement.freedom import Freedom, FreeLight
from lightpaint.placement.frozen_paths import FrozenPaths
from lightpaint.placement.light_search import on_small_film
from lightpaint.placement.placement_fit import PlacementFit
from lightpaint.placement.pose_search import Found, PoseSearch, SearchPaths
from lightpaint.progress import Progress, silent
from lightpaint.scene.lights.light import Light
from lightpaint.scene.properties.emission import MULTIPLE
from lightpaint.scene.properties.pose import Pose, Site
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import Stream, pass_seed
from lightpaint.scene.surfaces import render_features

#: Pixels of the film that is searched on, if possible.
PIXELS = 2**12

#: First hits of a pixel, and paths that go on: to rank, compare, refine and judge candidates.
SAMPLES = ((4, 0), (9, 2), (36, 8), (36, 8))

#: Plugins whose light can be computed along frozen paths.
SEARCHED = ("point", "spot", "directional")


@keywords()
@dataclass(frozen=True)
class Move:
    """A move of a light that is worth it.

    Attributes:
        name: The light.
        old: Its place, direction and cone before.
        new: The same after the move.
        gain_share: The share of what was missed that it gives, beside the other moves.

    Examples:
        >>> solution, scene = lp.solve(basis, target), lp.load_scene("room.xml")
        >>> placement = lp.place(scene, basis, solution, {"bulb": lp.Freedom(within=0.5)})
        >>> all(move.gain_share > 0 for move in placement.moves)
        True
    """

    name: str
    old: Site
    new: Site
    gain_share: float

    @property
    def distance(self) -> float:
        """Distance that it slid, in units of the scene."""
        if self.old.position is None or self.new.position is None:
            return 0.0
        return math.dist(self.old.position, self.new.position)

    @property
    def turn(self) -> float:
        """Degrees that it turned."""
        if self.old.direction is None or self.new.direction is None:
            return 0.0
        cosine = float(np.dot(self.old.direction, self.new.direction))
        return math.degrees(math.acos(max(-1.0, min(1.0, cosine))))

    @property
    def pose(self) -> Pose:
        """The change as a pose."""
        new, slid = self.new, self.distance > 0
        place = np.array(new.position or (0.0, 0.0, 0.0))
        turned = self.turn > 0 or slid
        target = None if new.direction is None else as_position(place + np.array(new.direction))
        return Pose(
            position=new.position if slid else None,
            target=target if turned else None,
            cutoff=new.cutoff if new.cutoff != self.old.cutoff else None,
            beam=new.beam if new.beam != self.old.beam else None,
        )

    def __str__(self) -> str:
        done = []
        if self.turn >= 0.5:
            done.append(f"turned by {self.turn:.0f}°")
        if self.distance > 0:
            done.append(f"slid by {self.distance:.2g}")
        if self.new.cutoff is not None and self.new.cutoff != self.old.cutoff:
            done.append(f"cone {self.old.cutoff:.0f}° to {self.new.cutoff:.0f}°")
        return f"{self.name}: {', '.join(done)}: {self.gain_share:.0%} of what was missed"


@keywords()
@dataclass(frozen=True)
class Placement:
    """Better places of lights.

    Attributes:
        scene: The scene with these, for a basis and a solve of its own.
        moves: Those worth it, the one that gives most first; none if no move surely gives a
            hundredth of what is missed.
        missed_before: The share of ‖Ψ‖² that the solve misses, estimated on paths that no place was
            fitted to.
        missed_after: The same with the moves.

    Examples:
        >>> solution, scene = lp.solve(basis, target), lp.load_scene("room.xml")
        >>> placement = lp.place(scene, basis, solution, {"bulb": lp.Freedom(within=0.5)})
        >>> placement.missed_after <= placement.missed_before
        True
    """

    scene: Scene
    moves: tuple[Move, ...]
    missed_before: float
    missed_after: float


@keywords()
def place(
    scene: Scene,
    basis: Basis,
    solution: Solution,
    freedoms: Mapping[str, Freedom],
    *,
    seed: int = 0,
    progress: Progress = silent,
) -> Placement:
    """Find places, directions and cones of lights that bring `solution` closest to its painting.

    Light along frozen paths decides (placement/frozen_paths.py); render a basis of the scene that
    is returned and solve again for exact images and weights. Constraints of the solution hold
    throughout.

    Args:
        scene: The scene of `basis`, on the same film or a larger one.
        basis: The basis of the solution, of that one view.
        solution: The solution to improve.
        freedoms: Freedom of lights by name: points, spots and suns of one emitter each.
        seed: Of the paths and the places that are tried.
        progress: Hears how far the work has come.

    Raises:
        SceneError: For lights that are not there or cannot move so, and scenes with fog.

    Examples:
        >>> solution, scene = lp.solve(basis, target), lp.load_scene("room.xml")
        >>> placement = lp.place(scene, basis, solution, {"bulb": lp.Freedom(within=0.5)})
        >>> {move.name for move in placement.moves} <= {"bulb"}
        True
    """
    lights = [free_light(scene, name, freedom) for name, freedom in freedoms.items()]
    names = [light.name for light in basis.lights]
    free = [(light, names.index(light.name)) for light in lights if not light.freedom.is_still]
    small = on_small_film(scene, basis, PIXELS)
    features = render_features(small, seed=seed)

    def search(loaded: Any) -> Found:
        paths = SearchPaths(
            *(
                FrozenPaths(
                    small,
                    loaded,
                    first_hits=first_hits,
                    bounces=bounces,
                    seed=pass_seed(seed, Stream.FROZEN_PATHS, k),
                ).filtered_along(features)
                for k, (first_hits, bounces) in enumerate(SAMPLES)
            )
        )
        spread = free_space(small, loaded, seed=seed).spread
        fit = _fit(basis, solution, small.size)
        return PoseSearch(fit, free, paths, spread=spread or 1.0, seed=seed).run(
            lambda done, total: progress("poses", done, total)
        )

    found = small.while_loaded(search)
    moves = [
        Move(light.name, light.site, site, gain)
        for (light, _), site, gain in zip(free, found.sites, found.gains, strict=True)
        if site != light.site
    ]
    moves.sort(key=lambda move: -move.gain_share)
    return Placement(
        scene.moved({move.name: move.pose for move in moves}) if moves else scene,
        tuple(moves),
        found.before,
        found.after,
    )


def free_light(scene: Scene, name: str, freedom: Freedom) -> FreeLight:
    """Return a light of `scene` with its freedom. Raises SceneError for one that has none."""
    light = scene.light(name)
    if reason := _why_not_searched(light):
        raise SceneError(f"light {name!r} {reason}: no better place can be found for it")
    return FreeLight(name, light.members[0].site, freedom)


def _why_not_searched(light: Light) -> str:
    """Return why a light cannot be searched for, in words that follow its name; "" if it can."""
    if light.is_fixed:
        return "is kept as it is"
    if len(light.members) > 1:
        return f"is {len(light.members)} emitters"
    if light.plugin not in SEARCHED:
        return f"is of the kind {light.plugin}, and only {', '.join(SEARCHED)} are searched"
    if light.unit == MULTIPLE:
        return "has a picture in its beam"
    return ""


def _fit(basis: Basis, solution: Solution, size: tuple[int, int]) -> PlacementFit:
    """Return the fit of the solution's last linear problem on a film of `size`."""
    factor = basis.size[0] // size[0]
    goal, importance = reduced_goal(solution, factor)
    columns = np.stack([block_mean(plane, factor) for plane in basis.planes])
    pixels = size[0] * size[1]

    def flat(image: Floats) -> Floats:
        whole = np.broadcast_to(image, (*image.shape[:-1], 3))
        return whole.reshape(*whole.shape[:-3], pixels, 3)

    return PlacementFit(
        flat(columns),
        flat(goal),
        flat(importance),
        solution.problem.local_reduction,
        pull_with_more(solution, 0),
    )
