"""The bases of a session: obtained and denoised in the background; the first ones open it."""

from collections.abc import Callable, Sequence

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.cache.denoised_planes import DenoisedPlanes
from lightpaint.files import one_line
from lightpaint.paint.background_threads import StoppedError
from lightpaint.paint.protocol import ProgressReport, Tone
from lightpaint.paint.publisher import Publisher
from lightpaint.paint.rig.light_mover import LightMover
from lightpaint.paint.session.look_library import LookLibrary
from lightpaint.paint.session.session import Session
from lightpaint.paint.session.session_state import (
    offer_layers,
    offer_presets,
    offer_references,
    offer_steps,
    offer_transforms,
    offer_view,
    offered_transforms,
)
from lightpaint.paint.session_access import SessionAccess
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.store import Store
from lightpaint.paint.studio.file_imports import begin_with_layers
from lightpaint.paint.studio.plane_denoiser import PlaneDenoiser
from lightpaint.paint.subject import Subject, obtain_bases, painting_transform
from lightpaint.scene.runtime.render_lock import MITSUBA


class SessionBases:
    """The bases of a studio's session, each of more samples than the one before.

    Args:
        subjects: The views to be painted, under one lighting.
        open_store: Opens the store of their session once their lights are known.
        access: Receives the session that the first bases open.
        publisher: Sends pictures and progress to pages.
        denoiser: Denoises the planes of the bases.
        mover: Makes the planes of lights that the session moves, and offers their pictures.
        on_new_bases: Called, without the lock, after the session has continued with new bases.
        warn: Receives remarks of the store about its file.
    """

    def __init__(
        self,
        subjects: Sequence[Subject],
        open_store: Callable[[Identity], Store],
        access: SessionAccess,
        publisher: Publisher,
        denoiser: PlaneDenoiser,
        mover: LightMover,
        *,
        on_new_bases: Callable[[], None],
        warn: Callable[[str, Tone], None],
    ) -> None:
        self._subjects, self._open_store = subjects, open_store
        self._access, self._publisher = access, publisher
        self._denoiser, self._mover = denoiser, mover
        self._on_new_bases, self._warn = on_new_bases, warn

    def obtain(self) -> None:
        """Continue the session with bases of more and more samples, and denoise each.

        Raises StoppedError once the session has ended, and LightpaintError.
        """
        with MITSUBA.low_priority():
            for bases in obtain_bases(self._subjects, self._publisher.report_progress):
                self.use(bases)
                self._denoiser.denoise(self._access.session)
        self._publisher.publish(ProgressReport(task="basis", done=1, total=1, unit=""))
        self._denoiser.write_cache()

    def use(self, bases: Sequence[Basis]) -> None:
        """Continue the session with these bases, or open it with them.

        Raises StoppedError once the session has ended, and LightpaintError if it cannot be opened.
        """
        current_looks = self._denoiser.load_cached(bases)
        clean_planes = self._denoiser.planes_for(bases)
        small_planes = self._denoiser.small_planes_for(bases)
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

    def _open_session(
        self, bases: Sequence[Basis], current_looks: Sequence[Floats]
    ) -> tuple[Session, LookLibrary]:
        """Return the session of the first bases, and its looks. Raises LightpaintError."""
        first = self._subjects[0]
        store = self._open_store(Identity.of(bases))
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
            offer_view(pictures, view, basis, session.transform, clean, small)
        offer_transforms(pictures, offered_transforms(session))
        offer_layers(pictures, session.views)
        offer_presets(pictures, session.views[0], session.transform)
        offer_references(pictures, session.references)
        offer_steps(pictures, session.history.picture)
        self._mover.offer_all(session)

    def denoise(self) -> None:
        """Denoise the planes of the current bases, where that is not done yet, and keep them."""
        self._denoiser.denoise(self._access.session)
        self._denoiser.write_cache()
