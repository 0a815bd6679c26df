"""A run of a plan: each basis with the looks that share it, then final renders and exports."""

import fcntl
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from lightpaint.basis import Basis
from lightpaint.batch import task_bases
from lightpaint.batch.dask_engine import Cluster
from lightpaint.batch.distributed_work import distributed_renderer, solve_by_sums
from lightpaint.batch.engine import Engine, InProcess, Processes
from lightpaint.batch.gallery.gallery_page import write_gallery, write_task_planes
from lightpaint.batch.gallery.summary import SummaryRow
from lightpaint.batch.manifest.file_names import THUMBNAILS
from lightpaint.batch.manifest.keys import as_key
from lightpaint.batch.plan import plan_steps
from lightpaint.batch.plan.journal import Journal, JournalLine
from lightpaint.batch.run_options import RunOptions
from lightpaint.batch.work import item_execution
from lightpaint.batch.work.work_items import ItemResult, Task
from lightpaint.errors import BatchError, LightpaintError, OutputError
from lightpaint.files import sweep
from lightpaint.progress import Interrupted, Listener, Progress, listener, silent
from lightpaint.sentences import Hint, Sentence


@dataclass
class BatchOutcome:
    """Outcome of a run. done, failed: names of looks, and reasons. skipped: done earlier.

    waiting: not started. rows: of all looks, as in the summary. spent_s: seconds that the steps of
    a look took in this run, by its name.
    """

    done: list[str] = field(default_factory=list)
    failed: dict[str, str] = field(default_factory=dict)
    skipped: list[str] = field(default_factory=list)
    waiting: list[str] = field(default_factory=list)
    rows: list[SummaryRow] = field(default_factory=list)
    spent_s: dict[str, float] = field(default_factory=dict)


def run_batch(
    plan: plan_steps.Plan,
    options: RunOptions | None = None,
    progress: Progress = silent,
    *,
    on_step: Callable[[plan_steps.PlannedLook, ItemResult], None] | None = None,
) -> BatchOutcome:
    """Run the remaining steps of `plan`. Each result is written at once, and not computed again.

    Args:
        plan: The result of `plan`.
        options: Workers, and whether a failure stops the rest.
        progress: Receives progress and, if it is a `Listener`, remarks.
        on_step: Called after each step that is done or has failed.

    Raises:
        OutputError: If the disk is full, or another batch works in the folder.
        Interrupted: On Ctrl-C; the same call continues from there.
    """
    options = options or RunOptions()
    with lock_folder(plan.folder, shared=options.shares_folder), ExitStack() as stack:
        if not options.shares_folder:
            for swept_folder in (plan.folder, plan.folder / THUMBNAILS):
                sweep(swept_folder)
        run = _Run(plan, options, listener(progress), on_step or (lambda look, result: None))
        try:
            run.run_all(stack)
        except KeyboardInterrupt:
            count = len(run.outcome.waiting)
            raise Interrupted(f"{count} looks are left; run the same command to continue") from None
        finally:
            with suppress(LightpaintError):
                if not options.shares_folder:
                    run.journal.rewrite(plan.steps)
        if options.shares_folder:
            return run.outcome
        try:
            run.outcome.rows = write_gallery(plan.folder, plan, run.journal.lines)
        except LightpaintError as error:
            if not item_execution.is_disk_full(error):
                raise
            raise OutputError(error, ": ", MAKE_ROOM) from None
        return run.outcome


#: What to do when nothing more can be written.
MAKE_ROOM = "make room, and run the same command to continue"


