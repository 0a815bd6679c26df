"""Doing a task: what a worker has at hand, and what it writes."""

import errno
import time
from collections.abc import Callable, Collection, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from lightpaint.basis.basis import Basis
from lightpaint.basis.file import read_basis
from lightpaint.basis.render.parts import PartRenderer, lesson
from lightpaint.batch.errands import Done, Errand, Film, Lesson, PartOfBasis, Passes
from lightpaint.batch.frames import Frame
from lightpaint.batch.keys import Space
from lightpaint.batch.sequence import between
from lightpaint.batch.spool import read_lesson
from lightpaint.batch.task import Task, key_of_basis
from lightpaint.batch.variations import shifted
from lightpaint.errors import LightpaintError
from lightpaint.files import first_line, one_line
from lightpaint.images.estimate import Estimate
from lightpaint.job import Job
from lightpaint.lighting.file import read_lighting, write_lighting
from lightpaint.lighting.lighting import Lighting, combine
from lightpaint.pipeline import run
from lightpaint.progress import Listener
from lightpaint.relit.relight import check_relightable, relight, settle
from lightpaint.renders import relight_look, relit_folder
from lightpaint.result_folder import ResultFolder
from lightpaint.results import write_predicted
from lightpaint.scene.quality import on_film
from lightpaint.scene.scene import Scene
from lightpaint.settings import Settings
from lightpaint.sources import BasisFile, SceneFile, from_json

#: What the system says of a disk that takes no more.
FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}

#: Characters of a reason.
LONGEST = 600

#: What is said of one that memory does not suffice for.
TOO_LARGE = "it takes more memory than there is: use resolution=... or fewer workers"


class Held:
    """Scenes and bases that several looks share, each loaded or rendered once in this process."""

    def __init__(self) -> None:
        self._scenes: dict[str, SceneFile] = {}
        self._saved: dict[str, BasisFile] = {}
        self._bases: dict[str, Basis] = {}
        self._renderer: PartRenderer | Frame | None = None
        self._rendered = ""

    def scene(self, given: SceneFile) -> SceneFile:
        """The one that equals `given`, and is loaded by and by."""
        return self._scenes.setdefault(repr(given), given)

    def saved(self, given: BasisFile) -> BasisFile:
        """The one of the same file, which is read by and by."""
        return self._saved.setdefault(given.path, given)

    def basis(self, key: str) -> Basis | None:
        """That of that key, if it is held. key: `key_of_scene`."""
        return self._bases.get(key)

    def hold(self, key: str, basis: Basis) -> None:
        """Hold the basis of that key."""
        self._bases[key] = basis

    def read(self, key: str, file: str) -> None:
        """Hold the basis of that key, which was saved for workers."""
        if file and key not in self._bases:
            self._bases[key] = read_basis(file)

    def film(self, film: Film) -> Scene:
        """The scene on it."""
        self.rest()
        return on_film(self.scene(film.scene).content, film.quality, film.resolution)

    def renderer(self, errand: PartOfBasis) -> PartRenderer:
        """What renders that part; it stays loaded until the next errand is another basis's."""
        key = repr((errand.film.key, errand.seed, errand.learned))
        if not isinstance(self._renderer, PartRenderer) or self._rendered != key:
            scene = self.film(errand.film)
            learned = read_lesson(errand.learned) if errand.learned else None
            self._renderer, self._rendered = PartRenderer(scene, errand.seed, learned), key
        return self._renderer

    def frame(self, errand: Passes) -> Frame:
        """What renders those passes; it stays loaded as well."""
        key = repr((errand.relit, errand.final))
        if not isinstance(self._renderer, Frame) or self._rendered != key:
            scene = self.film(Film(errand.relit, None, errand.final.resolution))
            self._renderer, self._rendered = Frame(scene, errand.final), key
        return self._renderer

    def rest(self) -> None:
        """Let go of what is loaded to render parts."""
        if self._renderer is not None:
            self._renderer.close()
        self._renderer = None

    def only(self, keys: Collection[str]) -> None:
        """Let go of all bases but those."""
        self._bases = {key: basis for key, basis in self._bases.items() if key in keys}
        self._saved = {k: x for k, x in self._saved.items() if key_of_basis(x) in keys}


def do(errand: Errand, held: Held, listen: Listener) -> Done:
    """Do one errand; what prevents it is said in one line, and is its own failure alone."""
    return attempted(errand, lambda: _done(errand, held, listen))


def attempted(errand: Errand, work: Callable[[], Any]) -> Done:
    """What comes of `work`, which is that errand."""
    begun = time.perf_counter()
    failure, full, lost, value = "", False, False, None
    try:
        value = work()
    except LightpaintError as error:
        failure, full = str(error), is_full(error)
    except MemoryError:
        failure, lost = TOO_LARGE, True
    except OSError as error:
        failure, full = first_line(error), error.errno in FULL
    except Exception as error:  # a mistake of ours, or of a library's: the others go on
        failure = f"{type(error).__name__}: {first_line(error)}"
    spent_s = time.perf_counter() - begun
    said = one_line(failure, limit=LONGEST)
    return Done(errand.name, errand.kind, said, full, lost, spent_s, value=value)


