"""Where somebody paints: a session, and all that goes on beside it while the brush moves.

Answers to messages come at once, from one thread at a time. The basis that is still being
rendered, exact answers, clean planes, exports and the verifying render have threads of their own,
which say what has come of them through `on_message`.
"""

import os
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from contextlib import suppress
from threading import Condition, Lock, RLock, Thread, get_native_id
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.errors import LightpaintError, PaintError
from lightpaint.files import first_line
from lightpaint.images.denoise import denoised
from lightpaint.lighting.analysis.analyse import analyse, with_findings
from lightpaint.lighting.lighting import Lighting
from lightpaint.paint import pictures, protocol
from lightpaint.paint.clean import Clean, keep_clean, kept_clean
from lightpaint.paint.looks import Looks
from lightpaint.paint.pictures import Pictures
from lightpaint.paint.protocol import Message
from lightpaint.paint.session import Moment, Session
from lightpaint.paint.steps import Identity
from lightpaint.paint.store import Store
from lightpaint.paint.subject import PAINTING, Subject
from lightpaint.paint.told import analysis_fields, light_fields, lights_fields
from lightpaint.paint.wishes import Wishes
from lightpaint.progress import while_wanted

#: Seconds of rest after a stroke before the exact answer is looked for.
REST_S = 0.2

#: How much less urgent than strokes all else is, where threads can be told apart: on Linux.
NICE = 10


class StoppedError(Exception):
    """Somebody does not want it any more."""


class OldError(Exception):
    """Somebody has painted on."""


