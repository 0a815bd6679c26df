"""Long tasks of a session in threads of their own: exports, verification, previews and others."""

from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Any, Literal

from lightpaint.basis import Basis, DenoisedPlanes, as_halves
from lightpaint.errors import PaintError
from lightpaint.lighting import Lighting, analyse, dimmed, with_findings
from lightpaint.paint import protocol
from lightpaint.paint.background_threads import StoppedError
from lightpaint.paint.protocol import (
    Explanation,
    ExportResult,
    Message,
    PreviewResult,
    TaskStarted,
    TaskStopped,
    VerificationResult,
)
from lightpaint.paint.rig.light_mover import LightMover
from lightpaint.paint.rig.moved_looks import of_moved_scenes, shadow_remark, write_places
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.session_access import StudioLinks
from lightpaint.paint.store.history_steps import name_in_view
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.paint.studio import session_exports
from lightpaint.paint.studio.session_exports import (
    EXPORTS,
    NEEDS_PAINTING,
    WRITES_PAINTING,
    folder_name,
    new_folder,
)
from lightpaint.paint.subject import Subject, painting_path, view_at
from lightpaint.progress import cancellable

#: Names of long tasks.
TaskName = Literal["export", "verify", "explain"]

JobRequest = protocol.Export | protocol.Verify | protocol.Explain


def _absolute_names(files: Iterable[Path]) -> tuple[str, ...]:
    """Return the paths as a page shows them."""
    return tuple(str(x.absolute()) for x in files)


