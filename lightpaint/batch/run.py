"""Doing a plan: bases first, then the looks that share each, then final renders."""

import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

from lightpaint.basis import cache
from lightpaint.basis.basis import Basis
from lightpaint.basis.file import write_basis
from lightpaint.batch.cluster.cluster import Cluster
from lightpaint.batch.folder_lock import alone
from lightpaint.batch.gallery.gallery import write_gallery
from lightpaint.batch.gallery.small_planes import keep_all_planes
from lightpaint.batch.manifest.folder_names import THUMBNAILS
from lightpaint.batch.plan.cost_estimate import look_s
from lightpaint.batch.plan.journal import Journal, JournalLine
from lightpaint.batch.plan.plan import Plan, PlannedLook, PlanStep, by_bases, waves
from lightpaint.batch.run_options import BatchOutcome, How
from lightpaint.batch.work.basis_parts import InParts
from lightpaint.batch.work.distributed_render import rendered_by
from lightpaint.batch.work.distributed_sums import solved_by_sums
from lightpaint.batch.work.engine import Engine, InProcess
from lightpaint.batch.work.processes import Processes
from lightpaint.batch.work.task import Task
from lightpaint.batch.work.work import attempted, fields_of, final_render, is_full
from lightpaint.batch.work.work_items import Done, SceneFilm
from lightpaint.errors import BatchError, LightpaintError, OutputError
from lightpaint.files import sweep
from lightpaint.pipeline.pipeline import obtain
from lightpaint.pipeline.settings import Settings
from lightpaint.pipeline.sources import SceneFile
from lightpaint.progress import Interrupted, Listener, Progress, listener, silent
from lightpaint.scene.presets import on_film, samples


def run_batch(
    plan: Plan,
    how: How | None = None,
    progress: Progress = silent,
    *,
    told: Callable[[PlannedLook, Done], None] | None = None,
) -> BatchOutcome:
    """Do what is left of `plan`. What is done is on the disk, and is not done again.

    Args:
        plan: As `plan` made it.
        how: Workers, and what a failure stops.
        progress: Hears how far the work has come and, if it is a `Listener`, remarks.
        told: Hears of each step that was done or failed.

    Raises:
        OutputError: Where the disk is full, or another batch is at work in the folder.
        Interrupted: For Ctrl-C; the same call goes on from there.
    """
    how = how or How()
    with alone(plan.folder, may_share=how.apart), ExitStack() as stack:
        if not how.apart:
            for place in (plan.folder, plan.folder / THUMBNAILS):
                sweep(place)
        run = _Run(plan, how, listener(progress), told or (lambda look, done: None))
        try:
            run.all(stack)
        except KeyboardInterrupt:
            left = len(run.outcome.waiting)
            raise Interrupted(f"{left} looks are left; the same command goes on") from None
        finally:
            with suppress(LightpaintError):
                if not how.apart:
                    run.journal.settle(plan.steps)
        if how.apart:
            return run.outcome
        run.outcome.rows = write_gallery(plan.folder, plan, run.journal.lines)
        return run.outcome


