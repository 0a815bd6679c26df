"""The lights of the painted scene with their places, and their planes at any place: bases in which
some lights have moved have new planes for them, and the old ones for the others.
"""

import json
from collections import OrderedDict
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from threading import RLock
from typing import Any

import numpy as np

from lightpaint import placement
from lightpaint.arrays import Doubles, Floats, Position
from lightpaint.basis import (
    Basis,
    BasisLight,
    IndirectLight,
    Lights,
    MemoryPlanes,
    PlaneReference,
    Planes,
    compose_planes,
    is_large,
)
from lightpaint.errors import PaintError, SceneError
from lightpaint.images import Features
from lightpaint.paint.protocol import Camera, LightPlace, Place, PlanObject, Rig, SkyAxes
from lightpaint.paint.rig import page_geometry
from lightpaint.paint.rig.added_lights import POSE_KEYS, light_of_new, new_emitter, site_of_new
from lightpaint.paint.rig.quick_planes import QuickPlanes
from lightpaint.paint.session.moved_lights import Placed, added_names
from lightpaint.paint.subject import Subject, view_at
from lightpaint.scene import Pose, Scene, motion_of, render_features
from lightpaint.scene.properties.site import Site
from lightpaint.scene.runtime.render_lock import MITSUBA
from lightpaint.sentences import Hint

#: Number of rendered planes, each of all views, that are cached for undo.
MAX_RENDERED = 32

#: A light and its pose, as text.
PoseKey = tuple[str, str]

#: Number of places that are kept, which grows with each step of a drag.
MAX_KNOWN = 1024


@dataclass(frozen=True)
class RigView:
    """A view of the loaded scene. features: of each pixel, with positions."""

    scene: Scene
    loaded: Any
    features: Features

    @cached_property
    def quick(self) -> QuickPlanes:
        """The quick planes, whose paths are traced on first use; that takes longer than to load."""
        with page_geometry.in_this_thread():
            return QuickPlanes(self.scene, self.loaded, self.features)

    @cached_property
    def seen_points(self) -> Floats:
        """The visible points of surfaces, (n, 3)."""
        assert self.features.position is not None
        return np.asarray(self.features.position[self.features.normal.any(axis=-1)])


def open_view(subject: Subject, basis: Basis) -> RigView:
    """Load the scene of a view."""
    scene = subject.loaded_scene
    loaded, features = scene.load(), basis.features
    if features is None or features.position is None:
        features = render_features(scene)
    return RigView(scene, loaded, features)


