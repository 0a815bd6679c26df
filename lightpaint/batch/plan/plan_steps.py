"""The plan of a batch: looks, their steps and common places, and the time and memory they take.

The estimate is from constants that were measured. The seconds of looks are processor seconds of the
batches in benchmarks/batch.py, a few looks each, on a machine that had other work: they are a rough
guide.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path

from lightpaint.batch.manifest.entries import LookEntry
from lightpaint.batch.manifest.file_names import PLACES
from lightpaint.batch.work.work_items import SAMPLE_S, Kind, Task, render_seconds, render_settings
from lightpaint.batch.work.worker_storage import WorkerCache
from lightpaint.display_text import some_names
from lightpaint.errors import BatchError, LightpaintError
from lightpaint.placement import PlacementRecord, read_placement


@dataclass(frozen=True)
class PlaceGroup:
    """A group of looks.

    file: of the record. tasks: of the looks whose paintings decide. fingerprint: of these.
    """

    file: Path
    tasks: tuple[Task, ...]
    fingerprint: str

    @property
    def looks(self) -> tuple[str, ...]:
        """Names of the looks whose paintings decide."""
        return tuple(task.look for task in self.tasks)

    @property
    def picture(self) -> Path:
        """File of the plan and the elevation of the room."""
        return self.file.with_suffix(".png")

    def read_record(self) -> PlacementRecord | None:
        """Return the record, if it belongs to these paintings and they are unchanged."""
        if not self.file.is_file():
            return None
        try:
            record = read_placement(self.file)
        except LightpaintError:
            return None
        return record if record.made_of == self.fingerprint else None


def group_entries(
    entries: Iterable[LookEntry], names_with_moves: Iterable[str]
) -> list[list[LookEntry]]:
    """Return groups of the entries whose lights may move; the paintings of each group decide.

    names_with_moves: names of these. Variations follow the look that they vary. Raises BatchError
    for looks that cannot share places.
    """
    names, groups = set(names_with_moves), dict[str, list[LookEntry]]()
    for entry in entries:
        if entry.name in names:
            groups.setdefault(_key(entry), []).append(entry)
    for group in groups.values():
        _check_alike(group)
    return list(groups.values())


def deciding_looks(group: Sequence[LookEntry]) -> list[LookEntry]:
    """Return the looks of a group whose paintings decide: all but variations, if there are any."""
    return [entry for entry in group if not entry.variation] or list(group)


def file_of_group(folder: Path, group: Sequence[LookEntry]) -> Path:
    """Return the file of a group's record in the folder of the batch."""
    return folder / PLACES / f"{deciding_looks(group)[0].name}.json"


def places_of(entries: Sequence[LookEntry], files: Mapping[str, str]) -> dict[str, str]:
    """Return the file of the places of each look, by name; looks made of others take theirs.

    files: of the looks that are solved. A look stands behind those that it is made of.
    """
    place_files = dict(files)
    for entry in entries:
        if entry.combined_looks and (place := place_files.get(entry.combined_looks[0])):
            place_files[entry.name] = place
    return place_files


def _key(entry: LookEntry) -> str:
    if entry.shares_places:
        return repr(replace(entry.scenes[0].without_content(), sensor=None))
    return entry.varied_look or entry.name


def _check_alike(group: Sequence[LookEntry]) -> None:
    """Raise BatchError if the bases of a group's looks are rendered in different ways."""
    first = render_settings(group[0].settings)
    for entry in group[1:]:
        settings = render_settings(entry.settings)
        if different_keys := [key for key, value in settings.items() if value != first[key]]:
            key = different_keys[0]
            raise BatchError(
                f"{some_names([group[0].name, entry.name], ' and ')} share places, and {key} is "
                f"{first[key]!r} in one and {settings[key]!r} in the other: give both the same"
            )


#: Seconds of any look; of a solve, for each pixel, and for each pixel and light; and of a report,
#: for each pixel.
LOOK_S, PIXEL_S, PIXEL_LIGHT_S, REPORT_S = 0.07, 1.7e-6, 1.6e-7, 1.2e-5


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

    measurements: the cost of the lux that a look needs, by its name; equal ones are measured once.
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
    measurements: Mapping[str, Cost] = field(default_factory=dict)

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


#: Assumed cost of a basis that is a file.
SAVED_BASIS_COST = Cost("", 12, (360, 640), 0, 0)


@dataclass(frozen=True)
class CostEstimate:
    """Seconds for bases and lux, and for looks, including final renders; memory: bytes at the
    peak.
    """

    bases_s: float
    looks_s: float
    memory: int


def estimate(plan: Plan) -> CostEstimate:
    """Estimate the rest of `plan`, if no basis and no measurement is cached."""
    remaining_looks = [look for look in plan.chosen_looks if not look.failure and not look.is_done]
    keys = dict.fromkeys(
        key
        for look in remaining_looks
        for step in look.steps
        if not step.is_done
        for key in step.task.bases
        if key in plan.costs
    )
    costs = [plan.costs[key] for key in keys]
    measured = (
        plan.measurements.get(x.entry.name) for x in remaining_looks if not x.steps[0].is_done
    )
    costs += dict.fromkeys(cost for cost in measured if cost is not None)
    return CostEstimate(
        sum(render_seconds(cost.samples, cost.lights) for cost in costs),
        sum(look_seconds(look, plan) for look in remaining_looks),
        max((cost.memory for cost in costs), default=0),
    )


def look_seconds(look: PlannedLook, plan: Plan) -> float:
    """Return the seconds for the remaining steps of a look, on two cores."""
    costs = [plan.costs.get(key, SAVED_BASIS_COST) for key in look.steps[0].task.bases]
    pixels = sum(cost.size[0] * cost.size[1] for cost in costs)
    steps, spent_s = look.entry.want, 0.0
    if not look.steps[0].is_done:
        lights = max((cost.lights for cost in costs), default=0)
        spent_s += LOOK_S
        spent_s += pixels * (PIXEL_S + PIXEL_LIGHT_S * lights) * look.entry.is_solved
        spent_s += REPORT_S * pixels * ("report" in steps)
        spent_s += SAMPLE_S * sum(cost.samples for cost in costs) * ("verify" in steps)
    if any(step.task.kind == "render" and not step.is_done for step in look.steps):
        spp = look.entry.final.spp
        spent_s += SAMPLE_S * sum(cost.size[0] * cost.size[1] * (spp or cost.spp) for cost in costs)
    return spent_s