def _done(errand: Errand, held: Held, listen: Listener) -> Any:
    """What an errand comes to, if that is not a folder that was filled."""
    if isinstance(errand, Lesson):
        return lesson(held.film(errand.film), errand.spp, errand.seed)
    if isinstance(errand, PartOfBasis):
        return held.renderer(errand).render(errand.part)
    if isinstance(errand, Passes):
        return held.frame(errand).sum(range(errand.first, errand.last))
    held.rest()
    assert isinstance(errand, Task)
    held.only(errand.bases)
    return (_answer if errand.kind == "answer" else final_render)(errand, held, listen)


def is_full(error: BaseException) -> bool:
    """Whether an error goes back to a disk that takes no more."""
    return any(isinstance(x, OSError) and x.errno in FULL for x in _causes(error))


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__ or error.__context__


def fields_of(task: Task, held: Held) -> dict[str, Any]:
    """Those of the task's job, with scenes and basis shared."""
    fields = from_json(task.job)
    fields["scenes"] = tuple(map(held.scene, fields["scenes"]))
    if isinstance(fields["basis"], BasisFile):
        fields["basis"] = held.saved(fields["basis"])
    return fields


def _answer(task: Task, held: Held, listen: Listener) -> None:
    fields = fields_of(task, held)
    for key, file in zip(task.bases, task.files, strict=True):
        held.read(key, file)
    if task.lightings:
        _made(task, fields, held, listen)
        return
    job = Job(**fields)
    bases = None
    if job.basis is None:
        bases = [basis for key in task.bases if (basis := held.basis(key)) is not None]
    run(job, listen, bases=bases)


def _made(task: Task, fields: dict[str, Any], held: Held, listen: Listener) -> None:
    """An answer that is made of others: a lighting as it is, warmer, or between two."""
    settings: Settings = fields["settings"]
    scene: Scene | None = None
    if fields["scenes"]:
        [file] = fields["scenes"]
        scene = file.content
    if fields["basis"] is not None:
        basis = fields["basis"].content
    else:
        basis = held.basis(task.bases[0])
        assert basis is not None
    lighting = made_of(task.lightings, basis, share=task.share, space=task.space)
    if task.mireds:
        dimmed = {light.name for light in basis.lights if light.is_scalar}
        lighting = shifted(lighting, task.mireds, dimmed)
    lighting = replace(lighting.named(task.look), cd_per_unit=settings.cd_per_unit)
    results = made_folder(fields["folder"], scene, task.lightings, force=settings.force)
    results.check()
    with results.filled() as folder:
        write_lighting(folder / "lighting.json", lighting)
        predicted = combine(basis, lighting)
        spp = settings.spp or basis.origin.spp
        write_predicted(folder / "predicted.exr", predicted, origin=basis.origin, spp=spp)
        if scene is not None:
            relight(scene, lighting, folder / "relit.xml")
            settle(scene, lighting, folder / "relit.xml", results.folder / "relit.xml")


def made_of(files: tuple[str, ...], basis: Basis, *, share: float, space: Space) -> Lighting:
    """The lighting of one file, or between those of two. Raises LightingError."""
    lightings = [read_lighting(file) for file in files]
    lighting = lightings[0] if len(lightings) == 1 else between(lightings, share, space=space)
    lighting.weights_for(basis)
    return lighting


def made_folder(
    folder: Path, scene: Scene | None, lightings: tuple[str, ...], *, force: bool
) -> ResultFolder:
    """Where an answer goes that is made of others."""
    reads = tuple(map(Path, lightings))
    files = [folder / "lighting.json", folder / "predicted.exr"]
    if scene is not None:
        files += check_relightable(scene, folder / "relit.xml")
        reads += scene.read_files
    answers = tuple(map(Path, lightings))
    return ResultFolder(folder, tuple(files), reads, answers, force=force)


def final_render(
    task: Task,
    held: Held,
    listen: Listener,
    rendered: Callable[[Scene], Estimate] | None = None,
) -> None:
    """The final render of a look that is answered. rendered: who renders, if others do."""
    fields = fields_of(task, held)
    [lighting] = map(Path, task.lightings)
    results = relit_folder(
        fields["scenes"][0].content, lighting, fields["folder"], force=fields["settings"].force
    )
    how: dict[str, Any] = {"spp": task.final.spp, "seed": task.final.seed}
    how["resolution"] = task.final.resolution
    relight_look(
        fields["scenes"][0].content,
        read_lighting(lighting),
        results,
        progress=listen,
        rendered=rendered,
        **how,
    )