class LampRig:
    """The rig of a session: the source of the planes of moved lights.

    Scene and paths are loaded on first use. Bases are of all views, with every light at its place
    in the scene.

    Attributes:
        subjects: The views to be painted.
        views: The views of the loaded scene; None before it is loaded.
        step: While lights are dragged, their quick planes have every step-th pixel of every
            step-th row, repeated.
    """

    def __init__(self, subjects: Sequence[Subject]) -> None:
        self.subjects = tuple(subjects)
        self._lock = RLock()
        self.views: tuple[RigView, ...] | None = None
        self._rendered = OrderedDict[PoseKey, list[Basis]]()
        self._known_places: dict[PoseKey, LightPlace] = {}
        self.step, self._drafts = 1, set[str]()
        self._freedoms: Mapping[str, placement.Freedom] | None = None

    @property
    def scene(self) -> Scene:
        """The scene of the first view. Raises PaintError without one."""
        if self.subjects[0].scene is None:
            raise PaintError("there is no scene to render: its lights cannot be moved")
        return self.subjects[0].loaded_scene

    @property
    def freedoms(self) -> Mapping[str, placement.Freedom]:
        """Freedom of the lights that the lights file lets move, by name."""
        if self._freedoms is None:
            self._freedoms = placement.freedoms_of(self.rigging, self.scene)
        return self._freedoms

    @cached_property
    def rigging(self) -> placement.Rigging:
        """The rigging of the lights file."""
        return placement.rigging_of(self.scene.requests)

    @cached_property
    def surfaces(self) -> tuple[str, ...]:
        """Names of rails, surfaces and shapes that new lights may hang on."""
        return placement.surfaces_of(self.rigging, self.scene)

    @cached_property
    def cameras(self) -> tuple[Camera | None, ...]:
        """The camera of each view; None for one that is not a pinhole. The rig is open."""
        assert self.views is not None
        with page_geometry.in_this_thread():
            return tuple(page_geometry.camera_of(view.scene, view.loaded) for view in self.views)

    @cached_property
    def bounds(self) -> tuple[Doubles, Doubles] | None:
        """Corners of a box around all that the views see; None if they see nothing."""
        assert self.views is not None
        seen = [view.seen_points for view in self.views if len(view.seen_points)]
        if not seen:
            return None
        low, high = (
            np.min([x.min(axis=0) for x in seen], axis=0),
            np.max([x.max(axis=0) for x in seen], axis=0),
        )
        return low.astype(float), high.astype(float)

    @cached_property
    def plan_objects(self) -> tuple[PlanObject, ...]:
        """Outlines of objects from above, within `bounds`, the largest first. The rig is open."""
        assert self.views is not None
        low, high = self.bounds or (np.zeros(3), np.ones(3))
        view = self.views[0]
        with page_geometry.in_this_thread():
            return page_geometry.plan_objects(
                view.scene, view.loaded, page_geometry.up_axis(self.cameras), low, high
            )

    @cached_property
    def skies(self) -> tuple[SkyAxes, ...]:
        """Axes of the skies among its images. The rig is open."""
        with page_geometry.in_this_thread():
            return page_geometry.sky_axes(self.scene)

    @property
    def extent(self) -> float:
        """Diagonal of the visible scene; 1 before the rig is open."""
        low, high = (self.bounds if self.is_open else None) or (np.zeros(3), np.ones(3) / 3**0.5)
        return float(np.linalg.norm(high - low))

    @property
    def is_open(self) -> bool:
        """True if the scene is loaded."""
        return self.views is not None

    def open(self, bases: Sequence[Basis]) -> None:
        """Load the scene, unless it is loaded."""
        with self._lock:
            if self.views is None:
                # With a kept basis no scene has been read yet, and Mitsuba has no variant.
                for subject in self.subjects:
                    subject.loaded_scene  # noqa: B018 (it is cached)
                with page_geometry.in_this_thread():
                    self.views = tuple(map(open_view, self.subjects, bases))

    def trace_paths(self) -> None:
        """Trace the paths of quick planes of the open rig, before the first light is dragged."""
        assert self.views is not None
        if not self.scene.has_media:
            for view in self.views:
                with self._lock:
                    view.quick  # noqa: B018 (it is cached)

    # Poses

    def check(self, placed: Placed) -> None:
        """Raise LightpaintError for impossible places of lights."""
        for name, values in placed.items():
            self.site(name, values)

    def lights(self, lights: Lights, placed: Placed) -> Lights:
        """Return the lights of the scene, followed by added ones."""
        added = [light_of_new(new_emitter(x, placed[x])) for x in added_names(placed)]
        return replace(lights, records=(*lights, *added))

    def why_not(self, name: str, values: Mapping[str, Any] | None = None) -> str:
        """Return why a light cannot be moved, in words that follow its name; "" if it can.

        values: of an added light.
        """
        scene = self.scene
        if scene.has_media:
            return "stands in a scene with fog or the like"
        if scene.is_spectral:
            return "is rendered with its spectrum"
        if values and "kind" in values:
            return ""
        light = scene.light(name)
        return placement.why_not_searched(light)

    def site(self, name: str, values: Mapping[str, Any]) -> Site:
        """Return the place of a light in a pose. Raises LightpaintError for an impossible one."""
        if "kind" in values:
            if self.scene.has_media:
                raise PaintError(f"{name} stands in fog or the like: it cannot be hung here")
            if self.scene.is_spectral:
                raise PaintError(
                    f"{name} has no spectrum: it cannot be hung where lights are rendered with "
                    "theirs; open the scene without ",
                    Hint("spectral", True),
                )
            return site_of_new(new_emitter(name, values))
        light = self.scene.light(name)
        if reason := self.why_not(name):
            raise PaintError(f"{name} {reason}: it cannot be moved here")
        site = light.members[0].site
        if values:
            site = motion_of(name, light.plugin, site, _pose(name, values)).site
        return placement.panel_site(self.scene, light, site) if placement.is_panel(light) else site

    def directions(self, placed: Placed) -> dict[str, Position]:
        """Return where the lights of the scene point, by name; only of those that point somewhere.

        Of a group, this is where its first emitter does.
        """
        found = {}
        for light in self.scene.lights:
            values = placed.get(light.name)
            site = self.site(light.name, values) if values else light.members[0].site
            if site.direction is not None:
                found[light.name] = site.direction
        return found

    def moved_scene(self, placed: Placed, view: int = 0) -> Scene:
        """Return the scene of a view with lights moved and added."""
        scene, added = self.subjects[view].loaded_scene, added_names(placed)
        named = {name: _pose(name, values) for name, values in placed.items() if name not in added}
        scene = scene.moved(named) if named else scene
        emitters = [new_emitter(name, placed[name]) for name in added]
        return scene.with_new_emitters(emitters) if emitters else scene

    # Planes

    def bases(self, bases: Sequence[Basis], placed: Placed) -> list[Basis]:
        """Return the bases with planes of placed lights: rendered ones, or else quick ones."""
        if not placed:
            return list(bases)
        moved = {name: self._planes(bases, name, values) for name, values in placed.items()}
        is_rendered = all(self._is_rendered(name, values) for name, values in placed.items())
        names = (*bases[0].names, *added_names(placed))
        return [
            with_planes_of(
                basis,
                {names.index(name): planes[k] for name, planes in moved.items()},
                in_memory=is_rendered,
            )
            for k, basis in enumerate(bases)
        ]

    def _planes(self, bases: Sequence[Basis], name: str, values: Mapping[str, Any]) -> list[Basis]:
        """Return the plane of a light with a pose in each view."""
        key = _pose_key(name, values)
        with self._lock:
            if (rendered := self._rendered.get(key)) is not None:
                self._rendered.move_to_end(key)
                return rendered
        if self.step > 1:
            self._drafts.add(name)
        else:
            self._drafts.discard(name)
        return self.quick_planes(bases, name, values)

    @property
    def outdated(self) -> Collection[str]:
        """Lights whose last planes have repeated pixels, which need not be repeated any more."""
        return self._drafts if self.step == 1 else ()

    def quick_planes(
        self, bases: Sequence[Basis], name: str, values: Mapping[str, Any]
    ) -> list[Basis]:
        """Return the estimated plane of a light with a pose in each view."""
        self.open(bases)
        assert self.views is not None
        site, light_bases = self.site(name, values), []
        for view, basis in zip(self.views, bases, strict=True):
            with self._lock:
                quick = view.quick
            if "kind" in values:
                light = light_of_new(new_emitter(name, values))
            else:
                light = replace(basis.lights[basis.names.index(name)], identity="")
            with page_geometry.in_this_thread():
                plane = quick.plane(site, self.step)
            light_bases.append(one_light_basis(basis, light, plane))
        return light_bases

    def _is_rendered(self, name: str, values: Mapping[str, Any]) -> bool:
        return _pose_key(name, values) in self._rendered

    def unrendered(self, placed: Placed) -> list[str]:
        """Return the moved lights that have only quick planes."""
        return [name for name, values in placed.items() if not self._is_rendered(name, values)]

    def render(
        self,
        bases: Sequence[Basis],
        name: str,
        values: Mapping[str, Any],
        check: Callable[[], None],
    ) -> None:
        """Render the planes of a light with a pose, that light alone, in all views.

        check: called between passes; raises to stop.
        """
        from lightpaint.basis.cache import obtain_basis

        def progress(label: str, done: int, total: int, unit: str = "passes") -> None:
            del label, done, total, unit
            check()

        light_bases = []
        for k, (subject, basis) in enumerate(zip(self.subjects, bases, strict=True)):
            scene = self.moved_scene({name: values}, k).only([name])
            with MITSUBA.low_priority():
                light_bases.append(
                    obtain_basis(
                        scene,
                        spp=max(basis.origin.spp, 1),
                        seed=basis.origin.seed,
                        use_cache=subject.settings.use_cache,
                        progress=progress,
                        as_clean_as=basis,
                    )
                )
        with self._lock:
            self._rendered[_pose_key(name, values)] = light_bases
            while len(self._rendered) > MAX_RENDERED:
                self._rendered.popitem(last=False)

    def view(self, number: int) -> RigView:
        """Return a view of the open rig. Raises PaintError if there is none."""
        assert self.views is not None
        return view_at(self.views, number)

    # What pages draw

    def state(self, placed: Placed) -> Rig:
        """Return the places of all lights, for pages. Needs an open rig."""
        names = (*(light.name for light in self.scene.lights), *added_names(placed))
        places = tuple(self._known_place(name, placed.get(name, {})) for name in names)
        cameras = self.cameras
        hung = [np.array(place.position) for place in places if place.position is not None]
        low, high = self.bounds or (np.zeros(3), np.ones(3))
        low, high = np.min([low, *hung], axis=0), np.max([high, *hung], axis=0)
        return Rig(
            lights=places,
            cameras=cameras,
            up=page_geometry.up_axis(cameras),
            low=tuple(map(float, low)),
            high=tuple(map(float, high)),
            surfaces=self.surfaces,
            objects=self.plan_objects,
            skies=self.skies,
        )

    def _known_place(self, name: str, values: Mapping[str, Any]) -> LightPlace:
        """Return the place of a light, found once for each pose since its target takes a ray."""
        key = _pose_key(name, values)
        if key not in self._known_places:
            if len(self._known_places) >= MAX_KNOWN:
                self._known_places.clear()
            with page_geometry.in_this_thread():
                self._known_places[key] = self._place(name, values)
        return self._known_places[key]

    def _place(self, name: str, values: Mapping[str, Any]) -> LightPlace:
        reason = self.why_not(name, values)
        if not reason:
            site = self.site(name, values)
        else:
            members = self.scene.light(name).members
            site = members[0].site if len(members) == 1 else Site()
        target = values.get("target") or self._target(site)
        return LightPlace(
            position=site.position,
            direction=site.direction,
            target=None if target is None else tuple(map(float, target)),
            cutoff=site.cutoff,
            beam=site.beam,
            rail=self._rail(name, site),
            immovable_reason=reason,
        )

    def _rail(self, name: str, site: Site) -> tuple[Place, Place] | None:
        """Return the ends of the rail that a light hangs on, of those in the lights file."""
        freedom = self.freedoms.get(name)
        if freedom is None or not freedom.all_rails or site.position is None:
            return None
        position = np.array(site.position)
        return min(freedom.all_rails, key=lambda rail: _distance_to(position, rail))

    def _target(self, site: Site) -> Doubles | None:
        """Return the point of the first surface along a light's axis."""
        if site.position is None or site.direction is None:
            return None
        place, way = np.array(site.position), np.array(site.direction)
        length = page_geometry.free_length(self.view(0).loaded, place + 1e-3 * way, way)
        low, high = self.bounds or (np.zeros(3), np.ones(3))
        return np.asarray(place + min(length, float(np.linalg.norm(high - low))) * way)


