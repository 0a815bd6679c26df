"""Exports of a session: files for other programs, the verification render, and their folders: each
export gets a new one, so that none replaces another; and final renders of its answers: in the
background, one at a time, kept with the session.
"""

import re
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from itertools import count
from pathlib import Path
from threading import Condition, Lock
from typing import Any

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis import Basis
from lightpaint.colour import ViewTransform, to_8_bit
from lightpaint.display_text import visible
from lightpaint.errors import OutputError, PaintError
from lightpaint.files import check_writable, one_line, write_bytes
from lightpaint.images import denoised, denoiser_text
from lightpaint.images.formats import png_bytes
from lightpaint.lighting import Lighting, combine
from lightpaint.paint import protocol
from lightpaint.paint.background_threads import StoppedError, error_text
from lightpaint.paint.layers.canvas import ViewLayers
from lightpaint.paint.layers.layer_files import write_layers_exr, write_layers_openraster
from lightpaint.paint.protocol import Message, RenderInfo, RenderList
from lightpaint.paint.session.picture_table import Picture, display_thumbnail
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.session_access import StudioLinks
from lightpaint.paint.store.session_file import StoredRecords
from lightpaint.paint.subject import Subject, layers_paths, painting_path, picture_path, view_at
from lightpaint.pipeline import LIGHTING, RELIT, Job, run, write_answer
from lightpaint.progress import Progress, cancellable
from lightpaint.relit import relight, verify_in_stages
from lightpaint.report import CleanLooks, spoken_distance
from lightpaint.scene import load_scene
from lightpaint.scene.runtime.render_lock import MITSUBA
from lightpaint.target import texts_of, write_painting

#: Folders of named exports and of final renders, in the folder of the session.
EXPORTS, RENDERS = "exports", "renders"

#: Longest name of an export, in bytes; a number and suffixes are added to it.
MAX_NAME_BYTES = 160

#: Characters that a name of a folder cannot have on some system.
_FORBIDDEN = re.compile(r'[/\\:*?"<>|]')

#: Folder of the report, in the folder of the session.
ANSWER_FOLDER = "answer"

#: Exports that write the painting, and those that need one.
WRITES_PAINTING = {"target", "report"}
NEEDS_PAINTING = WRITES_PAINTING | {"layers"}

#: Approximate pixels of the longer side of a render's small picture.
PREVIEW_SIDE = 480

#: Seconds between two looks at whether a waiting render was stopped.
_PATIENCE = 0.2

#: States in which nothing happens any more.
ENDED = ("done", "stopped", "failed")

#: Names of the pictures that a render is written as, by format.
PICTURES = {"exr": "render.exr", "png": "render.png"}

#: The exact answer, with the scenes that it is for; its argument raises to stop.
ExactAnswer = Callable[[Callable[[], None]], tuple[tuple[Subject, ...], SessionSnapshot, Lighting]]


def folder_name(name: str) -> str:
    """Return a name for a folder on any system. Raises PaintError if nothing of `name` is left.

    Slashes and the like become hyphens. Points and spaces at both ends are left out, since they
    hide a folder on some systems and are lost on others.
    """
    text = "".join(x for x in " ".join(name.split()) if visible(x) == x)
    text = _FORBIDDEN.sub("-", text).strip(". ")
    text = text.encode()[:MAX_NAME_BYTES].decode(errors="ignore").rstrip(". ")
    if not text.strip("-"):
        raise PaintError(
            f"{one_line(name)!r} cannot be the name of a folder: give this export another name"
        )
    return text


@contextmanager
def new_folder(parent: Path, name: str) -> Iterator[Path]:
    """Yield a new folder in `parent` for the files of an export.

    name: as given; a number follows it if that folder exists: `evening`, `evening 2`. A folder
    without files is deleted at the end. Raises PaintError as `folder_name` does, and OutputError
    if no folder can be made.
    """
    folder = _make_folder(parent, folder_name(name))
    try:
        yield folder
    finally:
        with suppress(OSError):  # raised for a folder with files
            folder.rmdir()
            parent.rmdir()


def _make_folder(parent: Path, name: str) -> Path:
    """Make and return the first folder of that name and a number that nobody has made yet."""
    for number in count(1):
        folder = parent / (name if number == 1 else f"{name} {number}")
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            continue
        except OSError as error:
            raise OutputError(f"cannot make {folder}: {error.strerror}") from None
        return folder
    raise AssertionError