class BackgroundJobs:
    """Exports, verifications, explanations and previews of one studio.

    One job writes at a time, and one verifies. A later verification replaces an earlier one, since
    the answer may have changed by then.

    mover: has the lights that the session has moved. clean_planes: returns the denoised planes of
    bases; None for each that has none yet.
    """

    def __init__(
        self,
        links: StudioLinks,
        mover: LightMover,
        *,
        clean_planes: Callable[[Sequence[Basis]], Sequence[DenoisedPlanes | None]],
    ) -> None:
        self._access, self._publisher, self._threads = links
        self._mover, self._clean_planes = mover, clean_planes
        self._subjects = mover.rig.subjects
        self._write_lock, self._render_lock = Lock(), Lock()
        self._verifications: dict[
            int, tuple[int, VerificationResult]
        ] = {}  # last verification of each view, with the session's version at its render
        self._preview_number = 0  # number of the last requested preview
        self._verify_request: protocol.Verify | None = (
            None  # the last request; None if it was stopped
        )
        self._stop_count = 0  # how often exports were stopped

    def handle(self, message: JobRequest) -> list[Message]:
        """Start a job, or stop one. Raises PaintError for jobs that this session cannot run."""
        starters: dict[type, tuple[TaskName, Callable[[Any], None]]] = {
            protocol.Export: ("export", partial(self._run_export, stop_count=self._stop_count)),
            protocol.Verify: ("verify", self._run_verify),
            protocol.Explain: ("explain", self._run_explain),
        }
        if isinstance(message, protocol.Verify):
            if not message.run:
                self._verify_request = None
                return [TaskStarted(task="stop")]
            if view_at(self._subjects, message.view).scene is None:
                raise PaintError("there is no scene to render: it was opened from a saved basis")
            # Set here, not in its thread: the next message may stop it.
            self._verify_request = message
        elif isinstance(message, protocol.Explain):
            view_at(self._subjects, message.view)
        elif not message.run:
            self._stop_count += 1
            return [TaskStarted(task="stop")]
        elif message.name:
            folder_name(message.name)
        task_name, work = starters[type(message)]
        self._threads.start_low_priority(lambda: work(message), task_name)
        return [TaskStarted(task=task_name)]

    def start_preview(self, message: protocol.Preview, requests: SessionRequests) -> list[Message]:
        """Start to compute the effect of a change. Raises PaintError for an unknown view.

        requests: those after the change. A later preview replaces an earlier one.
        """
        view_at(self._subjects, message.view)
        self._preview_number = message.number
        self._threads.start_low_priority(lambda: self._run_preview(message, requests), "preview")
        return [TaskStarted(task="preview")]

    def solve_command(
        self, sensors: Sequence[str], requests: SessionRequests, folder: Path | None = None
    ) -> str:
        """Return the command that solves exported paintings to the same answer; "" if none.

        folder: with these paintings; by default the folder of the session.
        """
        subject = self._subjects[0]
        folder = folder or subject.folder
        paths = {sensor: str(painting_path(folder, sensor)) for sensor in sensors}
        return subject.command(paths, requests) if paths else ""

    def verifications(self, version: int) -> tuple[VerificationResult, ...]:
        """Return the last verification of each view, marked as old if the session has changed."""
        results = list(self._verifications.values())
        return tuple(
            replace(result, is_old=version_at_render != version)
            for version_at_render, result in results
        )

    def exact_answer(
        self, check: Callable[[], None]
    ) -> tuple[tuple[Subject, ...], SessionSnapshot, Lighting]:
        """Return the subjects with their current lights, the paintings, and the exact answer under
        the master dimmer.

        check: raises to stop.
        """
        self._mover.finish(self._access.session.requests.placed, check)
        snapshot, lighting = self._access.snapshot_and_lighting()
        is_moved = bool(snapshot.requests.placed)
        subjects, snapshot = of_moved_scenes(snapshot, self._mover.rig)
        solution = snapshot.solution()
        if solution is not None:
            lighting = with_findings(solution, analyse(solution)).lighting
        elif is_moved:
            lighting = snapshot.lighting_of(lighting.weights_for(snapshot.bases[0]))
        return subjects, snapshot, dimmed(lighting, snapshot.requests.master)

    def _run_export(self, message: protocol.Export, stop_count: int) -> None:
        """Write the requested files.

        stop_count: how often exports had been stopped when this one was requested.
        """

        def check() -> None:
            if self._stop_count != stop_count:
                raise StoppedError

        report = self._publisher.reporter(check, "export")
        files: list[Path] = []
        try:
            # A stop also ends the exact solve, which may take long.
            with cancellable(check):
                layers = self._access.layers() if "layers" in message.outputs else ()
                subjects, snapshot, lighting = self.exact_answer(check)
                with self._write_lock, self._export_folder(message.name) as folder:
                    check()
                    outputs = message.outputs
                    subjects = tuple(replace(subject, folder=folder) for subject in subjects)
                    for file in session_exports.export(
                        subjects, snapshot, lighting, outputs, report, layers
                    ):
                        files.append(file)  # one by one: a stop keeps those already written
                    if snapshot.requests.placed and WRITES_PAINTING & set(message.outputs):
                        places = snapshot.requests.placed
                        files.append(write_places(folder, self._mover.rig, places))
        except StoppedError:
            if self._stop_count != stop_count:
                result = ExportResult(files=_absolute_names(files), command="", is_stopped=True)
                self._publisher.publish(result)
            return
        # The command names only paintings that this export wrote: older files may differ.
        has_painting = bool(WRITES_PAINTING & set(message.outputs))
        is_missing = bool(NEEDS_PAINTING & set(message.outputs)) and not snapshot.painted_views
        sensors = snapshot.painted_sensors if has_painting and not is_missing else ()
        result = ExportResult(
            files=_absolute_names(files),
            command=self.solve_command(sensors, snapshot.requests, folder),
            is_unpainted=is_missing,
        )
        self._publisher.publish(result)

    def _export_folder(self, name: str) -> AbstractContextManager[Path]:
        """Return a new folder for the files of an export; without a name the name of the
        session."""
        session_folder = self._subjects[0].folder
        return new_folder(session_folder / EXPORTS, name) if name else nullcontext(session_folder)

    def _run_verify(self, request: protocol.Verify) -> None:
        def check() -> None:
            if self._verify_request is not request:
                raise StoppedError

        try:
            # A stop also ends the exact solve, which may take long.
            with self._render_lock, cancellable(check):
                check()
                self._render_and_compare(request.view, check)
        except StoppedError:
            if self._verify_request is None:  # otherwise a page would wait for the next one
                self._publisher.publish(TaskStopped(task="verify"))

    def _render_and_compare(self, view: int, check: Callable[[], None]) -> None:
        """Render the answer in a view and compare. check: raises StoppedError after a stop."""
        subjects, snapshot, lighting = self.exact_answer(check)
        picture, text, agrees = session_exports.render_verification(
            subjects[view], snapshot.bases[view], lighting, self._publisher.reporter(check)
        )
        if remark := shadow_remark(self._mover.rig, snapshot.requests.placed):
            text = f"{text} {remark}."
        check()
        self._publisher.publish_picture(name_in_view("verified", view), as_halves(picture))
        is_old = self._access.version != snapshot.version
        result = VerificationResult(agrees=agrees, text=text, view=view, is_old=is_old)
        self._verifications[view] = snapshot.version, result
        self._publisher.publish(result)

    def _run_preview(self, request: protocol.Preview, requests: SessionRequests) -> None:
        def check() -> None:
            if self._preview_number != request.number:
                raise StoppedError

        with suppress(StoppedError), cancellable(check):
            proposed, lighting = self._access.snapshot_and_lighting(requests)
            weights = lighting.weights_for(proposed.bases[0])
            clean = self._clean_planes(proposed.bases)[request.view]
            preview = proposed.preview(weights, request.view, clean=clean)
            check()
            is_old = self._access.version != proposed.version
            result = PreviewResult(
                number=request.number,
                view=request.view,
                text=preview.text,
                is_at_cost=preview.is_at_cost,
                is_old=is_old,
                before=preview.before,
                after=preview.after,
            )
            self._publisher.publish(result)

    def _run_explain(self, request: protocol.Explain) -> None:
        snapshot, _ = self._access.snapshot_and_lighting()
        sentences, picture = snapshot.explain(request.view)
        self._publisher.publish_picture(name_in_view("beyond", request.view), picture)
        is_old = self._access.version != snapshot.version
        self._publisher.publish(
            Explanation(sentences=tuple(sentences), view=request.view, is_old=is_old)
        )
