"""The plan of a batch: looks, their steps and their costs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path

from lightpaint.batch.manifest.entries import LookEntry
from lightpaint.batch.work.task import Kind, Task
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.errors import BatchError
from lightpaint.screen import some_names


@dataclass(frozen=True)
class PlanStep:
    """A step of one look. made_of: fingerprint of its inputs. is_done: by an earlier run."""

    task: Task
    made_of: str
    is_done: bool


@dataclass(frozen=True)
class PlannedLook:
    """A look of the plan. failure: why it cannot be done, while others can. remarks: for people."""

    entry: LookEntry
    folder: Path
    steps: tuple[PlanStep, ...]
    failure: str = ""
    remarks: tuple[str, ...] = ()

    @property
    def is_done(self) -> bool:
        """True if no step is left."""
        return not self.failure and all(step.is_done for step in self.steps)


@dataclass(frozen=True)
class Cost:
    """Cost of a basis that is to be obtained. memory: bytes at the peak."""

    scene: str
    lights: int
    size: tuple[int, int]
    spp: int
    memory: int

    @property
    def samples(self) -> int:
        """Samples of all pixels."""
        return self.size[0] * self.size[1] * self.spp


@dataclass(frozen=True)
class Plan:
    """Looks of a manifest. costs: of each basis, by its key. chosen: names of the looks to do.

    cache: scenes that the checks have loaded, so that they are not loaded twice. remarks: on the
    batch as a whole.
    """

    manifest: Path
    folder: Path
    looks: tuple[PlannedLook, ...]
    costs: Mapping[str, Cost]
    chosen: frozenset[str]
    cache: WorkerCache = field(default_factory=WorkerCache, repr=False, compare=False)
    remarks: tuple[str, ...] = ()

    @property
    def chosen_looks(self) -> tuple[PlannedLook, ...]:
        """Looks to do."""
        return tuple(look for look in self.looks if look.entry.name in self.chosen)

    @property
    def steps(self) -> list[tuple[str, Kind]]:
        """Steps of all looks, in their order."""
        return [(step.task.look, step.task.kind) for look in self.looks for step in look.steps]

    def select(self, pattern: str | None) -> "Plan":
        """Return the plan of the looks whose names match, and of those that these combine.

        Raises BatchError if there is none.
        """
        if pattern is None:
            return self
        wanted = {x.entry.name for x in self.looks if fnmatchcase(x.entry.name, pattern)}
        if not wanted:
            names = some_names(look.entry.name for look in self.looks)
            raise BatchError(f"no look matches {pattern!r}: there are {names}")
        for look in reversed(self.looks):  # what others are made of stands before them
            if look.entry.name in wanted:
                wanted |= set(look.entry.of)
        return replace(self, chosen=frozenset(wanted))


def by_bases(steps: Sequence[PlanStep], looks: Mapping[str, PlannedLook]) -> list[list[PlanStep]]:
    """Group steps that share their bases, each group after those that its looks combine."""
    left, groups = list(steps), []
    while left:
        ready = {step.task.look: step.task.bases for step in left}
        pending, waits = dict(ready), True
        while waits:
            waits = False
            for look, bases in list(ready.items()):
                made_of = [x for x in looks[look].entry.of if x in pending]
                if any(ready.get(x) != bases for x in made_of):
                    del ready[look]
                    waits = True
        for keys in dict.fromkeys(ready.values()):
            groups.append([step for step in left if ready.get(step.task.look) == keys])
        left = [step for step in left if step.task.look not in ready]
    return groups


def waves(steps: Sequence[PlanStep], looks: Mapping[str, PlannedLook]) -> list[list[PlanStep]]:
    """Group steps: those that wait for none of the others; those that wait for these; and so on."""
    left, found = list(steps), []
    while left:
        names = {step.task.look for step in left}
        wave = [step for step in left if not names & set(looks[step.task.look].entry.of)]
        found.append(wave)
        left = [step for step in left if step not in wave]
    return found
