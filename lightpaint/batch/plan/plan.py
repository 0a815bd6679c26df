"""The plan of a batch: looks, their steps and their costs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path

from lightpaint.batch.manifest.entries import LookEntry
from lightpaint.batch.plan.place_groups import PlaceGroup
from lightpaint.batch.work.task import Kind, Task
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.display_text import some_names
from lightpaint.errors import BatchError


@dataclass(frozen=True)
class PlanStep:
    """A step of one look. fingerprint: of its inputs. is_done: True if it need not run."""

    task: Task
    fingerprint: str
    is_done: bool


@dataclass(frozen=True)
class PlannedLook:
    """A look of the plan. failure: why it alone cannot be done. remarks: for the user."""

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
    """The plan of a manifest. costs: of each basis, by its key. chosen_names: of the looks to do.

    cache: scenes that the checks have loaded, so that they are not loaded twice. remarks: on the
    batch as a whole. groups: looks that share places of lights.
    """

    manifest: Path
    folder: Path
    looks: tuple[PlannedLook, ...]
    costs: Mapping[str, Cost]
    chosen_names: frozenset[str]
    cache: WorkerCache = field(default_factory=WorkerCache, repr=False, compare=False)
    remarks: tuple[str, ...] = ()
    groups: tuple[PlaceGroup, ...] = ()

    @property
    def chosen_looks(self) -> tuple[PlannedLook, ...]:
        """Looks to do."""
        return tuple(look for look in self.looks if look.entry.name in self.chosen_names)

    def group_of(self, task: Task) -> PlaceGroup | None:
        """Return the group that a task's lights are placed for; None if none may move."""
        return next((x for x in self.groups if task.places and str(x.file) == task.places), None)

    @property
    def steps(self) -> list[tuple[str, Kind]]:
        """Steps of all looks, in their order."""
        return [(step.task.look, step.task.kind) for look in self.looks for step in look.steps]

    def select(self, *patterns: str) -> "Plan":
        """Return the plan of the looks whose names match one of the patterns, and of the looks
        that they combine; all looks without a pattern.

        Raises BatchError for a pattern that no name matches.
        """
        if not patterns:
            return self
        chosen_names: set[str] = set()
        for pattern in patterns:
            found = {x.entry.name for x in self.looks if fnmatchcase(x.entry.name, pattern)}
            if not found:
                names = some_names(look.entry.name for look in self.looks)
                raise BatchError(f"no look matches {pattern!r}: there are {names}")
            chosen_names |= found
        for look in reversed(self.looks):  # a look stands behind those that it combines
            if look.entry.name in chosen_names:
                chosen_names |= set(look.entry.combined_looks)
        return replace(self, chosen_names=frozenset(chosen_names))


def by_bases(steps: Sequence[PlanStep], looks: Mapping[str, PlannedLook]) -> list[list[PlanStep]]:
    """Group steps that share their bases; a group follows the groups that its looks combine."""
    remaining, groups = list(steps), []
    while remaining:
        bases_by_look = {step.task.look: step.task.bases for step in remaining}
        pending, has_changed = dict(bases_by_look), True
        while has_changed:
            has_changed = False
            for look, bases in list(bases_by_look.items()):
                part_names = [x for x in looks[look].entry.combined_looks if x in pending]
                if any(bases_by_look.get(x) != bases for x in part_names):
                    del bases_by_look[look]
                    has_changed = True
        for keys in dict.fromkeys(bases_by_look.values()):
            groups.append([step for step in remaining if bases_by_look.get(step.task.look) == keys])
        remaining = [step for step in remaining if step.task.look not in bases_by_look]
    return groups


def waves(steps: Sequence[PlanStep], looks: Mapping[str, PlannedLook]) -> list[list[PlanStep]]:
    """Group steps into waves: each wave depends only on earlier ones."""
    remaining, groups = list(steps), []
    while remaining:
        names = {step.task.look for step in remaining}
        wave = [
            step
            for step in remaining
            if not names & set(looks[step.task.look].entry.combined_looks)
        ]
        groups.append(wave)
        remaining = [step for step in remaining if step not in wave]
    return groups
