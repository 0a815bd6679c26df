"""Lights that a search moves or adds: with their freedoms resolved against the loaded scene, and in
their current poses.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Floats, Position, as_position
from lightpaint.basis import BasisLight
from lightpaint.display_text import some_names, with_similar_name
from lightpaint.errors import NoPlaceError, SceneError
from lightpaint.luminaires import LUMINAIRE_PLUGINS
from lightpaint.placement.freedom import Freedom, FreeLight, places_of
from lightpaint.placement.new_lights import (
    NEW_CONE,
    Mirror,
    MirroredPair,
    NewLights,
    RiggedLights,
)
from lightpaint.placement.paths.panel_lights import PanelSite, is_panel, panel_site
from lightpaint.placement.paths.view_paths import SearchPaths
from lightpaint.placement.permitted_places import BoxOfPlaces, Places, places_on
from lightpaint.placement.placement_fit import Fitted
from lightpaint.scene import MULTIPLE, PLUGIN_OF, PLUGINS, Emitter, Light, Scene, free_names
from lightpaint.scene.properties.site import NewKind, Site

#: Plugins whose light can be computed along frozen paths.
SEARCHED = ("point", "spot", "directional")

#: Smallest and largest side of new panels, relative to the spread of visible points.
SIDES = (0.06, 0.5)

#: Initial width of a new spot's beam, as a share of its cone.
FIRST_BEAM = 0.7

#: Number of random places of a freedom that are tested for free space.
TESTED = 200


@dataclass(frozen=True)
class Movable:
    """A light, or a mirrored pair of lights, which move as one.

    columns: their indices among the columns of the fit. mirror: of the second; None for one light.
    group: group of new lights; None for an existing light.
    """

    light: FreeLight
    columns: tuple[int, ...]
    mirror: Mirror | None = None
    group: NewLights | None = None

    def sites(self, site: Site) -> list[Site]:
        """Return the place of each of its lights. site: of the first."""
        return [site] if self.mirror is None else [site, self.mirror.site(site)]


@dataclass(frozen=True)
class Arrangement:
    """Movables with their poses, and the best lighting for these."""

    movables: tuple[Movable, ...]
    sites: tuple[Site, ...]
    fitted: Fitted

    @property
    def missed(self) -> float:
        """The loss of the best lighting, with the pull of the constraints."""
        return self.fitted.missed

    def with_site(self, k: int, site: Site, fitted: Fitted) -> "Arrangement":
        """Return the arrangement with another pose of movable `k`."""
        return replace(self, sites=(*self.sites[:k], site, *self.sites[k + 1 :]), fitted=fitted)

    def with_movable(self, movable: Movable, site: Site, fitted: Fitted) -> "Arrangement":
        """Return the arrangement with another movable at the end."""
        return Arrangement((*self.movables, movable), (*self.sites, site), fitted)

    def without(self, k: int, fitted: Fitted) -> "Arrangement":
        """Return the arrangement without movable `k`."""
        return Arrangement(
            (*self.movables[:k], *self.movables[k + 1 :]),
            (*self.sites[:k], *self.sites[k + 1 :]),
            fitted,
        )


def all_sites(movables: Sequence[Movable], sites: Sequence[Site]) -> list[Site]:
    """Return the places of all lights of movables, in their order."""
    return [
        site
        for movable, site_of_movable in zip(movables, sites, strict=True)
        for site in movable.sites(site_of_movable)
    ]


def by_column(movables: Sequence[Movable], columns: Floats) -> Mapping[int, Floats]:
    """Return columns of all lights of movables, in their order, by their indices in the fit."""
    numbers = [k for movable in movables for k in movable.columns]
    return dict(zip(numbers, columns, strict=True))


@dataclass(frozen=True)
class NewLight:
    """A light that may be added. kind: of emitter."""

    name: str
    kind: NewKind
    group: NewLights

    @property
    def as_basis_light(self) -> BasisLight:
        """The light in the form that constraints use."""
        plugin = PLUGIN_OF[self.kind]
        parameter, unit = PLUGINS[plugin]
        return BasisLight(self.name, plugin, parameter, unit, (0.0, 0.0, 0.0))


def new_lights_of(scene: Scene, groups: Sequence[NewLights]) -> list[NewLight]:
    """Return the lights that may be added, with unused names."""
    used_names = {*(x.name for x in scene.emitters), *(x.name for x in scene.lights)}
    new_lights: list[NewLight] = []
    for group in groups:
        kind = group.kind if group.like is None else _kind_like(scene, group.like)
        group.check_kind(kind)
        names = [group.name]
        if group.count > 1 or group.name in used_names:
            names = free_names(group.name, group.count, used_names)
        used_names |= {*names}
        new_lights += [NewLight(name, kind, group) for name in names]
    return new_lights


def movables_of(
    scene: Scene,
    names: Sequence[str],
    rigged: RiggedLights,
    paths: SearchPaths,
    *,
    seed: int,
) -> list[Movable]:
    """Return the lights of `scene` that may move. names: of the lights, in the basis's order.

    Raises NoPlaceError for a light that may hang only where nothing of the picture is seen.
    """
    followers = followers_of(scene, rigged.freedoms, rigged.pairs)
    movables = []
    for name, freedom in rigged.freedoms.items():
        if freedom.is_still or name in {x.lights[1] for x in rigged.pairs}:
            continue
        site = _site(scene, name)
        light = FreeLight(name, site, freedom, _places(scene, site, freedom, paths, seed))
        _check_places(light, paths, seed)
        follower = followers.get(name)
        columns = [names.index(name)]
        if follower is not None:
            columns.append(names.index(follower.lights[1]))
        mirror = None if follower is None else follower.plane
        movables.append(Movable(light, tuple(columns), mirror))
    return movables


def new_movables_of(
    scene: Scene, lights: Sequence[NewLight], first: int, paths: SearchPaths, *, seed: int
) -> list[Movable]:
    """Return the lights that may be added. first: the index of the first one's column.

    Raises SceneError for lights whose freedom has no free place.
    """
    movables = []
    templates: dict[int, FreeLight] = {}
    for k, light in enumerate(lights):
        if id(light.group) not in templates:
            templates[id(light.group)] = _template(scene, light, paths, seed)
        free = replace(templates[id(light.group)], name=light.name)
        movables.append(Movable(free, (first + k,), None, light.group))
    return movables


def free_light(scene: Scene, name: str, freedom: Freedom) -> FreeLight:
    """Return a light of `scene` with its freedom, its surfaces not resolved.

    Raises SceneError for an unknown light, or one that cannot move like this.
    """
    return FreeLight(name, _site(scene, name), freedom)


def why_not_searched(light: Light) -> str:
    """Return why a light cannot be searched for, in words that follow its name; "" if it can."""
    if light.is_fixed:
        return "is fixed"
    if len(light.members) > 1:
        return f"is a group of {len(light.members)} emitters"
    if is_panel(light):
        return ""
    if light.plugin == "area" and light.unit != MULTIPLE:
        return "is an area light, and only rectangles and disks can move"
    if light.plugin in LUMINAIRE_PLUGINS:
        return (
            "is a luminaire, which stays where it hangs (search with its photometry left out of "
            "the lights file, or a spot in its stead, and hang it at the place that is found)"
        )
    if light.plugin not in SEARCHED and light.plugin != "area":
        return f"is of the kind {light.plugin}, and only {', '.join(SEARCHED)} and panels can move"
    if light.unit == MULTIPLE:
        return "shows a picture"
    return ""


def _site(scene: Scene, name: str) -> Site:
    light = scene.light(name)
    if reason := why_not_searched(light):
        raise SceneError(f"light {name!r} {reason}: no better place can be found for it")
    site = light.members[0].site
    return panel_site(scene, light, site) if is_panel(light) else site


def _places(
    scene: Scene, site: Site, freedom: Freedom, paths: SearchPaths, seed: int
) -> Places | None:
    if site.position is None:
        return None
    surfaces = _surfaces(scene, freedom, paths, seed)
    return places_of(freedom, np.array(site.position, dtype=float), surfaces)


def _check_places(light: FreeLight, paths: SearchPaths, seed: int) -> None:
    """Raise NoPlaceError if no place of a light sees the picture, and it hangs at none of them."""
    if light.site.position is None or light.places is None:
        return
    position = np.array(light.site.position, dtype=float)
    if np.allclose(light.places.nearest(position), position, atol=1e-6):
        return
    tested = light.places.random(TESTED, np.random.default_rng(seed))
    # Steps may bring a light of the scene close to surfaces, so that they need not be clear.
    if not paths.usable(tested, 0.0).any():
        raise NoPlaceError(_no_place(f"light {light.name!r}"))


def _no_place(subject: str) -> str:
    return f"{subject} has no free place that sees anything of the picture: give it more freedom"


def _surfaces(scene: Scene, freedom: Freedom, paths: SearchPaths, seed: int) -> Places | None:
    """Return the places on the surfaces of a freedom; None if it has none."""
    if freedom.surfaces is None:
        return None
    return places_on(
        scene, paths.loaded, freedom.surfaces, paths.space, clear=freedom.clear, seed=seed
    )


def followers_of(
    scene: Scene, freedoms: Mapping[str, Freedom], pairs: Sequence[MirroredPair]
) -> dict[str, MirroredPair]:
    """Return pairs by the names of their first lights. Raises SceneError for impossible ones."""
    followers: dict[str, MirroredPair] = {}
    named: set[str] = set()
    for pair in pairs:
        first, second = pair.lights
        one, other = (_site(scene, name) for name in pair.lights)
        if scene.light(first).plugin != scene.light(second).plugin:
            raise SceneError(f"{first!r} and {second!r} are of two kinds: they are not a pair")
        if repeated := named & {first, second}:
            raise SceneError(f"light {min(repeated)!r} is in two pairs: it has one mirror image")
        named |= {first, second}
        if first not in freedoms:
            raise SceneError(f"{first!r} leads a pair and has no freedom: give it one")
        has_alike_beams = freedoms[first].beams is not None or one.beam == other.beam
        if freedoms[first].cone is None and not (one.cutoff == other.cutoff and has_alike_beams):
            raise SceneError(f"{first!r} and {second!r} have two cones: free the cone of the first")
        followers[first] = pair
    return followers


def _kind_like(scene: Scene, name: str) -> NewKind:
    """Return the kind of new lights that are like one of the scene."""
    kinds = {plugin: kind for kind, plugin in PLUGIN_OF.items()}
    names = [light.name for light in scene.lights]
    if name not in names:
        # On the command line a kind stands in the same place as a light.
        listing = f"there are the kinds {', '.join(PLUGIN_OF)}, and the lights {some_names(names)}"
        hint = with_similar_name(listing, name, [*PLUGIN_OF, *names])
        raise SceneError(f"no light {name!r} that new ones could be like; {hint}")
    light = scene.light(name)
    if len(light.members) > 1 or light.plugin not in kinds or light.is_scalar:
        raise SceneError(f"new lights are like a point, a spot or a panel, and {name!r} is not one")
    return kinds[light.plugin]


def _template(scene: Scene, light: NewLight, paths: SearchPaths, seed: int) -> FreeLight:
    """Return a light of a group, at some place of its freedom."""
    group = light.group
    freedom, places = _freedom_of_new(scene, group.freedom, paths, seed)
    tested = places.random(TESTED, np.random.default_rng(seed))
    is_free = paths.usable(tested, None if freedom.clear is None else 0.9 * freedom.clear)
    if light.group.is_kept_out_of_view(is_panel=light.kind == "panel"):
        is_free &= ~paths.in_view(tested)
    if not is_free.any():
        raise NoPlaceError(_no_place(f"new light {light.name!r}"))
    position = as_position(tested[int(np.argmax(is_free))])
    if light.kind == "point":
        return FreeLight(light.name, Site(position), freedom, places)
    model = None if group.like is None else scene.light(group.like).members[0]
    freedom = replace(freedom, aim=freedom.aim or True)
    if light.kind == "panel":
        sides = _panel_sides(group, model, paths.space.spread)
        panel = PanelSite(position, _first_direction(model), side=math.sqrt(math.prod(sides)))
        return FreeLight(light.name, panel, freedom, places, sides if sides[1] > sides[0] else None)
    if model is not None:
        cutoff, beam = model.site.cutoff or 0.0, model.site.beam or 0.0
    else:
        cone = freedom.cone or NEW_CONE
        freedom = replace(freedom, cone=cone, beam=freedom.beam or True)
        cutoff = math.sqrt(cone[0] * cone[1])
        beam = FIRST_BEAM * cutoff
    spot = Site(position, _first_direction(model), cutoff=cutoff, beam=beam)
    return FreeLight(light.name, spot, freedom, places)


def _freedom_of_new(
    scene: Scene, freedom: Freedom, paths: SearchPaths, seed: int
) -> tuple[Freedom, Places]:
    """Return the freedom of new lights with their places: all free space, unless it says where.

    Raises NoPlaceError if there is no free space.
    """
    space = paths.space
    if freedom.slides:
        return freedom, places_of(freedom, np.zeros(3), _surfaces(scene, freedom, paths, seed))
    if not len(space.places):
        raise NoPlaceError(f"{scene.path} has no free place that sees anything of the picture")
    low, high = space.places.min(axis=0), space.places.max(axis=0)
    freedom = replace(freedom, box=(as_position(low), as_position(high)))
    return freedom, BoxOfPlaces(low, high, space.places)


def _first_direction(model: Emitter | None) -> Position:
    """Return the direction of the light that new ones are like, or else downwards."""
    direction = None if model is None else model.site.direction
    return (0.0, -1.0, 0.0) if direction is None else direction


def _panel_sides(group: NewLights, model: Emitter | None, spread: float) -> tuple[float, float]:
    """Return the smallest and largest side of new panels. spread: of visible points."""
    if group.size is not None:
        return group.size
    if model is not None and model.unit_flux is not None:
        side = math.sqrt(model.unit_flux / math.pi)
        return side, side
    return SIDES[0] * spread, SIDES[1] * spread