class _Run:
    """A run of one plan."""

    def __init__(
        self,
        plan: plan_steps.Plan,
        options: RunOptions,
        listen: Listener,
        on_step: Callable[[plan_steps.PlannedLook, ItemResult], None],
    ) -> None:
        self.journal = Journal(
            plan.folder, "/".join(sorted(plan.chosen_names)) if options.shares_folder else ""
        )
        self.outcome = BatchOutcome()
        self._plan, self._options, self._listen, self._on_step = plan, options, listen, on_step
        self._looks = {look.entry.name: look for look in plan.looks}
        self._cache = plan.cache
        self._try_counts: dict[tuple[str, str], int] = {}
        self._engine: Engine = InProcess(self._cache, self._listen)
        self._start_s = time.monotonic()
        self._finished_count = 0

    def run_all(self, stack: ExitStack) -> None:
        """Run every remaining step after the steps that it depends on."""
        for look in self._plan.chosen_looks:
            if look.failure:
                self._fail(look, look.steps[0], look.failure)
            elif look.is_done:
                self.outcome.skipped.append(look.entry.name)
            else:
                self.outcome.waiting.append(look.entry.name)
        if self._is_stopped():
            return
        remaining = [
            s for x in self._plan.chosen_looks if not x.failure for s in x.steps if not s.is_done
        ]
        self._total = len(remaining)
        self._listen("steps", 0, self._total, "steps")
        self._engine = self._start_engine(stack)
        answers = [step for step in remaining if step.task.kind == "answer"]
        by_sums = [
            x
            for x in answers
            if x.task.is_by_sums and not task_bases.has_basis(x.task, self._cache)
        ]
        answers = [step for step in answers if step not in by_sums]
        for keys in dict.fromkeys(step.task.bases for step in by_sums):
            self._solve_by_sums([step for step in by_sums if step.task.bases == keys])
        for group in plan_steps.by_bases(answers, self._looks):
            self._run_with_bases(group)
        self._cache.keep_only(())
        for kind in ("render", "export"):
            self._run_steps([x for x in remaining if x.task.kind == kind])

    def _start_engine(self, stack: ExitStack) -> Engine:
        """Return the engine that runs the steps until `stack` is closed."""
        options = self._options
        if options.cluster is not None:
            cluster = Cluster(
                options.cluster,
                self._listen,
                is_shared=options.shared_fs,
                limit_s=options.task_limit_s,
            )
            return stack.enter_context(cluster)
        if options.workers > 1 or options.task_limit_s is not None:
            processes = Processes(options.workers, self._listen, limit_s=options.task_limit_s)
            return stack.enter_context(processes)
        return self._engine

    def _solve_by_sums(self, steps: Sequence[plan_steps.PlanStep]) -> None:
        """Solve looks that share a basis which is never stored."""
        by_look = {step.task.look: step for step in steps if self._can_begin(step)}
        tasks = [step.task for step in by_look.values()]
        if self._is_stopped():
            return
        for result in solve_by_sums(tasks, self._engine, self._cache, self._listen):
            if result.is_disk_full:
                raise OutputError(result.failure, ": ", MAKE_ROOM)
            self._record(by_look[result.look], result)

    def _run_with_bases(self, steps: Sequence[plan_steps.PlanStep]) -> None:
        """Run looks that share their bases; those combined from others come after them."""
        task = steps[0].task
        self._cache.keep_only(task.bases)
        with ExitStack() as stack:
            files, former_look_files = task.files, task.former_look_files
            try:
                bases = self._obtain_bases(task)
                if not all(step.task.is_by_sums for step in steps):
                    write_task_planes(self._plan.folder, task, bases, self._cache)
                if self._engine.is_apart:
                    # Workers read the bases that this process rendered and no longer needs.
                    files = task_bases.save_bases(bases, stack) if bases else files
                    former_look_files = task_bases.save_former_looks(bases, stack)
                    self._cache.keep_only(())
            except (LightpaintError, MemoryError) as error:
                if item_execution.is_disk_full(error):
                    raise
                reason: str = item_execution.OUT_OF_MEMORY_TEXT
                if isinstance(error, LightpaintError):
                    reason = error.sentence.spelled(as_key)
                for step in steps:
                    self._fail(self._looks[step.task.look], step, reason)
                return
            for wave in plan_steps.waves(steps, self._looks):
                file_fields: dict[str, Any] = {
                    "files": files,
                    "former_look_files": former_look_files,
                }
                wave_steps = [
                    replace(step, task=replace(step.task, **file_fields)) for step in wave
                ]
                self._run_steps(wave_steps)
                if self._is_stopped():
                    return

    def _obtain_bases(self, task: Task) -> list[Basis]:
        """Return the bases of a task, its lights where those that share their places want them."""
        arguments = self._engine, self._cache, self._listen
        group = self._plan.group_of(task)
        return (
            task_bases.obtain_bases(task, *arguments)
            if group is None
            else task_bases.obtain_placed_bases(task, group, *arguments)
        )

    def _run_steps(self, steps: Sequence[plan_steps.PlanStep]) -> None:
        """Run steps that do not depend on each other, and retry failed ones as often as allowed."""
        by_look = {step.task.look: step for step in steps}
        waiting = [step for step in steps if self._can_begin(step)]
        while waiting and not self._is_stopped():
            retries = []
            tasks = [self._with_expected_time(step.task) for step in waiting]
            for result in _close_after(self._results(tasks)):
                step = by_look[result.look]
                if result.is_disk_full:
                    raise OutputError(result.failure, ": ", MAKE_ROOM)
                if result.failure and self._may_retry(result):
                    self._listen.say(Sentence(f"{result.look}: ", result.failure, "; trying again"))
                    retries.append(step)
                    continue
                self._record(step, result)
                if self._is_stopped():
                    return
            waiting = retries

    def _with_expected_time(self, task: Task) -> Task:
        """Return the task with a rough estimate of its time on one thread."""
        settings = self._looks[task.look].entry.settings
        times = 2 * (1 + settings.refine + 4 * bool(settings.suggest))
        return replace(
            task, expected_s=times * plan_steps.look_seconds(self._looks[task.look], self._plan)
        )

    def _results(self, tasks: Sequence[Task]) -> Iterator[ItemResult]:
        """Yield the results of tasks. If final renders are few, all workers share each of them."""
        if tasks[0].kind == "export":  # short texts from local files: not worth sending
            yield from InProcess(self._cache, self._listen).run(tasks)
            return
        are_few = len(tasks) < self._engine.workers and self._engine.is_apart
        if not (are_few and tasks[0].kind == "render"):
            yield from self._engine.run(tasks)
            return
        for task in tasks:
            variant = item_execution.job_fields(task, self._cache)["scenes"][0].variant
            by_all = distributed_renderer(self._engine, task, variant, self._listen)
            yield item_execution.attempt(
                task, partial(item_execution.final_render, task, self._cache, self._listen, by_all)
            )

    def _can_begin(self, step: plan_steps.PlanStep) -> bool:
        """Return False if the look, or a look that it combines, has failed."""
        look = self._looks[step.task.look]
        failed_parts = [name for name in look.entry.combined_looks if name in self.outcome.failed]
        if failed_parts:
            self._fail(look, step, f"it is made of {failed_parts[0]}, which failed")
        return look.entry.name not in self.outcome.failed

    def _may_retry(self, result: ItemResult) -> bool:
        key = (result.look, result.kind)
        self._try_counts[key] = self._try_counts.get(key, 0) + 1
        return self._try_counts[key] <= self._options.retry

    def _record(self, step: plan_steps.PlanStep, result: ItemResult) -> None:
        """Record the result of a step, and report it."""
        look, seconds = self._looks[result.look], self.outcome.spent_s
        seconds[result.look] = seconds.get(result.look, 0.0) + result.spent_s
        if result.failure:
            self._fail(look, step, result.failure, result)
        else:
            self.journal.add(JournalLine(result.look, step.task.kind, "done", step.fingerprint))
            if step.task.kind == look.steps[-1].task.kind:
                self.outcome.done.append(result.look)
                self.outcome.waiting.remove(result.look)
            self._finished_count += 1
            self._on_step(look, replace(result, left_s=self._seconds_left))
        self._listen("steps", self._finished_count, self._total, "steps")

    def _fail(
        self,
        look: plan_steps.PlannedLook,
        step: plan_steps.PlanStep,
        reason: str,
        result: ItemResult | None = None,
    ) -> None:
        if self._engine.is_gone:
            raise BatchError(reason)
        name = look.entry.name
        if name in self.outcome.failed:
            return
        self.outcome.failed[name] = reason
        if name in self.outcome.waiting:
            self.outcome.waiting.remove(name)
        self.journal.add(JournalLine(name, step.task.kind, "failed", step.fingerprint, reason))
        self._on_step(look, result or ItemResult(name, step.task.kind, reason))

    def _is_stopped(self) -> bool:
        return bool(self.outcome.failed) and not self._options.keep_going

    @property
    def _seconds_left(self) -> float | None:
        """Remaining seconds at the pace of the steps so far; None before the first."""
        if not self._finished_count:
            return None
        spent_s = time.monotonic() - self._start_s
        return spent_s / self._finished_count * (self._total - self._finished_count)


def _close_after(results: Iterator[ItemResult]) -> Iterator[ItemResult]:
    """Yield results, and close the iterator when the caller stops."""
    try:
        yield from results
    finally:
        if hasattr(results, "close"):
            results.close()


@contextmanager
def lock_folder(folder: Path, *, shared: bool) -> Iterator[None]:
    """Lock `folder`. Raises OutputError if another batch works in it.

    shared: whether other batches with a shared lock may work there at the same time.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise OutputError(f"cannot write into {folder}: {error.strerror or error}") from error
    try:
        with suppress(PermissionError):
            try:
                kind = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
                fcntl.flock(descriptor, kind | fcntl.LOCK_NB)
            except BlockingIOError:
                raise OutputError(
                    f"another batch is at work in {folder}: wait for it, or name another folder (",
                    Hint("folder"),
                    ")",
                ) from None
            except OSError:
                pass  # the file system has no locks
        yield
    finally:
        os.close(descriptor)
