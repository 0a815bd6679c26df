"""What is to be done of a manifest, and what is done already; all checked before any sample."""

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from lightpaint.basis.render.render import memory_needed
from lightpaint.batch.entries import Entry, entries_of
from lightpaint.batch.journal import Journal
from lightpaint.batch.keys import Mistakes
from lightpaint.batch.manifest import Manifest, read_manifest
from lightpaint.batch.task import Kind, Task, answer_task, bases_of, render_task
from lightpaint.batch.variations import varied
from lightpaint.batch.work import Held, made_folder
from lightpaint.errors import BatchError, ImageError, LightpaintError, OutputError, TargetError
from lightpaint.files import check_writable
from lightpaint.job import Job
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.file import read_lighting
from lightpaint.relit.relight import scene_of
from lightpaint.result_folder import is_as_written
from lightpaint.scene.quality import on_film, samples
from lightpaint.scene.scene import Scene
from lightpaint.screen import some_names
from lightpaint.settings import Settings
from lightpaint.version import __version__

#: Mistakes in a painting, or in what lies where its answer goes, are of that look alone.
ALONE = (ImageError, TargetError, OutputError)


@dataclass(frozen=True)
class Step:
    """One step of one look. made_of: fingerprint of all that goes in. is_done: earlier."""

    task: Task
    made_of: str
    is_done: bool


@dataclass(frozen=True)
class PlannedLook:
    """One look. failure: why it cannot be done; it is the only one. remarks: worth knowing."""

    entry: Entry
    folder: Path
    steps: tuple[Step, ...]
    failure: str = ""
    remarks: tuple[str, ...] = ()

    @property
    def is_done(self) -> bool:
        """Whether nothing is left to do."""
        return not self.failure and all(step.is_done for step in self.steps)


@dataclass(frozen=True)
class Cost:
    """Of a basis that is to be obtained. samples: of all pixels; memory: bytes at the peak."""

    scene: str
    lights: int
    size: tuple[int, int]
    spp: int
    memory: int

    @property
    def samples(self) -> int:
        """Of all pixels."""
        return self.size[0] * self.size[1] * self.spp


@dataclass(frozen=True)
class Plan:
    """Looks of a manifest. costs: of each basis, by its key. order: of all steps of all looks."""

    manifest: Path
    folder: Path
    looks: tuple[PlannedLook, ...]
    costs: Mapping[str, Cost]
    order: tuple[tuple[str, Kind], ...]

    def only(self, pattern: str | None) -> "Plan":
        """The plan of the looks whose names match, and of those that these are made of.

        Raises BatchError if there is none.
        """
        if pattern is None:
            return self
        wanted = {x.entry.name for x in self.looks if fnmatchcase(x.entry.name, pattern)}
        if not wanted:
            names = some_names(look.entry.name for look in self.looks)
            raise BatchError(f"no look matches only={pattern!r}: there are {names}")
        for look in reversed(self.looks):  # what others are made of stands before them
            if look.entry.name in wanted:
                wanted |= set(look.entry.of)
        return replace(self, looks=tuple(x for x in self.looks if x.entry.name in wanted))


def plan(
    manifest: str | Path, folder: str | Path, *, force: bool = False, command: str = ""
) -> Plan:
    """Read `manifest` (docs/batch.md), and check every look of it, before anything is rendered.

    Args:
        manifest: TOML.
        folder: Receives a folder for each look.
        force: Whether results of something else, or changed by hand, are replaced.
        command: The shell command that asks for this, for the reports.

    Raises:
        BatchError: With all mistakes, one line each.
        OutputError: If `folder` cannot be written.
    """
    read, folder = read_manifest(manifest), Path(folder)
    entries = entries_of(read)
    if read.mistakes.found:
        raise BatchError(*read.mistakes.found)
    check_writable(folder)
    planner = _Planner(read, folder, entries, force=force, command=command)
    looks = tuple(planner.planned(entry) for entry in entries)
    if read.mistakes.found:
        raise BatchError(*read.mistakes.found)
    steps = [step.task for look in looks for step in look.steps]
    order = tuple((task.look, task.kind) for task in steps)
    return Plan(read.path, folder, looks, planner.costs, order)


