"""Lights that a session moves: quick planes at once, and rendered ones in the background.

A client may mark a place in a picture instead of giving a pose. Closed forms give the pose of a
light whose beam, highlight or shadow should fall on that point, or a new light there.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from statistics import mean
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis import Basis, DenoisedPlanes, as_halves, denoise_to_halves
from lightpaint.colour import LUMINANCE
from lightpaint.errors import LightpaintError, PaintError, SceneError
from lightpaint.paint import protocol
from lightpaint.paint.background_threads import LatestWork, StoppedError
from lightpaint.paint.layers.canvas import Canvas
from lightpaint.paint.rig.added_lights import (
    free_name,
    hung_at,
    hung_before,
    listed,
    values_of,
    with_level,
)
from lightpaint.paint.rig.lamp_rig import LampRig, RigView
from lightpaint.paint.rig.page_geometry import (
    FirstHit,
    FreeLength,
    camera_of,
    first_hit,
    free_length,
    in_this_thread,
    up_axis,
)
from lightpaint.paint.session import picture_table
from lightpaint.paint.session.moved_lights import Placed, added_names
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.session_access import StudioLinks
from lightpaint.paint.store.history_steps import name_in_view
from lightpaint.scene import NewEmitter, Pose
from lightpaint.scene.properties.site import Site

#: Luminance of a spot that is aimed well, relative to the luminance of a lamp without a cone at its
#: place.
AIMED_SHARE = 0.3

#: Largest distance of a light, as a part of the way to the next surface; and least distance of that
#: surface, relative to the light's distance from its target, for a light to fit.
BEFORE_WALL, LEAST_ROOM = 0.9, 0.05

#: Least distance of a light beyond the edge that casts its shadow, relative to its distance from
#: the shadow.
BEYOND_EDGE = 0.3

PoseChange = dict[str, Any]


class LightMover:
    """Moves lights of a session for its studio.

    Args:
        links: To the session, its pages and its threads.
        rig: The lights and their places, and the source of their planes.
        clean_planes: Returns the denoised planes of bases; None for each that has none yet.
        on_rendered: Called after rendered planes have replaced quick ones.
    """

    def __init__(
        self,
        links: StudioLinks,
        rig: LampRig,
        *,
        clean_planes: Callable[[Sequence[Basis]], Sequence[DenoisedPlanes | None]],
        on_rendered: Callable[[], None],
    ) -> None:
        self._access, self._publisher, self._threads = links
        self.rig = rig
        self._clean_planes, self._on_rendered = clean_planes, on_rendered
        self._shows_rig, self._shown = False, dict[str, Mapping[str, Any]]()
        self._dragged = set[str]()  # lights being dragged
        self._work = LatestWork(self._render, self._publisher.publish)
        self._is_working, self._is_open = False, True

    def stop(self) -> None:
        """End the background work."""
        self._is_open = False
        self._work.stop()

    def show_rig(self) -> list[protocol.Message]:
        """Load the rig in the background, and publish it now and after every move."""
        self._shows_rig = True
        self._threads.start_low_priority(self._open_rig, "rig")
        return [protocol.TaskStarted(task="rig")]

    def _open_rig(self) -> None:
        self.rig.open(self._access.session.bases)
        for message in self.rig_messages():
            self._publisher.publish(message)
        self.rig.trace_paths()

    def rig_messages(self) -> list[protocol.Message]:
        """Return the places of lights, if pages have requested them."""
        if not (self._shows_rig and self.rig.is_open):
            return []
        return [self.rig.state(self._access.session.requests.placed)]

    def move_of(self, request: protocol.PointLight) -> protocol.MoveLights:
        """Return the move that a pointing request implies. Raises LightpaintError."""
        session = self._access.session
        self.rig.open(session.bases)
        names = session.basis.names
        if not 0 <= request.light < len(names):
            raise PaintError(f"no light {request.light}: there are {len(names)}")
        name = names[request.light]
        pose = pose_change(self.rig, request, name, session.requests.placed.get(name, {}))
        return protocol.MoveLights({name: pose}, request.is_final, request.view, request.step)

    def hang(self, request: protocol.AddLight) -> tuple[str, dict[str, Any]]:
        """Return name and values of the light that a request adds. Raises PaintError."""
        session = self._access.session
        self.rig.open(session.bases)
        taken = {*session.basis.names, *(x.name for x in self.rig.scene.emitters)}
        name = free_name(request.type, taken)
        emitter = emitter_at_place(self.rig, request, name)
        alone = self._total(name, values_of(emitter))
        if emitter.kind == "spot":
            # It will be aimed at other places, and these are all that a lamp there could light.
            all_around = {"kind": "point", "position": values_of(emitter)["position"]}
            alone = max(alone, AIMED_SHARE * self._total(name, all_around))
        current = mean(
            float((x.totals * x.current_weights).sum(axis=0) @ LUMINANCE) for x in session.bases
        )
        return name, values_of(with_level(emitter, alone, current))

    def _total(self, name: str, values: Mapping[str, Any]) -> float:
        """Return the luminance of the pictures with a new light alone, at unit emission."""
        planes = self.rig.quick_planes(self._access.session.bases, name, values)
        return mean(float((plane.totals @ LUMINANCE)[0]) for plane in planes)

    def follow(self, send: Callable[[protocol.Message], None], view: int = 0) -> bool:
        """Show the planes of newly moved lights, and render them once they rest.

        send: receives the messages about them. view: the one in which a page shows a light that is
        dragged. Returns whether lights were added or removed, so that pages need the whole state.
        """
        session = self._access.session
        placed, shown = session.requests.placed, self._shown
        is_dragged = session.is_open
        names = {name for name in {*placed, *shown} if placed.get(name) != shown.get(name)}
        names |= set() if is_dragged else self._dragged
        if not names:
            return False
        self._shown, self._dragged = dict(placed), names if is_dragged else set()
        is_other = added_names(placed) != added_names(shown)
        if is_other:  # The numbers of later lights have changed. Pictures of removed lights stay,
            # for pages that are fetching them.
            names |= {*added_names(placed)}
        offered = self._offer(
            session, sorted(names & {*session.basis.names}), is_dragged=is_dragged
        )
        if not is_other:  # the whole state has these
            dragged = self._dragged_planes(session, view) if is_dragged else []
            for message in (*dragged, offered, *self.rig_messages()):
                send(message)
        if not is_dragged:
            for warning in _unlit_warnings(session, names & {*placed}):
                send(warning)
            self.render_behind()
        return is_other

    def render_behind(self) -> None:
        """Replace quick planes by rendered ones, in the background."""
        placed = self._access.session.requests.placed
        if not placed:
            return
        if not self._is_working:
            self._is_working = True
            self._threads.start_low_priority(self._work.run, "planes")
        self._work.give(placed)

    def _render(self, placed: Placed) -> None:
        """Replace the quick planes of these lights by rendered ones, unless the lights move."""

        def check() -> None:
            if not self._is_open or self._access.session.requests.placed != placed:
                raise StoppedError

        try:
            self.finish(placed, check)
            for name in placed:
                check()
                self._denoise(name)
        except StoppedError:
            pass
        except LightpaintError as error:  # the next move is rendered again
            self._publisher.publish(protocol.Notice(text=str(error), tone="warn"))

    def finish(self, placed: Placed, check: Callable[[], None]) -> None:
        """Replace the quick planes of these lights by rendered ones. check: raises to stop."""
        for name in self.rig.unrendered(placed):
            check()
            self.rig.render(self._access.session.bases, name, placed[name], check)
            self._publisher.publish_made(partial(self._renew, name, placed[name]))
            self._on_rendered()

    def _renew(self, name: str, values: Mapping[str, Any]) -> protocol.PictureUpdate | None:
        """Give the session the rendered planes of a light, unless it has moved on."""
        session = self._access.session
        if session.requests.placed.get(name) != values:
            return None
        session.renew_planes([name])
        return self._offer(session, [name], is_dragged=False)

    def offer_all(self, session: Session) -> None:
        """Offer the pictures of all moved lights, after the pictures of the bases without moves.

        This publishes nothing, since the state that follows lists all pictures.
        """
        self._shown = dict(session.requests.placed)
        self._offer(session, list(session.requests.placed), is_dragged=False)

    def _offer(
        self, session: Session, names: Sequence[str], *, is_dragged: bool
    ) -> protocol.PictureUpdate:
        """Offer the current pictures of lights, and return the messages that announce them."""
        pictures, offered = self._publisher.pictures, []
        clean = None if is_dragged else self._clean_planes(session.bases)
        for view, unmoved in zip(session.views, session.bases, strict=True):
            for name in names:
                k = view.basis.names.index(name)
                scale = picture_table.plane_scale(unmoved, k)
                is_moved = name in session.requests.placed
                plane = picture_table.page_plane(view.basis.planes.plane(k), unmoved)
                make: Callable[[], picture_table.Picture] = partial(as_halves, plane, scale)
                clean_planes = clean[view.view] if clean is not None else None
                if not is_moved and clean_planes is not None:
                    make = partial(_kept_halves, clean_planes, k)
                makers: dict[str, Callable[[], picture_table.Picture]] = {
                    f"clean/{k}": make,
                    f"plane/{k}": partial(as_halves, plane, scale),
                }
                if not is_dragged:
                    shown = plane if is_moved or clean_planes is None else clean_planes.plane(k)
                    makers[f"thumb/{k}"] = partial(
                        picture_table.plane_thumbnail, shown, picture_table.page_emitters(unmoved)
                    )
                for plain, maker in makers.items():
                    full = name_in_view(plain, view.view)
                    pictures.offer(full, maker)
                    offered.append(full)
        return pictures.announcement(offered)

    def _dragged_planes(self, session: Session, number: int) -> list[protocol.DraggedPlane]:
        """Return the pictures of dragged lights in a view."""
        pictures, basis = self._publisher.pictures, session.views[number].basis
        messages, step = [], self.rig.step
        for k in sorted(basis.names.index(name) for name in self._dragged):
            names = [name_in_view(f"{plain}/{k}", number) for plain in ("clean", "plane")]
            if step == 1:
                picture = pictures[names[0]]
                pictures.keep(names[1], picture)
            else:  # the whole picture is made only if it is fetched
                unmoved = session.bases[number]
                plane = picture_table.page_plane(basis.planes.plane(k), unmoved)[::step, ::step]
                picture = as_halves(plane, picture_table.plane_scale(unmoved, k))
            resources = pictures.announcement(names).resources
            messages.append(
                protocol.DraggedPlane(
                    light=k, view=number, step=step, resources=resources, data=picture
                )
            )
        return messages

    def _denoise(self, name: str) -> None:
        """Replace the picture of a rendered plane by a denoised one."""
        for view, unmoved in zip(
            self._access.session.views, self._access.session.bases, strict=True
        ):
            basis = view.basis
            if name not in basis.names:
                return
            k = basis.names.index(name)
            scale = picture_table.plane_scale(unmoved, k)
            halves, own = denoise_to_halves(basis, k, picture_table.page_factor(unmoved))
            picture = as_halves(halves.astype("float32") * own, scale)
            thumbnail = picture_table.plane_thumbnail(
                picture.astype("float32"), picture_table.page_emitters(unmoved)
            )
            put = partial(self._put_denoised, view, basis, k, picture, thumbnail)
            self._publisher.publish_made(put)

    def _put_denoised(
        self,
        view: Canvas,
        basis: Basis,
        k: int,
        picture: picture_table.Picture,
        thumbnail: picture_table.Picture,
    ) -> protocol.PictureUpdate | None:
        """Put the denoised picture of a plane of `basis`, unless the view has other planes now."""
        if view.basis.planes is not basis.planes:
            return None
        pictures = {f"clean/{k}": picture, f"thumb/{k}": thumbnail}
        return self._publisher.pictures.put_all(
            {name_in_view(name, view.view): x for name, x in pictures.items()}
        )


def _unlit_warnings(session: Session, names: Collection[str]) -> list[protocol.Notice]:
    """Return warnings of lights that light nothing visible, such as those inside a wall."""
    numbers = {name: session.basis.names.index(name) for name in sorted(names)}
    return [
        protocol.Notice(
            text=f"{name} lights nothing that is seen from there: it may be in a wall, or far away",
            tone="warn",
        )
        for name, k in numbers.items()
        if not any(view.basis.planes.plane(k).any() for view in session.views)
    ]


def _kept_halves(planes: DenoisedPlanes, k: int) -> picture_table.Picture:
    return np.asarray(planes.halves[k])


def _aimed(name: str, site: Site, hit: FirstHit) -> PoseChange:
    """Return the change that points a light at a visible point. Raises PaintError if none does."""
    if site.direction is None:
        raise PaintError(f"{name} shines all around: it cannot be aimed")
    if site.position is None:
        raise PaintError(f"{name} is infinitely far away: choose where its shadow ends instead")
    return {"target": listed(hit.point)}


def _with_highlight(name: str, site: Site, hit: FirstHit, free_length: FreeLength) -> PoseChange:
    """Return the change that puts a light's reflection at `hit`, on the mirrored ray of the eye.

    The light keeps its distance from there, if there is room.
    """
    ahead = _unit(hit.point - hit.eye)
    mirrored = _unit(ahead - 2 * (ahead @ hit.normal) * hit.normal)
    if mirrored @ hit.normal <= 0:
        raise PaintError("the surface is seen from behind there: choose another place")
    return _hung(name, site, hit.point, hit.point, mirrored, free_length)


def _with_shadow(
    name: str, site: Site, edge: FirstHit, hit: FirstHit, free_length: FreeLength
) -> PoseChange:
    """Return the change that puts the shadow of `edge` at `hit`, on the line through both."""
    between = edge.point - hit.point
    if not np.linalg.norm(between) > 0:
        raise PaintError("the shadow and what casts it are one place: choose two places")
    if between @ hit.normal <= 0:
        raise PaintError(
            "what casts the shadow is behind the surface: choose another edge or place"
        )
    return _hung(name, site, hit.point, edge.point, _unit(between), free_length)


def _hung(
    name: str,
    site: Site,
    lit: Doubles,
    start: Doubles,
    way: Doubles,
    free_length: FreeLength,
) -> PoseChange:
    """Return the change that hangs a light on the line from `start`, and aims it at `lit`."""
    if site.position is None:
        if site.direction is None:
            raise PaintError(f"{name} has no place and no direction: it cannot be moved")
        return {"target": listed(-way)}
    distance = float(np.linalg.norm(np.array(site.position) - lit))
    current_distance = float(np.linalg.norm(start - lit))
    distance_needed = max(distance - current_distance, BEYOND_EDGE * distance)
    nudge = 1e-3 * max(distance, current_distance)
    room = BEFORE_WALL * free_length(start + nudge * way, way)
    if room < LEAST_ROOM * distance:
        raise PaintError(f"there is no room for {name} on that line: choose another place")
    place = start + min(distance_needed, room) * way
    pose: PoseChange = {"position": listed(place)}
    if site.direction is not None:
        pose["target"] = listed(lit)
    return pose


def _unit(vector: Doubles) -> Doubles:
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-30))


def pose_change(
    rig: LampRig, request: protocol.PointLight, name: str, values: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the change of a light's pose that a pointing request implies. The rig is open.

    values: the light's current pose or, for an added light, all its properties. Raises
    LightpaintError for a light that cannot move, or for a place that it cannot reach.
    """
    with in_this_thread():
        site, view = rig.site(name, values), rig.view(request.view)
        hit, length = _visible_surface(view, request.pixel), partial(free_length, view.loaded)
        if request.mode == "aim":
            return _aimed(name, site, hit)
        if request.mode == "highlight":
            return _with_highlight(name, site, hit, length)
        if request.edge is None:
            raise PaintError("a shadow needs two places: the edge that casts it, and where it ends")
        return _with_shadow(name, site, _visible_surface(view, request.edge), hit, length)


