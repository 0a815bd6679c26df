"""Doing a task: what a worker has at hand, and what it writes."""

import errno
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from lightpaint.basis.basis import Basis
from lightpaint.basis.lightgroups.read import LightGroups
from lightpaint.basis.render.parts import lesson
from lightpaint.batch.manifest.keys import Space
from lightpaint.batch.manifest.sequence import between
from lightpaint.batch.manifest.variations import shifted
from lightpaint.batch.work.derived_looks import dimmed, leave_made, made_folder
from lightpaint.batch.work.row_sums import sums_of_rows
from lightpaint.batch.work.sums_answer import answer_by_sums
from lightpaint.batch.work.task import EXPORT, Task
from lightpaint.batch.work.work_items import Done, Errand, Lesson, PartOfBasis, Passes, SumsOfRows
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.errors import LightpaintError
from lightpaint.files import first_line, one_line, write_text
from lightpaint.images.estimate import Estimate
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.pipeline.job import Job
from lightpaint.pipeline.pipeline import run
from lightpaint.pipeline.renders import relight_look, relit_folder
from lightpaint.pipeline.result_folder import ResultFolder
from lightpaint.pipeline.results import view_names
from lightpaint.pipeline.settings import Settings
from lightpaint.pipeline.sources import BasisFile, GroupsFile, content, from_json
from lightpaint.progress import Listener
from lightpaint.relit.export_forms import Source, names_of_forms, writers_of
from lightpaint.scene.scene import Scene

#: What the system says of a disk that takes no more.
FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}

#: Characters of a reason.
LONGEST = 600

#: What is said of one that memory does not suffice for.
TOO_LARGE = "it takes more memory than there is: use resolution=... or fewer workers"


def do(errand: Errand, held: WorkerCache, listen: Listener) -> Done:
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


def _done(errand: Errand, held: WorkerCache, listen: Listener) -> Any:
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
    does = {"answer": _answer, "render": final_render, "export": _export}
    return does[errand.kind](errand, held, listen)


def is_full(error: BaseException) -> bool:
    """Whether an error goes back to a disk that takes no more."""
    return any(isinstance(x, OSError) and x.errno in FULL for x in _causes(error))


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__ or error.__context__


def fields_of(task: Task, held: WorkerCache) -> dict[str, Any]:
    """Those of the task's job, with scenes and basis shared."""
    fields = from_json(task.job)
    fields["scenes"] = tuple(map(held.scene, fields["scenes"]))
    if isinstance(fields["basis"], BasisFile | GroupsFile):
        fields["basis"] = held.saved(fields["basis"])
    return fields


def _answer(task: Task, held: WorkerCache, listen: Listener) -> None:
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


def _made(task: Task, fields: dict[str, Any], held: WorkerCache, listen: Listener) -> None:
    """An answer that is made of others: a lighting as it is, warmer, or between two."""
    settings: Settings = fields["settings"]
    scenes: list[Scene] = [file.content for file in fields["scenes"]]
    given = content(fields["basis"])
    groups = given if isinstance(given, LightGroups) else None
    bases: list[Basis] = [given if groups is None else groups.basis]
    if given is None:
        bases = [basis for key in task.bases if (basis := held.basis(key)) is not None]
    lighting = made_of(task.lightings, bases[0], share=task.share, space=task.space)
    if task.mireds:
        lighting = shifted(lighting, task.mireds, dimmed(bases[0]))
    lighting = replace(lighting.named(task.look), cd_per_unit=settings.cd_per_unit)
    views = view_names(scenes) if fields["by_sensor"] else [""]
    scene = scenes[0] if scenes else None
    how: dict[str, Any] = {"views": views, "groups": groups}
    results = made_folder(fields["folder"], scene, task.lightings, **how, force=settings.force)
    leave_made(results, lighting, bases, **how, scene=scene, spp=settings.spp)


def made_of(files: tuple[str, ...], basis: Basis, *, share: float, space: Space) -> Lighting:
    """The lighting of one file, or between those of two. Raises LightingError."""
    lightings = [read_lighting(file) for file in files]
    lighting = lightings[0] if len(lightings) == 1 else between(lightings, share, space=space)
    lighting.weights_for(basis)
    return lighting


def final_render(
    task: Task,
    held: WorkerCache,
    listen: Listener,
    rendered: Callable[[Scene], Estimate] | None = None,
) -> None:
    """The final renders of a look that is answered, one for each view.

    rendered: who renders, if others do.
    """
    fields = fields_of(task, held)
    [lighting] = map(Path, task.lightings)
    scenes: list[Scene] = [file.content for file in fields["scenes"]]
    views = view_names(scenes) if fields["by_sensor"] else [""]
    force = fields["settings"].force
    results = relit_folder(scenes[0], lighting, fields["folder"], views=views, force=force)
    how: dict[str, Any] = {"spp": task.final.spp, "seed": task.final.seed}
    how["resolution"] = task.final.resolution
    relight_look(
        dict(zip(views, scenes, strict=True)),
        read_lighting(lighting),
        results,
        progress=listen,
        rendered=rendered,
        **how,
    )


def _export(task: Task, held: WorkerCache, listen: Listener) -> None:
    """What other programs get of a look that is answered."""
    fields = fields_of(task, held)
    lighting, folder = Path(task.lightings[0]), fields["folder"] / EXPORT
    given = fields["basis"]
    source = Source(
        fields["scenes"][0].content if fields["scenes"] else None,
        given.content if isinstance(given, GroupsFile) else None,
        Path(task.handover.stage) if task.handover.stage else None,
    )
    names = names_of_forms(task.handover.to, source)
    files, reads = tuple(folder / name for name in names.values()), (lighting, *source.files)
    force = fields["settings"].force
    results = ResultFolder(folder, files, reads, (lighting,), force=force)
    results.check()
    answer = read_lighting(lighting)
    writers, remark = writers_of(names, answer, source, folder, listen)
    if remark:
        listen.say(remark)
    with results.filled() as stage:
        for name, make in writers.items():
            write_text(stage / name, make())
