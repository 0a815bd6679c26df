"""The bases of a session: obtained, denoised and sampled further while the user paints."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis import (
    Basis,
    DenoisedPlanes,
    array_name,
    array_once,
    cache_denoised_planes,
    denoise_current_look,
    denoise_to_halves,
    read_denoised_planes,
    read_look,
)
from lightpaint.basis.cache import keep_opening
from lightpaint.files import one_line
from lightpaint.images import denoiser_text
from lightpaint.lighting import Solution
from lightpaint.paint.background_threads import LatestWork, StoppedError
from lightpaint.paint.layers.canvas import Canvas
from lightpaint.paint.protocol import ProgressReport, Tone
from lightpaint.paint.rig.light_mover import LightMover
from lightpaint.paint.session import picture_table, session_state
from lightpaint.paint.session.look_library import LookLibrary
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.session_access import StudioLinks
from lightpaint.paint.store.history_steps import Identity, name_in_view
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.studio.file_imports import begin_with_layers
from lightpaint.paint.subject import Subject, obtain_bases, painting_transform
from lightpaint.progress import Progress, silent
from lightpaint.report import page_reduction
from lightpaint.scene.runtime.render_lock import MITSUBA
from lightpaint.validation import MAX_SPP

#: Name of this task in reports of progress.
SAMPLING = "sampling"


@dataclass(frozen=True)
class _ViewPlanes:
    """Denoised planes of one view. basis: their source. is_cached: whether a file has them."""

    basis: Basis
    planes: DenoisedPlanes
    is_cached: bool = False

    def matches(self, basis: Basis) -> bool:
        return self.basis.planes is basis.planes

    def scaled_to(self, basis: Basis) -> DenoisedPlanes:
        """Return planes that stand in until the planes of `basis` are denoised."""
        return self.planes if self.matches(basis) else self.planes.scaled_as(basis)


class PlaneDenoiser:
    """Denoises the planes of a studio's views.

    publish: receives each plane, by its name. is_needed: whether a page still shows them.
    use_cache: whether they are cached for the next session.
    """

    def __init__(
        self,
        publish: Callable[[str, picture_table.Picture], None],
        is_needed: Callable[[], bool],
        *,
        use_cache: bool,
    ) -> None:
        self._publish, self._is_needed, self._use_cache = publish, is_needed, use_cache
        self._by_view: dict[int, _ViewPlanes] = {}
        self._small: dict[int, _ViewPlanes] = {}  # of blocks of pixels, as pages of results have

    def load_cached(self, bases: Sequence[Basis]) -> list[Floats]:
        """Load cached planes. Returns the current look of each view, denoised."""
        current_looks = []
        for k, basis in enumerate(bases):
            factor = page_reduction(basis, len(basis.lights))
            # Planes of many lights are looked for while the page can be used already.
            has_files = self._use_cache and not basis.origin.is_plain_look
            is_looked_for = has_files and not picture_table.opens_plain(basis)
            cached = read_denoised_planes(basis, factor=factor) if is_looked_for else None
            if cached is None:
                current_looks.append(_clean_look(basis))
            else:
                current_looks.append(cached.current)
                planes_by_view = self._by_view if cached.is_whole else self._small
                planes_by_view[k] = _ViewPlanes(basis, cached, is_cached=True)
        return current_looks

    def planes_for(self, bases: Sequence[Basis]) -> list[DenoisedPlanes | None]:
        """Return each view's denoised planes, of fewer samples if need be; None if it has none."""
        return [
            self._by_view[k].scaled_to(basis) if k in self._by_view else None
            for k, basis in enumerate(bases)
        ]

    def clean_planes(self, bases: Sequence[Basis]) -> Sequence[DenoisedPlanes | None]:
        """Return the denoised planes of these bases; None for each that has none yet, or reduced
        ones.

        Bases with moved lights have none.
        """
        if any(basis.former is not None for basis in bases):
            return [None] * len(bases)
        return [x if x is not None and x.is_whole else None for x in self.planes_for(bases)]

    def small_planes_for(self, bases: Sequence[Basis]) -> list[DenoisedPlanes | None]:
        """Return each view's denoised planes of blocks of pixels, which a result has left."""
        small = [self._small.get(k) for k in range(len(bases))]
        return [
            view_planes.planes if view_planes is not None and view_planes.matches(basis) else None
            for view_planes, basis in zip(small, bases, strict=True)
        ]

    def denoise(self, session: Session) -> None:
        """Denoise the planes that pages have and that are missing, one view after the other.

        Of moved lights they are the planes of before, which undo brings back.
        """
        for view, basis in zip(session.views, session.bases, strict=True):
            planes_of_view = self._by_view.get(view.view)
            is_missing = planes_of_view is None or not planes_of_view.matches(basis)
            has_planes = not (basis.origin.is_plain_look or picture_table.has_mixes(basis))
            if is_missing and has_planes:
                self._denoise_view(session, view, basis)

    def _denoise_view(self, session: Session, view: Canvas, basis: Basis) -> None:
        n, factor, emitters = (
            len(basis.lights),
            picture_table.page_factor(basis),
            picture_table.page_emitters(basis),
        )
        is_cached = False
        planes = DenoisedPlanes(
            np.empty((n, *picture_table.plane_size(basis), 3), np.float16), np.ones(n), view.current
        )
        if picture_table.opens_plain(basis) and self._use_cache:
            cached = read_denoised_planes(basis, factor=factor)
            if cached is not None and cached.halves.shape == planes.halves.shape:
                planes, is_cached = cached, True
        for k in range(n):
            if not self._is_needed() or session.bases[view.view] is not basis:
                return
            if not is_cached:
                planes.halves[k], planes.scales[k] = denoise_to_halves(basis, k, factor)
            if basis.names[k] not in session.requests.placed:
                self._publish(name_in_view(f"clean/{k}", view.view), planes.halves[k])
                thumbnail = picture_table.plane_thumbnail(planes.plane(k), emitters)
                self._publish(name_in_view(f"thumb/{k}", view.view), thumbnail)
        self._by_view[view.view] = _ViewPlanes(basis, planes, is_cached)

    def write_cache(self) -> None:
        """Cache the planes of the final basis for the next session."""
        if self._use_cache:
            for view, planes_of_view in list(self._by_view.items()):
                if not planes_of_view.is_cached:
                    cache_denoised_planes(planes_of_view.basis, planes_of_view.planes)
                    self._by_view[view] = replace(planes_of_view, is_cached=True)