def _pose(name: str, values: Mapping[str, Any]) -> Pose:
    """Return the pose that a client requests. Raises PaintError for invalid ones."""
    if unknown := [key for key in values if key not in POSE_KEYS]:
        raise PaintError(
            f"{name}: a pose has no {unknown[0]!r}: expected {', '.join(sorted(POSE_KEYS))}"
        )
    try:
        return Pose(**values)
    except SceneError as error:
        raise PaintError(f"{name}: ", error) from None


def _pose_key(name: str, values: Mapping[str, Any]) -> PoseKey:
    """Return a light and its pose as a key."""
    return name, json.dumps(values, sort_keys=True)


def _distance_to(point: Doubles, rail: tuple[Place, Place]) -> float:
    """Return the distance of a point from a rail."""
    start, end = (np.array(x) for x in rail)
    share = (point - start) @ (end - start) / ((end - start) @ (end - start))
    return float(np.linalg.norm(point - start - np.clip(share, 0, 1) * (end - start)))


def one_light_basis(basis: Basis, light: BasisLight, plane: Floats) -> Basis:
    """Return the basis of one light, whose plane (h, w, 3) has no noise."""
    quiet = MemoryPlanes(np.broadcast_to(np.float32(0), (1, *plane.shape)))
    lone = replace(
        basis.on_pixels(basis.planes, basis.noise, basis.emitters_seen),
        lights=(light,),  # type: ignore[arg-type]
        planes=MemoryPlanes(plane[None]),
        noise=quiet,
        origin=replace(basis.origin, each_light=(), extra_spp=0.0),
    )
    return lone