def export(
    subjects: Sequence[Subject],
    snapshot: SessionSnapshot,
    lighting: Lighting,
    outputs: Sequence[str],
    progress: Progress,
    layers: Sequence[ViewLayers] = (),
) -> Iterator[Path]:
    """Write the requested files into the folder of the session; yield each one once it exists.

    subjects, layers: of all views; layers are needed for their files alone. If nothing is painted,
    files that need a painting are left out. Raises PaintError for files that this session cannot
    export, OutputError for files that cannot be written.
    """
    if not snapshot.painted_views:
        outputs = [name for name in outputs if name not in NEEDS_PAINTING]
        if not outputs:
            raise PaintError("nothing is painted yet: there is no painting to write")
    first, folder = subjects[0], subjects[0].folder
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make {folder}: {error.strerror}") from None
    if set(outputs) & WRITES_PAINTING:
        for sensor, target in zip(snapshot.painted_sensors, snapshot.painted_targets, strict=True):
            write_painting(painting_path(folder, sensor), target)
            yield painting_path(folder, sensor)
    if "layers" in outputs:
        yield from _write_layers(folder, snapshot, layers)
    if "picture" in outputs:
        for sensor, basis in zip(snapshot.sensors, snapshot.bases, strict=True):
            write_bytes(
                picture_path(folder, sensor), answer_png(basis, lighting, snapshot.transform)
            )
            yield picture_path(folder, sensor)
    if "lighting" in outputs:
        write_answer(folder, lighting)
        yield folder / LIGHTING
    if "relit" in outputs:
        if first.scene is None:
            raise PaintError("there is no scene to relight: it was opened from a saved basis")
        write_answer(folder, lighting, scene=first.loaded_scene, has_lighting=True)
        yield folder / RELIT
    if "report" in outputs:
        yield from _write_report(subjects, snapshot, progress)


def _write_layers(
    folder: Path, snapshot: SessionSnapshot, layers: Sequence[ViewLayers]
) -> Iterator[Path]:
    """Write the layers of each painted view."""
    for view, sensor in zip(snapshot.painted_views, snapshot.painted_sensors, strict=True):
        exr, openraster = layers_paths(folder, sensor)
        write_layers_exr(exr, layers[view], snapshot.bases[view].origin.sensor)
        yield exr
        target = snapshot.targets[view]
        assert target is not None
        write_layers_openraster(openraster, layers[view], target.image, snapshot.transform)
        yield openraster


def answer_png(basis: Basis, lighting: Lighting, transform: ViewTransform) -> bytes:
    """Return the answer in a view as pages and reports show it: a PNG, through `transform`,
    denoised.
    """
    weights = lighting.weights_for(basis)
    looks = CleanLooks.clean(basis, weights, basis.mix(weights), None)
    pixels = to_8_bit(transform.encode(looks.predicted))
    return png_bytes(pixels, texts_of(transform) | denoiser_text(basis.features, raw="not kept"))


def _write_report(
    subjects: Sequence[Subject], snapshot: SessionSnapshot, progress: Progress
) -> list[Path]:
    """Run `solve` on the current paintings; return the reports."""
    answer = subjects[0].folder / ANSWER_FOLDER
    # In the painter no light moves unless somebody moves it.
    settings = replace(snapshot.settings, force=True, move_lights=False)
    painted_subjects = [subjects[k] for k in snapshot.painted_views]
    scenes = tuple(
        subject.loaded_scene for subject in painted_subjects if subject.scene is not None
    )
    targets, constraints = snapshot.painted_targets, snapshot.constraints
    if len(subjects) == 1:
        groups = subjects[0].groups
        basis = snapshot.bases[0] if groups is None else groups
        job, bases = Job(scenes, targets, answer, basis, constraints, settings), None
    elif scenes:
        bases = [snapshot.bases[k] for k in snapshot.painted_views]
        # The scenes are already on their film, and the bases have their samples.
        spp = bases[0].origin.spp if settings.checks_as_basis else settings.spp
        rendered: dict[str, Any] = {"resolution": None, "quality": None, "time_s": None, "spp": spp}
        settings = replace(settings, **rendered, error=None)
        job = Job(scenes, targets, answer, None, constraints, settings, by_sensor=True)
    else:
        raise PaintError("a report of several saved bases needs their scene: open that instead")
    run(job, progress, bases=bases)
    return [view.folder / "report.html" for view in job.views]