def _clean_look(basis: Basis) -> Floats:
    """Return the denoised current look, (h, w, 3)."""
    if basis.origin.is_plain_look:
        return basis.current_look
    if not picture_table.opens_plain(basis) or basis.former is not None:
        return denoise_current_look(basis)
    denoiser = "".join(denoiser_text(basis.features, raw="").values())
    name = array_name(f"clean look by {denoiser}", basis.current_weights)
    return array_once(basis.planes, name, lambda: denoise_current_look(basis))


class SessionBases:
    """The bases of a studio's session, each of more samples than the one before.

    Args:
        links: To the session that the first bases open, and to its pages.
        subjects: The views to be painted, under one lighting.
        open_store: Opens the store of their session once their lights are known.
        denoiser: Denoises the planes of the bases.
        mover: Makes the planes of lights that the session moves, and offers their pictures.
        on_new_bases: Called, without the lock, after the session has continued with new bases.
        warn: Receives remarks of the store about its file.
    """

    def __init__(
        self,
        links: StudioLinks,
        subjects: Sequence[Subject],
        open_store: Callable[[Identity], Store],
        denoiser: PlaneDenoiser,
        mover: LightMover,
        *,
        on_new_bases: Callable[[], None],
        warn: Callable[[str, Tone], None],
    ) -> None:
        self._access, self._publisher, _ = links
        self._subjects, self._open_store = subjects, open_store
        self._denoiser, self._mover = denoiser, mover
        self._on_new_bases, self._warn = on_new_bases, warn
        self._waiting_store: Store | None = None  # of the session, until it is open

    def obtain(self) -> None:
        """Continue the session with bases of more and more samples, and denoise each.

        Raises StoppedError once the session has ended, and LightpaintError.
        """
        with MITSUBA.low_priority():
            for bases in obtain_bases(self._subjects, self._publisher.report_progress):
                if self._is_too_early(bases):
                    continue
                self.use(bases)
                self._keep_openings(bases)
                self._denoiser.denoise(self._access.session)
        self._publisher.publish(ProgressReport(task="basis", done=1, total=1, unit=""))
        self._denoiser.write_cache()

    def _is_too_early(self, bases: Sequence[Basis]) -> bool:
        """Return whether lights are unknown, of a session that does not begin with these bases: its
        lights may hang elsewhere, or start from another lighting.
        """
        if not any(basis.origin.is_plain_look for basis in bases) or self._access.current:
            return False
        self._waiting_store = self._open_store(Identity.of(bases))
        return bool(self._waiting_store.steps) or self._subjects[0].layers is not None

    def close(self) -> None:
        """Close a store whose session was not opened."""
        if self._waiting_store is not None:
            self._waiting_store.close()

    def use(self, bases: Sequence[Basis]) -> None:
        """Continue the session with these bases, or open it with them.

        Raises StoppedError once the session has ended, and LightpaintError if it cannot be opened.
        """
        current_looks = self._denoiser.load_cached(bases)
        clean_planes = self._denoiser.planes_for(bases)
        small_planes = self._denoiser.small_planes_for(bases)
        for basis in bases:
            read_look(basis)  # made once, and takes longer than strokes should wait for the lock
        with self._access.lock:
            if not self._publisher.is_open:
                raise StoppedError
            if self._access.current is None:
                self._access.open(*self._open_session(bases, current_looks))
            else:
                remarks = self._access.current.store.remarks
                known = len(remarks)
                self._access.current.improve(bases, current_looks)
                for remark in remarks[known:]:
                    self._warn(remark, "warn")
            self._offer_pictures(bases, clean_planes, small_planes)
        self._on_new_bases()

    def _keep_openings(self, bases: Sequence[Basis]) -> None:
        """Keep the results of walks over all planes with which sessions of these bases begin."""
        for subject, basis in zip(self._subjects, bases, strict=True):
            is_rendered = not basis.origin.is_plain_look
            if subject.settings.use_cache and is_rendered and picture_table.opens_plain(basis):
                picture_table.plane_scale(basis, 0)  # of all planes, for the pages
                keep_opening(basis)

    def _open_session(
        self, bases: Sequence[Basis], current_looks: Sequence[Floats]
    ) -> tuple[Session, LookLibrary]:
        """Return the session of the first bases, and its looks. Raises LightpaintError."""
        first = self._subjects[0]
        store = self._waiting_store or self._open_store(Identity.of(bases))
        self._waiting_store = None
        try:
            session = Session(
                bases,
                current_looks,
                store,
                settings=first.settings,
                transform=painting_transform(self._subjects, bases),
                constraints=first.constraints,
                plane_source=None if first.scene is None else self._mover.rig,
            )
            if first.layers is not None and not begin_with_layers(session, first.layers):
                name = one_line(first.layers.name)
                self._warn(f"this session has begun with {name} already: it goes on", "info")
            looks = LookLibrary(session, self._publisher.pictures)
            for remark in store.remarks:
                self._warn(remark, "warn")
            return session, looks
        except BaseException:
            store.close()  # free for the next try, for example with other constraints
            raise

    def _offer_pictures(
        self,
        bases: Sequence[Basis],
        clean_planes: Sequence[DenoisedPlanes | None],
        small_planes: Sequence[DenoisedPlanes | None],
    ) -> None:
        """Offer the pictures of all views and moved lights; the state that follows lists them."""
        session, pictures = self._access.session, self._publisher.pictures
        of_views = bases, clean_planes, small_planes
        for view, basis, clean, small in zip(session.views, *of_views, strict=True):
            session_state.offer_view(pictures, view, basis, session.transform, clean, small)
        session_state.offer_transforms(pictures, session_state.offered_transforms(session))
        session_state.offer_layers(pictures, session.views)
        if not session.is_waiting:
            session_state.offer_lights_at(pictures, session.views)
            session_state.offer_presets(pictures, session.views[0], session.transform)
        session_state.offer_references(pictures, session.references)
        session_state.offer_steps(pictures, session.history.picture)
        self._mover.offer_all(session)

    def denoise(self) -> None:
        """Denoise the planes of the current bases, where that is not done yet, and keep them."""
        self._denoiser.denoise(self._access.session)
        self._denoiser.write_cache()


