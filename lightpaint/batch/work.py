"""Doing a task: what a worker has at hand, and what it writes."""

import errno
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from lightpaint.basis.basis import Basis
from lightpaint.basis.render.parts import lesson
from lightpaint.batch.errands import Done, Errand, Lesson, PartOfBasis, Passes, SumsOfRows
from lightpaint.batch.held import Held
from lightpaint.batch.keys import Space
from lightpaint.batch.lights import answer_by_sums
from lightpaint.batch.rows import sums_of_rows
from lightpaint.batch.sequence import between
from lightpaint.batch.task import Task
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
from lightpaint.scene.scene import Scene
from lightpaint.settings import Settings
from lightpaint.sources import BasisFile, from_json

#: What the system says of a disk that takes no more.
FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}

#: Characters of a reason.
LONGEST = 600

#: What is said of one that memory does not suffice for.
TOO_LARGE = "it takes more memory than there is: use resolution=... or fewer workers"


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
        held.rest()
        return lesson(held.film(errand.film), errand.spp, errand.seed)
    if isinstance(errand, PartOfBasis):
        return held.renderer(errand).render(errand.part)
    if isinstance(errand, SumsOfRows):
        return sums_of_rows(errand, held)
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
    if task.is_by_sums:
        answer_by_sums(job, job.views[0].basis or (bases or [])[0])
        return
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