class _Run:
    """One run of a plan."""

    def __init__(
        self,
        plan: Plan,
        how: How,
        listen: Listener,
        told: Callable[[PlannedLook, Done], None],
    ) -> None:
        self.journal = Journal(plan.folder, "/".join(sorted(plan.chosen)) if how.apart else "")
        self.outcome = BatchOutcome()
        self._plan, self._how, self._listen, self._told = plan, how, listen, told
        self._looks = {look.entry.name: look for look in plan.looks}
        self._held = plan.held
        self._tries: dict[tuple[str, str], int] = {}
        self._engine: Engine = InProcess(self._held, self._listen)
        self._begun_s = time.monotonic()
        self._finished = 0

    def all(self, stack: ExitStack) -> None:
        """Every step that is left, in an order in which each has what it needs."""
        for look in self._plan.chosen_looks:
            if look.failure:
                self._fail(look, look.steps[0], look.failure)
            elif look.is_done:
                self.outcome.skipped.append(look.entry.name)
            else:
                self.outcome.waiting.append(look.entry.name)
        if self._is_stopped():
            return
        left = [
            s for x in self._plan.chosen_looks if not x.failure for s in x.steps if not s.is_done
        ]
        self._total = len(left)
        self._listen("steps", 0, self._total, "steps")
        self._engine = self._begun(stack)
        answers = [step for step in left if step.task.kind == "answer"]
        by_sums = [x for x in answers if x.task.is_by_sums and not self._has_basis(x.task)]
        answers = [step for step in answers if step not in by_sums]
        for keys in dict.fromkeys(step.task.bases for step in by_sums):
            self._by_sums([step for step in by_sums if step.task.bases == keys])
        for together in by_bases(answers, self._looks):
            self._of_bases(together)
        self._held.only(())
        for kind in ("render", "export"):
            self._together([x for x in left if x.task.kind == kind])

    def _begun(self, stack: ExitStack) -> Engine:
        """Who does the work, until `stack` is closed."""
        how = self._how
        if how.cluster is not None:
            cluster = Cluster(
                how.cluster, self._listen, is_shared=how.shared_fs, limit_s=how.task_limit_s
            )
            return stack.enter_context(cluster)
        if how.workers > 1:
            return stack.enter_context(Processes(how.workers, self._listen))
        return self._engine

    def _has_basis(self, task: Task) -> bool:
        """Whether the basis of a task is saved or kept, so that nothing is to be rendered."""
        fields = fields_of(task, self._held)
        if fields["basis"] is not None:
            return True
        settings: Settings = fields["settings"]
        [scene] = fields["scenes"]
        film = on_film(scene.content, settings.quality, settings.resolution)
        asked = samples(settings.quality, spp=settings.spp, time_s=None)
        sensor = film.sensor_names[film.sensor]
        kept = cache.spp_of(film.identity, sensor, settings.seed, film.size)
        exact = settings.exact_spp or not settings.use_cache
        return not exact and kept >= (film.spp if asked is None else asked)

    def _by_sums(self, steps: Sequence[PlanStep]) -> None:
        """Looks that share a basis which nobody is to have."""
        by_look = {step.task.look: step for step in steps if self._can_begin(step)}
        tasks = [step.task for step in by_look.values()]
        if self._is_stopped():
            return
        for done in solved_by_sums(tasks, self._engine, self._held, self._listen):
            if done.is_full:
                raise OutputError(f"{done.failure}: make room; the same command goes on")
            self._record(by_look[done.look], done)

    def _of_bases(self, steps: Sequence[PlanStep]) -> None:
        """Looks that share their bases; those that are made of others come after them."""
        task = steps[0].task
        self._held.only(task.bases)
        with ExitStack() as stack:
            files = task.files
            try:
                obtained = self._obtained(task)
                if not all(step.task.is_by_sums for step in steps):
                    keep_all_planes(self._plan.folder, task, obtained, self._held)
                if self._engine.is_apart:
                    # Workers read what this process rendered, and is done with.
                    files = _saved(obtained, stack) if obtained else files
                    self._held.only(())
            except LightpaintError as error:
                if is_full(error):
                    raise
                for step in steps:
                    self._fail(self._looks[step.task.look], step, str(error))
                return
            for wave in waves(steps, self._looks):
                given = [replace(step, task=replace(step.task, files=files)) for step in wave]
                self._together(given)
                if self._is_stopped():
                    return

    def _obtained(self, task: Task) -> list[Basis]:
        """The bases of a task that are no files already: kept or rendered, once for all looks."""
        fields = fields_of(task, self._held)
        if fields["basis"] is not None:
            return []
        settings: Settings = fields["settings"]
        bases = []
        for key, scene in zip(task.bases, fields["scenes"], strict=True):
            film = on_film(scene.content, settings.quality, settings.resolution)
            basis = self._held.basis(key)
            if basis is None:
                its = SceneFilm(scene, settings.quality, settings.resolution, _files(scene))
                render = InParts(self._engine, its)
                basis = obtain(film, settings, self._listen, render=render)
                self._held.hold(key, basis)
            bases.append(basis)
        return bases

    def _together(self, steps: Sequence[PlanStep]) -> None:
        """Steps that do not wait for each other, and again those that failed and may be tried."""
        by_look = {step.task.look: step for step in steps}
        waiting = [step for step in steps if self._can_begin(step)]
        while waiting and not self._is_stopped():
            again = []
            tasks = [self._expecting(step.task) for step in waiting]
            for done in _closing(self._done(tasks)):
                step = by_look[done.look]
                if done.is_full:
                    raise OutputError(f"{done.failure}: make room; the same command goes on")
                if done.failure and self._may_try_again(done):
                    self._listen.say(f"{done.look}: {done.failure}; trying again")
                    again.append(step)
                    continue
                self._record(step, done)
                if self._is_stopped():
                    return
            waiting = again

    def _expecting(self, task: Task) -> Task:
        """The task, which knows roughly how long it takes on one thread."""
        settings = self._looks[task.look].entry.settings
        times = 2 * (1 + settings.refine + 4 * bool(settings.suggest))
        return replace(task, expected_s=times * look_s(self._looks[task.look], self._plan))

    def _done(self, tasks: Sequence[Task]) -> Iterator[Done]:
        """What comes of each; of few final renders each is done by all workers."""
        if tasks[0].kind == "export":  # texts, of files that are here: none is worth sending
            yield from InProcess(self._held, self._listen).run(tasks)
            return
        are_few = len(tasks) < self._engine.workers and self._engine.is_apart
        if not (are_few and tasks[0].kind == "render"):
            yield from self._engine.run(tasks)
            return
        for task in tasks:
            variant = fields_of(task, self._held)["scenes"][0].variant
            by_all = rendered_by(self._engine, task, variant, self._listen)
            yield attempted(task, partial(final_render, task, self._held, self._listen, by_all))

    def _can_begin(self, step: PlanStep) -> bool:
        """Whether the look has not failed by now, nor what it is made of."""
        look = self._looks[step.task.look]
        gone = [name for name in look.entry.of if name in self.outcome.failed]
        if gone:
            self._fail(look, step, f"it is made of {gone[0]}, which failed")
        return look.entry.name not in self.outcome.failed

    def _may_try_again(self, done: Done) -> bool:
        key = (done.look, done.kind)
        self._tries[key] = self._tries.get(key, 0) + 1
        return self._tries[key] <= self._how.retry

    def _record(self, step: PlanStep, done: Done) -> None:
        """Keep what came of a step, and tell it."""
        look = self._looks[done.look]
        if done.failure:
            self._fail(look, step, done.failure, done)
        else:
            self.journal.add(JournalLine(done.look, step.task.kind, "done", step.made_of))
            if step.task.kind == look.steps[-1].task.kind:
                self.outcome.done.append(done.look)
                self.outcome.waiting.remove(done.look)
            self._finished += 1
            self._told(look, replace(done, left_s=self._left_s))
        self._listen("steps", self._finished, self._total, "steps")

    def _fail(self, look: PlannedLook, step: PlanStep, why: str, done: Done | None = None) -> None:
        if self._engine.is_gone:
            raise BatchError(why)
        name = look.entry.name
        if name in self.outcome.failed:
            return
        self.outcome.failed[name] = why
        if name in self.outcome.waiting:
            self.outcome.waiting.remove(name)
        self.journal.add(JournalLine(name, step.task.kind, "failed", step.made_of, why))
        self._told(look, done or Done(name, step.task.kind, why))

    def _is_stopped(self) -> bool:
        return bool(self.outcome.failed) and not self._how.keep_going

    @property
    def _left_s(self) -> float | None:
        """Seconds that are left, if steps go on as they did; None before the first."""
        if not self._finished:
            return None
        spent_s = time.monotonic() - self._begun_s
        return spent_s / self._finished * (self._total - self._finished)


def _files(scene: SceneFile) -> tuple[str, ...]:
    """All that it is made of."""
    return tuple(map(str, scene.content.read_files))


def _saved(bases: Sequence[Basis], stack: ExitStack) -> tuple[str, ...]:
    """Files with these bases, as long as `stack` is open."""
    folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="lightpaint-")))
    files = [folder / f"{k}.basis.exr" for k in range(len(bases))]
    for file, basis in zip(files, bases, strict=True):
        write_basis(file, basis)
    return tuple(map(str, files))


def _closing(done: Iterator[Done]) -> Iterator[Done]:
    """`done`, which is ended with whoever stops asking."""
    try:
        yield from done
    finally:
        if hasattr(done, "close"):
            done.close()