def render_verification(
    subject: Subject, basis: Basis, lighting: Lighting, progress: Progress
) -> tuple[Floats, str, bool]:
    """Render the relit scene. Returns the denoised picture (h, w, 3), a sentence, and whether it
    agrees.
    """
    scene = subject.loaded_scene
    with tempfile.TemporaryDirectory(prefix="lightpaint-") as place:
        relit = relight(scene, lighting, Path(place) / RELIT)
        if relit.sensor != scene.sensor:
            relit = load_scene(relit.path, sensor=scene.sensor, use_lights_file=False, lamps=["*"])
        predicted = combine(basis, lighting)
        result = verify_in_stages(
            predicted, relit, basis, lighting, spp=basis.origin.spp, progress=progress
        )
    picture = denoised(result.verified.image, basis.features)
    state = "equal within noise" if result.agrees else "NOT equal, by more than noise explains"
    if result.agrees and result.is_blind:
        state = "nothing found against it"
    text = f"Rendered again with {result.spp} samples per pixel: {state}"
    # How many standard errors apart they are helps whoever looks for a mistake.
    text += "." if result.agrees else f" ({spoken_distance(result)})."
    return picture, text, result.agrees


class FinalRenders:
    """The final renders that pages have requested, also before the painter was started anew.

    links: to the session, which keeps the list. subjects: the views. exact_answer: as
    `BackgroundJobs.exact_answer`.

    Attributes:
        infos: Their descriptions, the oldest first.
    """

    def __init__(
        self,
        links: StudioLinks,
        subjects: tuple[Subject, ...],
        exact_answer: ExactAnswer,
    ) -> None:
        self._access, self._publisher, self._threads = links
        self._subjects, self._exact_answer = subjects, exact_answer
        self._infos: dict[int, RenderInfo] = {}
        self._records: StoredRecords[RenderInfo] | None = None  # until there is a session
        self._previews: dict[int, Picture] = {}
        self._change, self._turn = Condition(), Lock()
        self._publisher.pictures.offer_family("render", self._preview)
        self._publisher.pictures.offer_family("render_file", self._file)

    @property
    def infos(self) -> tuple[RenderInfo, ...]:
        with self._change:
            self._open_records()
            return tuple(self._infos.values())

    def _open_records(self) -> StoredRecords[RenderInfo] | None:
        """Return the records in the session file, whose renders are listed; None without a session.

        A render that the end of the painter has interrupted is stopped. Files that are gone are no
        longer listed, nor are renders without a picture.
        """
        if self._records is None and (store := self._access.store) is not None:
            self._records = StoredRecords(store, "renders", RenderInfo)
            for info in self._records.read():
                if info.state not in ENDED:
                    self._infos[info.id] = replace(info, state="stopped")
                    continue
                files = tuple(file for file in info.files if Path(file).is_file())
                has_picture = any(Path(file).name in PICTURES.values() for file in files)
                if has_picture or info.state != "done":
                    self._infos[info.id] = replace(info, files=files)
        return self._records

    def _store_infos(self) -> None:
        """Write the list into the session file."""
        if (records := self._open_records()) is not None:
            records.write(list(self._infos.values()))

    def handle(
        self, message: protocol.RenderFinal | protocol.StopRender | protocol.DropRender
    ) -> list[Message]:
        """Start a render, stop one, or take one off the list, and return the list.

        Raises PaintError for a render that is impossible or unknown, and OutputError for one that
        cannot be written.
        """
        match message:
            case protocol.RenderFinal():
                info = self._start(message)
                self._threads.start_low_priority(lambda: self._run(info.id, message), "final")
            case protocol.StopRender(number):
                self._find(number)
                self._change_info(number, state="stopped")
            case protocol.DropRender(number):
                if self._find(number).state not in ENDED:
                    raise PaintError(f"render {number} is not finished: stop it first")
                with self._change:
                    del self._infos[number]
                    self._previews.pop(number, None)
                    self._store_infos()
        return [RenderList(renders=self.infos)]

    def _start(self, request: protocol.RenderFinal) -> RenderInfo:
        """Add a render to the list. Raises PaintError, and OutputError if it cannot be written."""
        subject = view_at(self._subjects, request.view)
        if subject.scene is None:
            raise PaintError("there is no scene to render: it was opened from a saved basis")
        folder_name(request.name)
        check_writable(subject.folder / RENDERS)
        with self._change:
            self._open_records()
            number = max(self._infos, default=0) + 1
            info = RenderInfo(
                id=number,
                name=request.name,
                view=request.view,
                width=request.width,
                spp=request.spp,
                formats=request.formats,
            )
            self._infos[number] = info
            self._store_infos()
        return info

    def _run(self, number: int, request: protocol.RenderFinal) -> None:
        def check() -> None:
            if self._is_ended(number) or not self._publisher.is_open:
                raise StoppedError

        try:
            with suppress(StoppedError), cancellable(check):
                # That of now, also if it is rendered only after others.
                subjects, snapshot, lighting = self._exact_answer(check)
                self._wait_for_earlier(number, check)
                with self._turn, MITSUBA.low_priority():
                    check()
                    subject = subjects[request.view]
                    self._render(number, request, subject, snapshot, lighting)
        except Exception as error:
            self._update(number, state="failed", text=error_text(error))

    def _wait_for_earlier(self, number: int, check: Callable[[], None]) -> None:
        """Wait until the renders that were requested before have ended; check raises to stop."""
        with self._change:
            while not all(x >= number or self._is_ended(x) for x in self._infos):
                self._change.wait(_PATIENCE)
                check()

    def _render(
        self,
        number: int,
        request: protocol.RenderFinal,
        subject: Subject,
        snapshot: SessionSnapshot,
        lighting: Lighting,
    ) -> None:
        """Render the answer in a view, and write it to a new folder."""
        # Imported here: they load all rooms, and painting needs only a few.
        from lightpaint.pipeline import render_final, write_final_exr, write_final_png

        def report(label: str, done: int, total: int, unit: str = "passes") -> None:
            if not self._change_info(number, done=done, total=total):
                raise StoppedError
            self._publisher.report_progress(label, done, total, unit)

        self._update(number, state="rendering")
        picture = render_final(
            subject.loaded_scene, lighting, width=request.width, spp=request.spp, progress=report
        )
        files: list[Path] = []
        with new_folder(subject.folder / RENDERS, request.name) as folder:
            if "exr" in request.formats:
                files.append(folder / PICTURES["exr"])
                write_final_exr(files[-1], picture)
            if "png" in request.formats:
                files.append(folder / PICTURES["png"])
                write_final_png(files[-1], picture, snapshot.transform)
            write_answer(folder, lighting)
            files.append(folder / LIGHTING)
        self._previews[number] = display_thumbnail(picture.clean, snapshot.transform, PREVIEW_SIDE)
        names = tuple(str(file.absolute()) for file in files)
        self._update(number, state="done", height=picture.image.size[0], files=names)

    def _is_ended(self, number: int) -> bool:
        info = self._infos.get(number)
        return info is None or info.state in ENDED

    def _change_info(self, number: int, **changes: Any) -> bool:
        """Change the description of a render; one that has ended stays, and False is returned."""
        with self._change:
            if self._is_ended(number):
                return False
            self._infos[number] = replace(self._infos[number], **changes)
            if "state" in changes:  # and not with every pass
                self._store_infos()
            self._change.notify_all()
            return True

    def _update(self, number: int, **changes: Any) -> None:
        """Change the description of a render, and tell pages. Not for the thread of requests."""
        if self._change_info(number, **changes):
            self._publisher.publish_made(lambda: RenderList(renders=self.infos))

    def _find(self, number: int) -> RenderInfo:
        if number not in {info.id for info in self.infos}:
            raise PaintError(f"there is no render {number}")
        return self._infos[number]

    def _preview(self, name: str) -> Picture:
        number = int(name) if name.isdecimal() else 0
        info = next((x for x in self.infos if x.id == number and x.state == "done"), None)
        if info is None:
            raise PaintError(f"there is no picture {f'render/{name}'[:40]!r}")
        if number not in self._previews:
            self._previews[number] = self._preview_of_files(info)
        return self._previews[number]

    def _preview_of_files(self, info: RenderInfo) -> Picture:
        """Return the small picture of a render of before. Raises LightpaintError without a file."""
        # Imported here, as what renders is.
        from lightpaint.images import read_picture
        from lightpaint.pipeline import DENOISED

        by_name = {Path(file).name: file for file in info.files}
        if file := by_name.get(PICTURES["png"]):
            picture = read_picture(file)
        else:
            picture = read_picture(by_name[PICTURES["exr"]], layer=DENOISED)
        transform = picture.transform or self._access.session.transform
        return display_thumbnail(picture.image, transform, PREVIEW_SIDE)

    def _file(self, name: str) -> Picture:
        """Return the bytes of a finished render's file, uint8. name: as in `2/render.png`."""
        number, _, file_name = name.partition("/")
        known = self._infos.get(int(number)) if number.isdecimal() else None
        files: Mapping[str, str] = {Path(x).name: x for x in known.files} if known else {}
        if file_name not in files:
            raise PaintError(f"there is no file {f'render_file/{name}'[:40]!r}")
        try:
            return np.fromfile(files[file_name], np.uint8)
        except OSError as error:
            raise PaintError(f"cannot read {files[file_name]}: {error.strerror}") from None