class Studio:
    """A subject under the brush.

    Args:
        subject: What is painted.
        open_store: The store of a session of it, opened when its lights are known.

    Attributes:
        on_message: Hears what is said unasked, from other threads.
        on_failure: Hears why there is nothing to paint, from another thread.
        failure: The same, afterwards.
    """

    def __init__(self, subject: Subject, open_store: Callable[[Identity], Store]) -> None:
        self.subject, self._open_store = subject, open_store
        self.on_message: Callable[[Message], None] | None = None
        self.on_failure: Callable[[Exception], None] | None = None
        self.failure: Exception | None = None
        self.pictures = Pictures()
        self._session: Session | None = None
        self._looks: Looks | None = None
        self._known: Mapping[str, Any] = {}  # the last exact answer, as it was said
        self._progress: Mapping[str, Any] | None = None  # of the first picture
        self._lock, self._bell = RLock(), Condition()
        self._unsettled, self._is_open, self._failed = False, True, ""
        self._render, self._renders = Lock(), False
        self._threads = [
            Thread(target=work, name=f"lightpaint-{work.__name__}", daemon=True)
            for work in (self._obtain, self._settle)
        ]

    @property
    def session(self) -> Session:
        """What is painted. Raises PaintError before there is a basis."""
        if self._session is None:
            raise PaintError(self._failed or "the first picture is still being rendered")
        return self._session

    @property
    def store(self) -> Store | None:
        """Where it is kept; None before there is a basis."""
        return None if self._session is None else self._session.store

    def start(self) -> None:
        """Begin to obtain the basis."""
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """End; all that was done is kept."""
        with self._bell:
            self._is_open = False
            self._bell.notify_all()
        with self._lock:
            if self._session is not None:
                self._session.store.close()

    # What a page asks

    def state(self) -> Message:
        """All there is, for a page that opens."""
        with self._lock:
            session = self._session
            about: dict[str, Any] = {
                "version": protocol.VERSION,
                "scene": self.subject.name,
                "folder": str(self.subject.folder),
                "can_render": self.subject.scene is not None,
            }
            if session is None:
                return Message(
                    "waiting", {**about, "text": self._failed, "progress": self._progress}
                )
            basis = session.basis
            about |= self._of_basis(basis, session)
            known = self._known if self._known.get("version") == session.version else {}
            answer = {"lights": lights_fields(basis, session.weights), **known}
            arrays = session.weights_array
            return Message("state", {**about, **session.about, "answer": answer}, arrays)

    def greet(self, *, is_back: bool) -> Message:
        """The state, for a page that begins; is_back: it was there before, and will send what it
        has of a stroke again. What another one had begun is kept as it was left.
        """
        with self._lock:
            if self._session is not None and self._session.is_open:
                self._session.left(with_stroke=not is_back)
                self._ring()
            return self.state()

    def said(self, message: protocol.Said, arrays: Mapping[str, npt.NDArray[Any]]) -> list[Message]:
        """What comes of a message at once. Raises LightpaintError for what cannot be done."""
        if isinstance(message, protocol.Hello | protocol.TakeOver):
            return [self.greet(is_back=True)]
        if isinstance(message, protocol.Fetch):
            return [
                Message("fetched", {"name": message.name}, {"data": self.resource(message.name)})
            ]
        with self._lock:
            session, looks = self.session, self._looks
            assert looks is not None
            match message:
                case protocol.SaveLook() | protocol.RenameLook() | protocol.CopyLook():
                    return [looks.said(message)]
                case protocol.MixLooks() | protocol.DropLook():
                    return [looks.said(message)]
                case protocol.LoadLook():
                    made = [looks.load(message)]
                case protocol.Export():
                    return self._later(self._export, message)
                case protocol.Verify():
                    return self._verify(message)
                case protocol.Explain():
                    return self._later(self._explain, message)
                case _:
                    made = session.said(message, arrays)
        self._ring()
        return made

    def moment(self) -> Moment:
        """What is painted and asked now. Raises PaintError before there is a basis."""
        with self._lock:
            return self.session.moment()

    def load(self, image: Floats, importance: Floats, wishes: Wishes, label: str) -> Message:
        """Go on from another painting and what was asked with it: one step, a `patch`.

        Raises LightpaintError for what cannot be asked, and has changed nothing then.
        """
        with self._lock:
            made = self.session.load(image, importance, wishes, label)
        self._ring()
        return made

    def resource(self, name: str) -> npt.NDArray[Any]:
        """A picture by name. Raises PaintError if there is none."""
        with self._lock:
            return self.pictures[name]

    # Beside it

    def _say(self, message: Message | None) -> None:
        if message is not None and self.on_message is not None and self._is_open:
            self.on_message(message)

    def _hears(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        if not self._is_open:
            raise StoppedError
        about = {"what": label, "done": done, "total": total, "unit": unit}
        if self._session is None:
            self._progress = about
        self._say(Message("progress", about))

    def _later(self, work: Callable[[Any], None], message: Any) -> list[Message]:
        """Do it in a thread of its own; what fails is said."""

        def run() -> None:
            give_way()
            try:
                work(message)
            except StoppedError:
                self._say(Message("progress", {"what": "", "done": 1, "total": 1}))
            except Exception as error:
                self._say(Message("say", {"text": _told(error), "tone": "warn"}))

        Thread(target=run, name=f"lightpaint-{work.__name__}", daemon=True).start()
        return [Message("started", {"what": type(message).__name__.lower()})]

    def _obtain(self) -> None:
        """The basis, better and better."""
        give_way()
        try:
            for basis in self.subject.bases(self._hears):
                self._take(basis)
            self._say(Message("progress", {"what": "basis", "done": 1, "total": 1, "unit": ""}))
            self._clean()
        except StoppedError:
            pass
        except Exception as error:
            is_told = self._session is None and self.on_failure is not None
            self._failed = _told(error, at_length=not is_told)
            self._say(Message("say", {"text": self._failed, "tone": "warn"}))
            if self._session is None:
                self.failure = error
                self._say(self.state())
            if is_told and self._is_open:
                self.on_failure(error)  # type: ignore[misc]

    def _take(self, basis: Basis) -> None:
        """Paint on with this basis."""
        clean = kept_clean(basis) if self.subject.settings.use_cache else None
        present = denoised(basis.present_look, basis.features) if clean is None else clean.present
        with self._lock:
            if not self._is_open:
                raise StoppedError
            if self._session is None:
                store = self._open_store(Identity.of(basis))
                self._session = Session(
                    basis,
                    present,
                    store,
                    settings=self.subject.settings,
                    transform=self.subject.transform(basis),
                    constraints=self.subject.constraints,
                )
                self._looks = Looks(self._session, self.pictures)
            else:
                self._session.improve(basis, present)
            self._offer(self._session, clean)
        self._say(self.state())
        self._ring()

    def _offer(self, session: Session, clean: Clean | None) -> None:
        basis, offer = session.basis, self.pictures.offer
        for k, plane in enumerate(basis.images):
            offer(f"plane/{k}", lambda p=plane: pictures.as_halves(p, pictures.scale_of(p)))  # type: ignore[misc]
            offer(f"thumb/{k}", lambda k=k: pictures.small(basis, k))  # type: ignore[misc]
            if clean is None:
                self.pictures.withdraw(f"clean/{k}")
            else:
                self.pictures.put(f"clean/{k}", clean.planes[k])
        offer("present", lambda: pictures.as_halves(session.present))
        offer("painting", lambda: session.image.copy())
        offer("importance", lambda: session.importance.copy())
        if basis.features is not None:
            albedo = basis.features.albedo
            offer("albedo", lambda: pictures.as_halves(albedo))
        if basis.objects is not None:
            index = basis.objects.index
            offer("objects", lambda: index.astype(np.int16))
        for transform in self._transforms(session):
            offer(f"lut/{transform.name}", lambda t=transform: pictures.table_of(t))  # type: ignore[misc]

    def _transforms(self, session: Session) -> list[Any]:
        own = session.transform.name
        names = [*pictures.TRANSFORMS, *([own] if own not in pictures.TRANSFORMS else [])]
        return [type(session.transform)(name) for name in names]

    def _of_basis(self, basis: Basis, session: Session) -> dict[str, Any]:
        wanted = self.subject.wanted
        looks = self._looks.listed() if self._looks is not None else []
        scales = [pictures.scale_of(plane) for plane in basis.images]
        return {
            "size": list(basis.size),
            "lights": [
                {**light_fields(light), "scale": scale}
                for light, scale in zip(basis.lights, scales, strict=True)
            ],
            "objects": [] if basis.objects is None else list(basis.objects.names),
            "transforms": [x.name for x in self._transforms(session)],
            "transform": {"name": session.transform.name, "stops": session.transform.stops},
            "lut": {"side": pictures.SIDE, "low": pictures.LOW, "high": pictures.HIGH},
            # These two change under the brush.
            "resources": self.pictures.named()
            | dict.fromkeys(("painting", "importance"), session.version),
            "looks": looks,
            "basis": {
                "spp": basis.origin.spp,
                "wanted": wanted or basis.origin.spp,
                "done": wanted is None or basis.origin.spp >= wanted,
            },
            "has_noise": basis.knows_noise,
            "first": not session.store.steps,
            "stroke": session.stroke,
            "command": self._command(session.wishes),
        }

    def _command(self, wishes: Wishes) -> str:
        """The command that answers the exported painting alike, where there are commands."""
        subject = self.subject
        return subject.command(str(subject.folder / PAINTING), wishes)

    def _clean(self) -> None:
        """Planes without their grain, one after the other."""
        session = self._session
        assert session is not None
        basis = session.basis
        if not basis.knows_noise or "clean/0" in self.pictures.generations:
            return
        planes = np.empty(basis.images.shape, np.float16)
        for k, plane in enumerate(basis.images):
            if not self._is_open or session.basis is not basis:
                return
            clean = planes[k] = pictures.as_halves(
                pictures.clean_plane(basis, k), pictures.scale_of(plane)
            )
            with self._lock:
                self.pictures.put(f"clean/{k}", clean)
                new = {f"clean/{k}": self.pictures.generations[f"clean/{k}"]}
            self._say(Message("renewed", {"resources": new}))
        if self.subject.settings.use_cache:
            keep_clean(basis, Clean(session.present, planes))

    def _ring(self) -> None:
        with self._bell:
            self._unsettled = True
            self._bell.notify_all()

    def _settle(self) -> None:
        """The exact answer, whenever the brush rests; then what is known of it.

        It gives way by giving up. Were it less urgent than others, who needs the interpreter, or a
        lock, would wait for it as long as they keep it from the processor.
        """
        while True:
            with self._bell:
                self._bell.wait_for(lambda: self._unsettled or not self._is_open)
                if not self._is_open:
                    return
                self._unsettled = False
            time.sleep(REST_S)
            with self._bell:
                if self._unsettled:
                    continue
            try:
                self._find()
            except Exception as error:
                # A mistake of our own ends no session: the next stroke is answered again.
                self._say(Message("say", {"text": _told(error), "tone": "warn"}))

    def _find(self) -> None:
        with self._lock:
            session = self._session
            if session is None or session.is_open:
                return
            moment = session.moment()

        def check() -> None:
            if moment.version != session.version or not self._is_open:
                raise OldError

        # The next stroke gets the processors at once, and rings when it is done.
        with suppress(OldError), while_wanted(check):
            solution = moment.solution()
            self._tell(lambda: session.settled(moment, solution))
            if solution is None:
                return
            check()
            [analysis] = analyse(solution)
            self._tell(lambda: session.settled(moment, solution, **analysis_fields(analysis)))

    def _tell(self, make: Callable[[], Message | None]) -> None:
        with self._lock:
            message = make()
            self._known = message.fields if message is not None else self._known
        self._say(message)

    # Long work

    def _answer(self) -> tuple[Moment, Lighting]:
        """What is painted now, and the exact answer to it."""
        with self._lock:
            session = self._session
            assert session is not None
            moment, weights = session.moment(), session.weights
        solution = moment.solution()
        if solution is None:
            return moment, Lighting.of_weights(moment.basis, weights)
        solution = with_findings(solution, analyse(solution))
        return moment, solution.lighting

    def _export(self, message: protocol.Export) -> None:
        # It brings all rooms, of which painting needs a few.
        from lightpaint.paint.exports import export

        moment, lighting = self._answer()

        def hears(label: str, done: int, total: int, unit: str = "passes") -> None:
            del label  # what it is at within an export is no news to a page
            self._hears("export", done, total, unit)

        with self._render:
            files = export(self.subject, moment, lighting, message.what, hears)
        command = self._command(moment.wishes)
        self._say(Message("exported", {"files": [str(x) for x in files], "command": command}))

    def _verify(self, message: protocol.Verify) -> list[Message]:
        if not message.run:
            self._renders = False
            return [Message("started", {"what": "stop"})]
        if self.subject.scene is None:
            raise PaintError("there is no scene to render: it was opened from a saved basis")
        return self._later(self._verified, message)

    def _verified(self, _asked: protocol.Verify) -> None:
        from lightpaint.paint.exports import verified

        moment, lighting = self._answer()

        def hears(label: str, done: int, total: int, unit: str = "passes") -> None:
            if not self._renders:
                raise StoppedError
            self._hears(label, done, total, unit)

        self._renders = True
        with self._render:
            picture, said, agrees = verified(self.subject, moment.basis, lighting, hears)
        with self._lock:
            self.pictures.put("verified", pictures.as_halves(picture))
            new = {"verified": self.pictures.generations["verified"]}
        self._say(Message("renewed", {"resources": new}))
        self._say(Message("verified", {"agrees": agrees, "text": said}))

    def _explain(self, _: protocol.Explain) -> None:
        with self._lock:
            assert self._session is not None
            moment = self._session.moment()
        said, beyond = moment.beyond()
        with self._lock:
            self.pictures.put("beyond", beyond)
            new = {"beyond": self.pictures.generations["beyond"]}
        self._say(Message("renewed", {"resources": new}))
        self._say(Message("explained", {"sentences": said}))


def _told(error: Exception, *, at_length: bool = True) -> str:
    """What to say of it; a mistake of lightpaint's own is told at length where it was started."""
    if isinstance(error, LightpaintError):
        return str(error)
    if at_length:
        traceback.print_exception(error)
    return f"this failed inside lightpaint: {type(error).__name__}: {first_line(error)}"


def give_way() -> None:
    """Let this thread, and those that it starts, leave the processors to more urgent ones."""
    if sys.platform == "linux":
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, get_native_id(), NICE)