def emitter_at_place(rig: LampRig, request: protocol.AddLight, name: str) -> NewEmitter:
    """Return a new light at the place that a request marks. The rig is open.

    Its emission is set later. Raises PaintError if no light can hang there.
    """
    if rig.scene.has_media:
        raise PaintError("no light can be added to a scene with fog or the like")
    view = rig.view(request.view)
    if request.position is not None:
        return _emitter_at_position(view, request, name, rig.extent)
    if request.pixel is None:
        raise PaintError("a new light needs a place: click on a surface, or in the plan")
    with in_this_thread():
        hit, length = _visible_surface(view, request.pixel), partial(free_length, view.loaded)
        return hung_before(name, request.type, hit, rig.extent, length)


def _emitter_at_position(
    view: RigView, request: protocol.AddLight, name: str, extent: float
) -> NewEmitter:
    """Return a new light at a point of space, such as a point of the plan; it points down."""
    down = np.zeros(3)
    down[up_axis([camera_of(view.scene, view.loaded)])] = -1.0
    try:
        place = Pose(position=request.position).position  # type: ignore[arg-type]
    except SceneError as error:
        raise PaintError(f"{name}: ", error) from None
    return hung_at(name, request.type, np.array(place), down, extent)


def _visible_surface(view: RigView, pixel: tuple[float, float]) -> FirstHit:
    """Return the surface that a pixel (column, row) sees. Raises PaintError if it sees none."""
    height, width = view.scene.size
    if not (0 <= pixel[0] < width and 0 <= pixel[1] < height):
        column, row = (f"{x:.0f}" for x in pixel)
        raise PaintError(
            f"({column}, {row}) is outside the picture, {width}x{height} pixels: click inside it"
        )
    hit = first_hit(view.scene, view.loaded, pixel)
    if hit is None:
        raise PaintError("nothing is seen there: click on a surface")
    return hit
