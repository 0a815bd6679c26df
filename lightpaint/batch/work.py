"""Doing a task: what a worker has at hand, and what it writes."""

import errno
import time
from collections.abc import Collection, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from lightpaint.basis.basis import Basis
from lightpaint.basis.file import read_basis
from lightpaint.basis.lightgroups.read import LightGroups
from lightpaint.batch.keys import Space
from lightpaint.batch.made import dimmed, leave_made, made_folder
from lightpaint.batch.sequence import between
from lightpaint.batch.task import EXPORT, Done, Task, key_of_basis, key_of_scene
from lightpaint.batch.variations import shifted
from lightpaint.errors import LightpaintError
from lightpaint.files import first_line, one_line, write_text
from lightpaint.job import Job
from lightpaint.lighting.file import read_lighting
from lightpaint.lighting.lighting import Lighting
from lightpaint.pipeline import obtain, run
from lightpaint.progress import Listener
from lightpaint.relit.forms import Source, names_of_forms, writer_of
from lightpaint.renders import relight_look, relit_folder
from lightpaint.result_folder import ResultFolder
from lightpaint.results import view_names
from lightpaint.scene.quality import on_film
from lightpaint.scene.scene import Scene
from lightpaint.settings import Settings
from lightpaint.sources import BasisFile, GroupsFile, SceneFile, content, from_json

#: What the system says of a disk that takes no more.
FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}

#: Characters of a reason.
LONGEST = 600


class Held:
    """Scenes and bases that several looks share, each loaded or rendered once in this process."""

    def __init__(self) -> None:
        self._scenes: dict[str, SceneFile] = {}
        self._saved: dict[str, BasisFile | GroupsFile] = {}
        self._bases: dict[str, Basis] = {}

    def scene(self, given: SceneFile) -> SceneFile:
        """The one that equals `given`, and is loaded by and by."""
        return self._scenes.setdefault(repr(given), given)

    def saved(self, given: BasisFile | GroupsFile) -> BasisFile | GroupsFile:
        """The one of the same file, which is read by and by."""
        return self._saved.setdefault(repr(given), given)

    def basis(self, scene: Scene, key: str, settings: Settings, listen: Listener) -> Basis:
        """That of `scene` on its film: held, kept or rendered. key: `key_of_scene`."""
        if key not in self._bases:
            self._bases[key] = obtain(scene, settings, listen)
        return self._bases[key]

    def read(self, key: str, file: str) -> None:
        """Hold the basis of that key, which was saved for workers."""
        if file and key not in self._bases:
            self._bases[key] = read_basis(file)

    def only(self, keys: Collection[str]) -> None:
        """Let go of all bases but those."""
        self._bases = {key: basis for key, basis in self._bases.items() if key in keys}
        self._saved = {k: x for k, x in self._saved.items() if key_of_basis(x) in keys}


def do(task: Task, held: Held, listen: Listener) -> Done:
    """Do one task; what prevents it is said in one line, and is its own failure alone."""
    begun = time.perf_counter()
    failure, full = "", False
    try:
        does = {"answer": _answer, "render": _render, "export": _export}
        does[task.kind](task, held, listen)
    except LightpaintError as error:
        failure, full = str(error), is_full(error)
    except MemoryError:
        failure = "it takes more memory than there is: use resolution=... or fewer workers"
    except OSError as error:
        failure, full = first_line(error), error.errno in FULL
    except Exception as error:  # a mistake of ours, or of a library's: the others go on
        failure = f"{type(error).__name__}: {first_line(error)}"
    spent_s = time.perf_counter() - begun
    return Done(task.look, task.kind, one_line(failure, limit=LONGEST), full, spent_s=spent_s)


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
    if isinstance(fields["basis"], BasisFile | GroupsFile):
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
        bases = [
            held.basis(view.scene, key_of_scene(file, job.settings), job.settings, listen)
            for view, file in zip(job.views, fields["scenes"], strict=True)
            if view.scene is not None
        ]
    run(job, listen, bases=bases)


def _made(task: Task, fields: dict[str, Any], held: Held, listen: Listener) -> None:
    """An answer that is made of others: a lighting as it is, warmer, or between two."""
    settings: Settings = fields["settings"]
    scenes: list[Scene] = [file.content for file in fields["scenes"]]
    given = content(fields["basis"])
    groups = given if isinstance(given, LightGroups) else None
    bases: list[Basis] = [given if groups is None else groups.basis]
    if given is None:
        films = [on_film(scene, settings.quality, settings.resolution) for scene in scenes]
        bases = [
            held.basis(film, key, settings, listen)
            for film, key in zip(films, task.bases, strict=True)
        ]
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


def _render(task: Task, held: Held, listen: Listener) -> None:
    """The final render of a look that is answered."""
    fields = fields_of(task, held)
    [lighting] = map(Path, task.lightings)
    results = relit_folder(
        fields["scenes"][0].content, lighting, fields["folder"], force=fields["settings"].force
    )
    how: dict[str, Any] = {"spp": task.final.spp, "seed": task.final.seed}
    how["resolution"] = task.final.resolution
    relight_look(
        fields["scenes"][0].content, read_lighting(lighting), results, progress=listen, **how
    )


def _export(task: Task, held: Held, listen: Listener) -> None:
    """What other programs get of a look that is answered."""
    fields = fields_of(task, held)
    lighting, folder = Path(task.lightings[0]), fields["folder"] / EXPORT
    given = content(fields["basis"])
    source = Source(
        fields["scenes"][0].content if fields["scenes"] else None,
        given if isinstance(given, LightGroups) else None,
        Path(task.handover.stage) if task.handover.stage else None,
    )
    names = names_of_forms(task.handover.to, source)
    files, reads = tuple(folder / name for name in names.values()), (lighting, *source.files)
    force = fields["settings"].force
    results = ResultFolder(folder, files, reads, (lighting,), force=force)
    results.check()
    answer = read_lighting(lighting)
    with results.filled() as stage:
        for form, name in names.items():
            write_text(stage / name, writer_of(form, answer, source, folder, listen)())