class BackgroundSampling:
    """A thread's loop that adds samples after each exact answer, until the brush moves."""

    def __init__(
        self, links: StudioLinks, subjects: Sequence[Subject], bases: SessionBases
    ) -> None:
        self._access, self._publisher, _ = links
        self._subjects, self._bases = subjects, bases
        self._loop = LatestWork(self._add, self._publisher.publish)
        self._is_reported = False  # whether pages show that samples are added
        self.stop = self._loop.stop

    @property
    def is_wanted(self) -> bool:
        """True if the settings say how sure the lights are to be."""
        first = self._subjects[0]
        return first.scene is not None and first.settings.error is not None

    def run(self) -> None:
        """Add samples until `stop`, if they are wanted."""
        if self.is_wanted:
            self._loop.run()

    def give(self, snapshot: SessionSnapshot, solution: Solution) -> None:
        """Replace the exact answer that samples are added for."""
        if self.is_wanted:
            self._loop.give((snapshot, solution))

    def _add(self, answer: tuple[SessionSnapshot, Solution]) -> None:
        """Add a round of samples; once there are enough, denoise the planes that have them."""
        snapshot, solution = answer

        def is_outdated() -> bool:
            return not self._publisher.is_open or self._access.version != snapshot.version

        # Samples are of the scene, in which no light is moved.
        bases = None
        if not (is_outdated() or snapshot.requests.placed):
            bases = add_round(
                self._subjects,
                snapshot,
                solution,
                is_enough=is_outdated,
                progress=self._report,
            )
        # After a round the next exact answer says whether another one follows.
        if self._is_reported and (bases is None or is_outdated()):
            self._is_reported = False
            self._publisher.publish(ProgressReport(task=SAMPLING, done=1, total=1, unit=""))
        if bases is not None:
            self._bases.use(bases)
        elif not (is_outdated() or snapshot.requests.placed):
            self._bases.denoise()

    def _report(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        self._is_reported = True
        self._publisher.report_progress(label, done, total, unit)


def add_round(
    subjects: Sequence[Subject],
    snapshot: SessionSnapshot,
    solution: Solution,
    *,
    is_enough: Callable[[], bool],
    progress: Progress = silent,
) -> list[Basis] | None:
    """Return the bases of all views after a round of samples; None if none is needed or was taken.

    snapshot, solution: the paintings, and their exact answer. is_enough: whether to leave the rest
    of the round; asked between passes. progress: hears, as `SAMPLING`, which share of the precision
    that was asked for is reached, in percent.
    """
    # Imported here: saved bases need no renderer.
    from lightpaint.basis.cache import top_up_basis
    from lightpaint.basis.render import ONE_PASS, kept_loaded
    from lightpaint.pipeline import Certainty, needed_counts

    settings, bases = snapshot.settings, list(snapshot.bases)
    painted = [bases[k] for k in snapshot.painted_views]
    is_possible = all(x.origin.method == ONE_PASS and x.origin.mean_spp < MAX_SPP for x in painted)
    if settings.error is None or not is_possible:
        return None
    certainty = Certainty.of(solution)
    if certainty.error <= settings.error:
        return None
    counts = needed_counts(certainty, painted, settings.error)
    rounds = list(zip(snapshot.painted_views, counts, strict=True))
    # Squared errors fall as samples grow.
    share = (settings.error / certainty.error) ** 2
    have = sum(x.origin.mean_spp * x.size[0] * x.size[1] for x in painted)
    grown = min(share * (1 + 2 * sum(int(x.sum()) for x in counts) / have), 0.99)

    def of_view(number: int) -> Progress:
        def hear(label: str, done: int, total: int, unit: str = "passes") -> None:
            taken = (number + done / max(total, 1)) / len(rounds)
            progress(SAMPLING, round(100 * (share + (grown - share) * taken)), 100, "percent")

        return hear

    scenes = [subjects[k].loaded_scene for k in snapshot.painted_views]
    with MITSUBA.low_priority(), kept_loaded(scenes) as tracers:
        for number, (k, view_counts) in enumerate(rounds):
            if is_enough():
                break
            bases[k] = top_up_basis(
                scenes[number],
                bases[k],
                view_counts,
                use_cache=settings.use_cache,
                is_enough=is_enough,
                progress=of_view(number),
                tracers=tracers,
            )
    taken = zip(bases, snapshot.bases, strict=True)
    return bases if any(a.origin != b.origin for a, b in taken) else None