def with_planes_of(basis: Basis, moved: Mapping[int, Basis], *, in_memory: bool) -> Basis:
    """Return `basis` with the lights, planes and noise of bases of one light each, by number.

    Numbers beyond its lights belong to new lights. Unpainted parts are still held near the look of
    `basis`. in_memory: whether to copy planes, which saves time if all of them are read many times.
    """
    count = max(len(basis.lights), 1 + max(moved))
    in_memory = in_memory and not is_large(count, basis.size)

    def compose(planes: Planes, others: Mapping[int, Planes]) -> Planes:
        picks: list[PlaneReference] = [
            (others[k], 0) if k in others else (planes, k) for k in range(count)
        ]
        return compose_planes(picks, basis.size, in_memory=in_memory)

    indirect = None
    if basis.indirect is not None and all(x.indirect is not None for x in moved.values()):
        parts = {k: x.indirect for k, x in moved.items() if x.indirect is not None}
        indirect = IndirectLight(
            compose(basis.indirect.planes, {k: part.planes for k, part in parts.items()}),
            compose(basis.indirect.noise, {k: part.noise for k, part in parts.items()}),
        )
    lights = tuple(moved[k].lights[0] if k in moved else basis.lights[k] for k in range(count))
    moved_basis = replace(
        basis,
        lights=type(basis.lights)(lights, basis.requests),
        planes=compose(basis.planes, {k: x.planes for k, x in moved.items()}),
        noise=compose(basis.noise, {k: x.noise for k, x in moved.items()}),
        indirect=indirect,
        emitters_seen=np.any(
            [basis.emitters_seen, *(x.emitters_seen for x in moved.values())], axis=0
        ),
        former=basis.former or basis.predict(basis.current_weights),  # which it keeps
        guide_table=None,
        sums=None,
        origin=replace(basis.origin, is_composed=True),
    )
    # A pass over all planes gives the same as a pass over each.
    power, totals = np.zeros((2, count, 3))
    power[: len(basis.lights)], totals[: len(basis.lights)] = basis.power, basis.totals
    for k, one_light in moved.items():
        power[k], totals[k] = one_light.power[0], one_light.totals[0]
    moved_basis.set_power_and_totals(power, totals)
    return moved_basis
