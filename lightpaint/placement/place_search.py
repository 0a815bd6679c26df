"""The search for moves of lights, and for new ones, that bring the answer closer; and suggested
lights: new points anywhere, as lights to paste into the scene.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lightpaint.arrays import RGB, Position, as_position, as_rgb
from lightpaint.basis import Basis
from lightpaint.basis.render import why_not_one_pass
from lightpaint.errors import NoPlaceError, SceneError
from lightpaint.keywords import keywords
from lightpaint.lighting import Constraints, Solution
from lightpaint.placement import lights_to_place
from lightpaint.placement.free_space import pixels_of
from lightpaint.placement.freedom import Freedom
from lightpaint.placement.light_changes import AddedLight, Move, Placement, hung
from lightpaint.placement.look_goals import check_looks, check_views, films_of
from lightpaint.placement.new_lights import MirroredPair, NewLights, RiggedLights
from lightpaint.placement.paths.panel_lights import PanelSite, without_panels
from lightpaint.placement.paths.view_paths import SearchPaths
from lightpaint.placement.placement_fit import fit_of
from lightpaint.placement.search import judgement
from lightpaint.placement.search.new_light_search import STARTS, NewLightSearch
from lightpaint.placement.search.pose_search import TURNS, PoseRules, PoseSearch
from lightpaint.placement.suggestion import Suggestion
from lightpaint.progress import Progress, silent
from lightpaint.scene import NewEmitter, Pose, Scene, free_names
from lightpaint.scene.checks.tokens import tag
from lightpaint.scene.properties.site import Site

#: Steps of all lights together along many paths.
STEPS = 10

#: Time of the judgement and its error bars, as a share of all before it.
JUDGED_SHARE = 0.3

#: Errors of a place, relative to the spread of visible points, and of a direction, in degrees,
#: above which a picture says little about a light's pose.
LONG_ERROR, WIDE_ERROR = 0.06, 6.0

#: The default number of suggestions.
SUGGESTED = 3

#: Names of suggested lights begin like this.
SUGGESTED_NAME = "suggested"

#: RMS error below which the current lights reproduce the painting.
NOTHING_MISSED = 0.01


@keywords()
def place(
    scenes: Scene | Sequence[Scene],
    bases: Basis | Sequence[Basis],
    solution: Solution | Sequence[Solution],
    freedoms: Mapping[str, Freedom] | None = None,
    *,
    new: Sequence[NewLights] = (),
    pairs: Sequence[MirroredPair] = (),
    constraints: Constraints | None = None,
    seed: int = 0,
    progress: Progress = silent,
    watch: Callable[[Mapping[str, Site]], None] | None = None,
    is_enough: Callable[[], bool] | None = None,
) -> Placement:
    """Search for the poses of lights that bring `solution` closest to its painting.

    The search uses light along frozen paths. For exact images and weights, render bases of the
    returned scenes and solve again. Constraints of the solution hold throughout.

    Args:
        scenes: The scene of `bases`, on the same film or a larger one; through the sensor of each
            view if there are several.
        bases: The basis of each view of the solution.
        solution: The solution to improve. For several looks that share places, give the solution of
            each; each keeps its own weights. A look counts by its relative error; `bases` are of
            the views of all.
        freedoms: Freedom of lights by name: points, spots, suns and panels of one emitter each. A
            panel is a rectangle or disk; the search has it as a square of its area.
        new: Lights that may be added.
        pairs: Lights that stay mirror images of each other.
        constraints: Constraints on the new lights, by their generated names; constraints of the
            solution hold for the others.
        seed: Of the paths and the trial places.
        progress: Receives progress.
        watch: Receives the trial poses, by the names of their lights.
        is_enough: Ends the search once it returns True, with the best poses so far, which are
            judged as usual but have no error bars.

    Raises:
        SceneError: For lights that do not exist or cannot move like this, freedoms without a free
            place, and scenes with fog.

    Examples:
        >>> solution, scene = lp.solve(basis, target), lp.load_scene("room.xml")
        >>> placement = lp.place(scene, basis, solution, {"bulb": lp.Freedom(within=0.5)})
        >>> {move.name for move in placement.moves} <= {"bulb"}
        True
    """
    rigged = RiggedLights(freedoms or {}, tuple(new), tuple(pairs), constraints or Constraints())
    return place_rigged(
        scenes,
        bases,
        solution,
        rigged,
        seed=seed,
        progress=progress,
        watch=watch,
        is_enough=is_enough,
    )


def place_rigged(
    scenes: Scene | Sequence[Scene],
    bases: Basis | Sequence[Basis],
    solution: Solution | Sequence[Solution],
    rigged: RiggedLights,
    *,
    seed: int = 0,
    progress: Progress = silent,
    watch: Callable[[Mapping[str, Site]], None] | None = None,
    is_enough: Callable[[], bool] | None = None,
) -> Placement:
    """Search as `place` does, with the same arguments but for the lights that may move."""
    views = check_views(scenes, bases)
    scene, view_bases = views[0][0], [basis for _, basis in views]
    looks = check_looks(solution, view_bases)
    for name, freedom in rigged.freedoms.items():
        lights_to_place.free_light(scene, name, freedom)
    lights, names = (
        lights_to_place.new_lights_of(scene, rigged.new),
        [light.name for light in view_bases[0].lights],
    )
    # Only paths are traced in these: a panel that moves must not hide where it hung.
    small, large = ([without_panels(x, rigged.moving) for x in films] for films in films_of(views))

    def search(loaded: Any) -> _Result:
        paths = SearchPaths(small, large, loaded, seed=seed)
        if not len(paths.space.points):
            raise NoPlaceError(f"the camera of {scene.path} sees nothing that light falls on")
        movables = lights_to_place.movables_of(scene, names, rigged, paths, seed=seed)
        slots = lights_to_place.new_movables_of(scene, lights, len(names), paths, seed=seed)
        with_panels = any(isinstance(x.light.site, PanelSite) for x in (*movables, *slots))
        coarse, fine = (
            fit_of(
                view_bases,
                looks,
                [x.size for x in films],
                [light.as_basis_light for light in lights],
                rigged.constraints,
                with_panels=with_panels,
                with_noise=films is large,
            )
            for films in (small, large)
        )
        poses = PoseSearch(coarse, paths, PoseRules(paths), seed=seed)
        if watch is not None:
            poses.steps.watch = lambda arrangement: watch(_sites_by_name(arrangement, names))
        if is_enough is not None:
            poses.steps.is_enough = is_enough
        judge = judgement.PlacementJudge(fine, poses.steps.with_fit(fine), paths)
        stages = _Stages(progress, TURNS * len(movables), STARTS * len(slots), STEPS)
        start, best = _searched(poses, judge, movables, slots, stages)
        judge = judge.without_noise(best)
        found = judge.worthwhile(start, best)
        # Error bars take a quarter of the time, which nobody has who ends a search early.
        with_errors = not poses.is_enough()
        result = _Result.of(found, judge, paths, large[0], with_errors=with_errors)
        stages.end()
        return result

    result = large[0].while_loaded(search, views=large[1:])
    return _placement([x for x, _ in views], result, lights, names)


@dataclass(frozen=True)
class _Result:
    """The result of a search on small films, the first one of `size`.

    errors: of poses and levels. seen: of each movable, its place in the first picture. growth: the
    best lighting with none, one … of the new lights, largest gain first.
    """

    found: judgement.Found
    errors: judgement.ArrangementError
    seen: Sequence[tuple[float, float] | None]
    growth: list[judgement.Growth]
    spread: float
    size: tuple[int, int]

    @classmethod
    def of(
        cls,
        found: judgement.Found,
        judge: judgement.PlacementJudge,
        paths: SearchPaths,
        view: Scene,
        *,
        with_errors: bool,
    ) -> "_Result":
        """Return what was found, with what the first view says about it."""
        order, sites = _additions(found), found.arrangement.sites
        places = [site.position or (0.0, 0.0, 0.0) for site in sites]
        # They take a quarter of the whole search's time, and nobody asks where lights have stayed.
        is_changed = bool(order) or any(
            site != movable.light.site
            for movable, site in zip(found.arrangement.movables, sites, strict=True)
        )
        errors = (
            judge.errors(found.arrangement)
            if is_changed and with_errors
            else judgement.ArrangementError(
                [judgement.PoseError(None, None)] * len(sites), np.zeros((0, 3))
            )
        )
        return cls(
            found,
            errors,
            pixels_of(view, paths.loaded, np.array(places, dtype=float).reshape(-1, 3)),
            judge.growth(found.arrangement, order) if order else [],
            paths.space.spread or 1.0,
            view.size,
        )

    def is_hardly_visible(self, k: int) -> bool:
        """Return whether the picture says little about the place of movable `k`."""
        error = self.errors.poses[k]
        is_long = error.place is not None and error.place > LONG_ERROR * self.spread
        return is_long or (error.turn is not None and error.turn > WIDE_ERROR)

    def grown(self, k: int) -> dict[str, Any]:
        """Return the `k`-th new light, with the pictures without and with it."""
        pixels = self.size[0] * self.size[1]
        pictures = [step.picture[:pixels].reshape(*self.size, 3) for step in self.growth[k : k + 2]]
        return {
            "missed_share": self.growth[k + 1].missed,
            "without": pictures[0],
            "with_it": pictures[1],
        }


class _Stages:
    """Progress through stages, each of which may end before all of its steps are done.

    counts: the largest number of steps of each stage. The judgement follows them.
    """

    def __init__(self, progress: Progress, *counts: int) -> None:
        self._progress = progress
        self._ends = [0, *np.cumsum(counts).tolist()]
        self._total = math.ceil((1 + JUDGED_SHARE) * self._ends[-1])
        self._reported = -1

    def begin(self) -> Callable[[], None]:
        """Begin the next stage, and return a function that counts its steps."""
        done, *self._ends = self._ends
        end = self._ends[0] if self._ends else done
        self._report(done)

        def count() -> None:
            nonlocal done
            done = min(done + 1, end)
            self._report(done)

        return count

    def end(self) -> None:
        """Report the end."""
        self._report(self._total)

    def _report(self, done: int) -> None:
        """Report progress, once each, since a stage may have no steps."""
        if done > self._reported:
            self._reported = done
            self._progress("poses", done, self._total)


def _sites_by_name(
    arrangement: lights_to_place.Arrangement, names: Sequence[str]
) -> dict[str, Site]:
    """Return the pose of each light of movables, by name. names: of the lights of the scene."""
    sites = {}
    for movable, site in zip(arrangement.movables, arrangement.sites, strict=True):
        sites[movable.light.name] = site
        if movable.mirror is not None:
            sites[names[movable.columns[1]]] = movable.mirror.site(site)
    return sites


def _additions(found: judgement.Found) -> list[int]:
    """Return the indices of the new lights among the movables, largest gain first."""
    new = [k for k, movable in enumerate(found.arrangement.movables) if movable.group is not None]
    return sorted(new, key=lambda k: -found.gains[k])


def _searched(
    poses: PoseSearch,
    judge: judgement.PlacementJudge,
    movables: list[lights_to_place.Movable],
    slots: list[lights_to_place.Movable],
    stages: _Stages,
) -> tuple[lights_to_place.Arrangement, lights_to_place.Arrangement]:
    """Return the arrangement before all moves, and the best one."""
    paths, steps, sites = poses.paths, poses.steps, tuple(x.light.site for x in movables)
    start = lights_to_place.Arrangement(
        tuple(movables), sites, steps.fitted(movables, sites, paths.compare)
    )
    # Until here paths are traced and kernels compiled, whose time says nothing about the rest.
    found = poses.by_blocks(start, stages.begin())
    count = stages.begin()
    if slots:
        found = NewLightSearch(poses, slots, judge).run(found, count)
    found = judge.without_noise(found).refined(found, STEPS, progress=stages.begin())
    stages.begin()
    return start, found


def _placement(
    scenes: Sequence[Scene],
    result: _Result,
    lights: Sequence[lights_to_place.NewLight],
    names: Sequence[str],
) -> Placement:
    """Return the placement of a search result. names: of the lights of the basis."""
    found, moves, additions = result.found, list[Move](), list[AddedLight]()
    arrangement, order = found.arrangement, _additions(found)
    for k, (movable, site) in enumerate(zip(arrangement.movables, arrangement.sites, strict=True)):
        about: dict[str, Any] = {
            "gain_share": found.gains[k],
            "place_error": result.errors.poses[k].place,
            "turn_error": result.errors.poses[k].turn,
            "is_hardly_visible": result.is_hardly_visible(k),
        }
        if movable.group is not None:
            weight = arrangement.fitted.weights[movable.columns[0]]
            emitter = _emitter(lights[movable.columns[0] - len(names)], site, weight)
            about |= result.grown(order.index(k))
            additions.append(AddedLight(emitter, **about, seen_at=result.seen[k]))
        elif site != movable.light.site:
            about["is_slid_to_end"] = movable.light.is_slid_to_end(site)
            about["is_turned_to_end"] = movable.light.is_turned_to_end(site)
            pair = [movable.light.name]
            if movable.mirror is not None:
                pair.append(scenes[0].lights[movable.columns[1]].name)
            for name, new_site in zip(pair, movable.sites(site), strict=True):
                old = scenes[0].light(name).members[0].site
                about["mirrors"] = "" if name == pair[0] else pair[0]
                moves.append(Move(name, old, new_site.without_shape, **about))
    moves.sort(key=lambda move: -move.gain_share)
    additions.sort(key=lambda light: -light.gain_share)
    placed = hung(scenes, moves, additions)
    all_names = (*names, *(light.name for light in lights))
    levels = zip(all_names, result.errors.levels.tolist(), strict=False)
    return Placement(
        tuple(placed),
        tuple(moves),
        tuple(additions),
        found.before,
        found.after,
        level_errors=tuple((name, as_rgb(errors)) for name, errors in levels if any(errors)),
    )


def _emitter(light: lights_to_place.NewLight, site: Site, weight: Any) -> NewEmitter:
    """Return a new light at the place that was found."""
    place = np.array(site.position, dtype=float)
    target = None if site.direction is None else as_position(place + np.array(site.direction))
    pose = Pose(position=as_position(place), target=target, cutoff=site.cutoff, beam=site.beam)
    size = (site.side, site.side) if isinstance(site, PanelSite) else None
    return NewEmitter(light.name, light.kind, pose, size, as_rgb(weight))


@keywords()
def suggest_lights(
    scenes: Scene | Sequence[Scene],
    bases: Basis | Sequence[Basis],
    solution: Solution,
    *,
    count: int = SUGGESTED,
    seed: int = 0,
    progress: Progress = silent,
) -> tuple[Suggestion, ...]:
    """Suggest point lights that would bring `solution` closest to its painting, the best first.

    This is `lp.place` with new points in all free space, while the lights of the scene stay.

    Args:
        scenes: The scene of `bases`, on the same film or a larger one; through the sensor of each
            view if there are several, which all count.
        bases: The basis of each view of the solution.
        solution: The solution to improve. Pictures of suggestions show its first view.
        count: Maximum number of suggestions; none if no light reliably removes 1 % of the error.
        seed: Of the paths and the trial places.
        progress: Receives progress.

    Raises:
        SceneError: For scenes with fog or another medium, or with an integrator or a variant whose
            paths cannot be traced.

    Examples:
        >>> lp.suggest_lights(lp.load_scene("room.xml"), basis, lp.solve(basis, target))
        ()
    """
    if count < 1:
        raise SceneError(f"{count} lights cannot be suggested: ask for one or more")
    scene = check_views(scenes, bases)[0][0]
    check_suggestible(scene)
    norm2 = float(solution.norm2.sum())
    if sum(solution.certificate.objective) <= NOTHING_MISSED**2 * norm2:
        return ()
    new = NewLights("point", count=count, name=SUGGESTED_NAME)
    try:
        placement = place(scenes, bases, solution, new=[new], seed=seed, progress=progress)
    except NoPlaceError:
        return ()
    names = free_names(SUGGESTED_NAME, len(placement.additions), [x.name for x in scene.emitters])
    # Gains refer to all that is missed, noise and what small films do not show included. Energies
    # are of the last linear problem, since the loss of a display fit has another scale.
    norm2 = float(solution.equations.target_norm2.sum())
    scale = placement.missed_before * norm2 / solution.energy
    return _suggestions(placement, names, scale)


def check_suggestible(scene: Scene) -> None:
    """Raise SceneError, before rendering, for a scene in which no lights can be suggested."""
    if reason := why_not_one_pass(scene):
        raise SceneError(
            f"suggesting lights needs paths of the integrator path, and {reason}: leave it out, or "
            "use that integrator and a variant like llvm_ad_rgb"
        )
    if scene.has_media:
        raise SceneError(f"{scene.path} has fog or the like: no lights can be suggested in it")


def _suggestions(
    placement: Placement, names: Sequence[str], scale: float
) -> tuple[Suggestion, ...]:
    """Return the new lights of a placement, renamed in the order of their gains.

    scale: the part of the error that the search saw, by which its shares are multiplied.
    """
    suggestions = []
    for name, light in zip(names, placement.additions, strict=True):
        emission = as_rgb(f"{v:.4g}" for v in light.emitter.emission)
        position = as_position(f"{v:.6g}" for v in light.site.position or ())
        assert light.without is not None
        assert light.with_it is not None
        suggestions.append(
            Suggestion(
                name=name,
                position=position,
                emission=emission,
                gain_share=scale * light.gain_share,
                missed_share=1 - scale * (1 - light.missed_share / placement.missed_before),
                xml=emitter_xml(name, position, emission),
                seen_at=light.seen_at,
                without=light.without,
                with_it=light.with_it,
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