class _Planner:
    """Looks at one entry after the other, with what several of them share."""

    def __init__(
        self,
        manifest: Manifest,
        folder: Path,
        entries: Sequence[Entry],
        *,
        force: bool,
        command: str,
    ) -> None:
        self._mistakes: Mistakes = manifest.mistakes
        self._base, self._force, self._command = manifest.folder, force, command
        self._folders = {entry.name: folder / entry.name for entry in entries}
        self._held, self._journal = Held(), Journal(folder)
        self._sums: dict[Path, str] = {}
        self._made_of: dict[str, str] = {}
        self._failed: set[str] = set()
        self.costs: dict[str, Cost] = {}

    def planned(self, entry: Entry) -> PlannedLook:
        """What is to be done for one look. What is wrong with the manifest is added to its
        mistakes; what is wrong with the look's own files is its failure.
        """
        failure, remarks, reads = "", (), ()
        try:
            entry, reads, remarks = self._looked_at(entry)
        except ALONE as error:
            failure = str(error)
        except LightpaintError as error:
            self._mistakes.add(entry.where, str(error))
            failure = str(error)
        if not failure and (gone := self._failed & set(entry.of)):
            failure = f"it is made of {some_names(sorted(gone))}, which failed"
        if failure:
            self._failed.add(entry.name)
        steps = self._steps(entry, reads if not failure else (), is_possible=not failure)
        return PlannedLook(entry, self._folders[entry.name], steps, failure, remarks)

    def _steps(
        self, entry: Entry, reads: Sequence[Path], *, is_possible: bool
    ) -> tuple[Step, ...]:
        """The answer, and its render if that is wanted."""
        how: dict[str, Any] = {"force": self._force, "command": self._command}
        tasks = [answer_task(entry, self._folders, **how)]
        answer = self._fingerprint(entry, reads)
        self._made_of[entry.name] = answer
        made_of = [answer]
        if "render" in entry.want:
            tasks.append(render_task(entry, self._folders, **how))
            made_of.append(_sum(json.dumps([answer, asdict(entry.final)])))
        is_whole = is_possible and is_as_written(self._folders[entry.name])
        steps = []
        for task, its in zip(tasks, made_of, strict=True):
            line = self._journal.lines.get((task.look, task.kind))
            is_done = line is not None and (line.state, line.made_of) == ("done", its)
            # What was rendered of an earlier answer went with it.
            is_whole = is_whole and is_done
            steps.append(Step(task, its, is_whole))
        return tuple(steps)

    def _looked_at(self, entry: Entry) -> tuple[Entry, tuple[Path, ...], tuple[str, ...]]:
        """With all decided that follows from its files; what it reads; what is worth saying."""
        scenes = tuple(map(self._held.scene, entry.scenes))
        basis = None if entry.basis is None else self._held.saved(entry.basis)
        if not entry.is_solved:
            return self._made(replace(entry, scenes=scenes, basis=basis))
        settings, asked = entry.settings, entry.constraints
        job = self._job(entry, scenes, basis, settings, asked)
        if entry.variation:
            lights = _adjusted(job)
            settings, asked = varied(
                entry.variation, replace(settings, hold=job.fit.hold), asked, lights
            )
            job = self._job(entry, scenes, basis, settings, asked)
        self._note_costs(entry, [view.scene for view in job.views], job.settings)
        if entry.final.resolution is not None and "render" in entry.want:
            on_film(scenes[0].content, None, entry.final.resolution)
        reads = tuple(dict.fromkeys(job.results.reads))
        entry = replace(entry, settings=settings, constraints=asked)
        return entry, reads, job.remarks

    def _job(
        self,
        entry: Entry,
        scenes: Sequence[Any],
        basis: Any,
        settings: Settings,
        asked: Constraints,
    ) -> Job:
        """The job of a look, which checks it; its painting is read anew, and let go of again."""
        paintings = tuple(replace(painting) for painting in entry.paintings)
        settings = replace(settings, force=self._force, command=self._command)
        folder = self._folders[entry.name]
        return Job(tuple(scenes), paintings, folder, basis, asked, settings, entry.by_sensor)

    def _made(self, entry: Entry) -> tuple[Entry, tuple[Path, ...], tuple[str, ...]]:
        """Of a look that is made of lightings: those of files are looked at."""
        scene: Scene | None = entry.scenes[0].content if entry.scenes else None
        lights = entry.basis.content.lights if entry.basis is not None else None
        reads: tuple[Path, ...] = () if scene is None else scene.read_files
        if entry.basis is not None:
            reads += (Path(entry.basis.path),)
        if entry.lighting:
            lighting = read_lighting(entry.lighting)
            reads += (Path(entry.lighting),)
            if scene is not None:
                scene_of(scene, lighting)
                if (have := set(lighting)) != (want := {light.name for light in scene.lights}):
                    raise BatchError(
                        f"{entry.lighting} has the lights {some_names(sorted(have))}, and the scene "
                        f"{some_names(sorted(want))}: load it with the same lights and groups"
                    )
            elif lights is not None and set(lighting) != {light.name for light in lights}:
                raise BatchError(f"{entry.lighting} is of other lights than {entry.basis}")
        folders = [str(self._folders[name] / "lighting.json") for name in entry.of]
        lightings = tuple([entry.lighting] if entry.lighting else folders)
        folder = self._folders[entry.name]
        made_folder(folder, scene, lightings, force=self._force).check()
        if scene is not None:
            film = on_film(scene, entry.settings.quality, entry.settings.resolution)
            self._note_costs(entry, [film], entry.settings)
            if entry.final.resolution is not None and "render" in entry.want:
                on_film(scene, None, entry.final.resolution)
        return entry, reads, ()

    def _note_costs(
        self, entry: Entry, films: Sequence[Scene | None], settings: Settings
    ) -> None:
        """What each basis costs that is to be obtained. films: on which it is rendered."""
        for key, film in zip(bases_of(entry), films, strict=True):
            if film is None or entry.basis is not None or key in self.costs:
                continue
            asked = samples(settings.quality, spp=settings.spp, time_s=settings.time_s)
            self.costs[key] = Cost(
                f"{film.path.name} through {film.sensor_names[film.sensor]}",
                len(film.lights),
                film.size,
                film.spp if asked is None else asked,
                memory_needed(film),
            )

    def _fingerprint(self, entry: Entry, reads: Sequence[Path]) -> str:
        """Of all that goes into an answer: what is asked, the content of files, our version.

        Paths are told from the manifest's folder, so that a project may be moved.
        """
        told = asdict(replace(entry, where="", want=(), final=entry.final.__class__()))
        told["verify"], told["report"] = entry.settings.verify, entry.settings.report
        return _sum(
            json.dumps(
                [
                    __version__,
                    _relative(told, self._base),
                    sorted(self._content(file) for file in reads),
                    [self._made_of[name] for name in entry.of],
                ],
                default=str,
            )
        )

    def _content(self, file: Path) -> str:
        """SHA-256 of a file; each is read once."""
        if file not in self._sums:
            found = hashlib.sha256()
            try:
                with file.open("rb") as opened:
                    while data := opened.read(2**24):
                        found.update(data)
            except OSError as error:
                raise OutputError(f"cannot read {file}: {error.strerror or error}") from error
            self._sums[file] = found.hexdigest()
        return self._sums[file]


def _adjusted(job: Job) -> int:
    """How many lights are adjusted."""
    first = job.views[0]
    lights: Sequence[Any] = ()
    if first.basis is not None:
        lights = first.basis.lights
    elif first.scene is not None:
        lights = first.scene.lights
    return sum(not light.is_fixed for light in lights)


def _relative(told: Any, base: Path) -> Any:
    """Paths in plain values, from `base`."""
    if isinstance(told, dict):
        return {key: _relative(value, base) for key, value in told.items()}
    if isinstance(told, list | tuple):
        return [_relative(value, base) for value in told]
    if isinstance(told, str) and base.parts and told.startswith(f"{base}{os.sep}"):
        return os.path.relpath(told, base)
    return told


def _sum(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


