"""The planner: checks all looks of a manifest before any sample, and lists the steps to do."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from lightpaint import pipeline
from lightpaint.basis import Basis, BasisLight, LightGroups
from lightpaint.basis.render import basis_lights, memory_needed, why_not_one_pass
from lightpaint.batch.manifest.entries import LookEntry, entries_of
from lightpaint.batch.manifest.file_names import check_gallery
from lightpaint.batch.manifest.keys import Mistakes, as_key, vary
from lightpaint.batch.manifest.looks_file import Manifest, read_manifest
from lightpaint.batch.plan import plan_steps
from lightpaint.batch.plan.journal import Fingerprints, Journal
from lightpaint.batch.work import work_items
from lightpaint.batch.work.derived_looks import adjusted_light_count, derived_folder
from lightpaint.batch.work.worker_storage import WorkerCache
from lightpaint.display_text import some_names
from lightpaint.errors import LOOK_ERRORS, BatchError, LightpaintError
from lightpaint.files import check_writable
from lightpaint.lighting import (
    Constraints,
    read_lighting,
    reason_against_sums,
    reduce_to,
    start_weights,
)
from lightpaint.photometry.measure import DEFAULT_ERROR, FIRST_SPP, MOST_SPP
from lightpaint.photometry.planes_file import PlanesFile, read_planes
from lightpaint.relit import scene_of
from lightpaint.scene import Scene
from lightpaint.scene.quality_presets import on_film

#: Samples per point that illuminance of `DEFAULT_ERROR` takes in a room.
LUX_SPP = 4096


def plan_batch(
    manifest: str | Path, folder: str | Path, *, force: bool = False, command: str = ""
) -> plan_steps.Plan:
    """Read `manifest` (docs/batch.md), and check all its looks before anything is rendered.

    Args:
        manifest: TOML.
        folder: Receives a folder for each look.
        force: Whether to replace results of something else, or results changed by hand.
        command: The shell command that was run, for the reports.

    Raises:
        BatchError: With all mistakes, one line each.
        OutputError: If `folder` cannot be written.
    """
    manifest_, folder = read_manifest(manifest), Path(folder)
    entries = entries_of(manifest_)
    if not manifest_.mistakes.lines:
        check_writable(folder)
        check_gallery(folder, force=force)
    planner = _Planner(manifest_, folder, entries.complete, force=force, command=command)
    looks = planner.plan_looks(entries.complete)
    for _, entry in entries.incomplete:
        planner.collect_errors(entry)
    if manifest_.mistakes.lines:
        raise BatchError.of(manifest_.mistakes.lines)
    names = frozenset(look.entry.name for look in looks)
    planner.cache.keep_only(())
    cache, remarks = planner.cache, planner.journal.remarks
    groups = tuple(planner.groups.values())
    sources = manifest_.path, folder, looks, planner.costs, names, cache, remarks, groups
    return plan_steps.Plan(*sources, planner.measurements)


@dataclass(frozen=True)
class _CheckedLook:
    """A look with all defaults resolved. source_files: the files that it reads, but for bases.

    failure: why it cannot be done; "" if it can.
    """

    entry: LookEntry
    source_files: tuple[Path, ...]
    failure: str
    remarks: tuple[str, ...]


class _Planner:
    """A planner of one entry after the other, with the data that entries share."""

    def __init__(
        self,
        manifest: Manifest,
        folder: Path,
        entries: Sequence[LookEntry],
        *,
        force: bool,
        command: str,
    ) -> None:
        self._mistakes: Mistakes = manifest.mistakes
        self._force, self._command, self._folder = force, command, folder
        self._folders = {entry.name: folder / entry.name for entry in entries}
        self.cache, self.journal = WorkerCache(), Journal(folder)
        self._fingerprints = Fingerprints(manifest.folder)
        self._failed_looks: set[str] = set()
        self._looks_with_moves: list[str] = []
        self.groups: dict[str, plan_steps.PlaceGroup] = {}
        self.costs: dict[str, plan_steps.Cost] = {}
        self.measurements: dict[str, plan_steps.Cost] = {}
        self._planes: dict[tuple[str, str], PlanesFile] = {}

    def plan_looks(self, entries: Sequence[LookEntry]) -> tuple[plan_steps.PlannedLook, ...]:
        """Return the plan of each look, with those whose lights hang at shared places.

        Errors in the manifest are added to its mistakes; errors in a look's own files become its
        failure.
        """
        checked = [self._check_look(entry) for entry in entries]
        places = self._group(checked)
        return tuple(self._plan_look(x, places.get(x.entry.name, "")) for x in checked)

    def _check_look(self, entry: LookEntry) -> "_CheckedLook":
        """Return one look with all defaults resolved."""
        failure: str = ""
        remarks: tuple[str, ...] = ()
        source_files: tuple[Path, ...] = ()
        try:
            entry, source_files, remarks = self._resolve_entry(entry)
        except LOOK_ERRORS as error:
            failure = error.sentence.spelled(as_key)
        except LightpaintError as error:
            failure = error.sentence.spelled(as_key)
            self._mistakes.add(entry.label, failure)
            self.collect_errors(entry)
        if not failure and (failed_parts := self._failed_looks & set(entry.combined_looks)):
            failure = f"it is made of {some_names(sorted(failed_parts))}, which failed"
        if failure:
            self._failed_looks.add(entry.name)
        return _CheckedLook(entry, source_files if not failure else (), failure, remarks)

    def _group(self, checked: Sequence["_CheckedLook"]) -> dict[str, str]:
        """Group looks that share places; return the file of the places of each, by its name."""
        looks = {x.entry.name: x for x in checked if not x.failure}
        entries, files = [x.entry for x in looks.values()], dict[str, str]()
        try:
            groups = plan_steps.group_entries(entries, self._looks_with_moves)
        except LightpaintError as error:
            self._mistakes.add("", error.sentence)
            return {}
        for group in groups:
            file = plan_steps.file_of_group(self._folder, group)
            looks_with_files = [
                (entry, looks[entry.name].source_files)
                for entry in plan_steps.deciding_looks(group)
            ]
            tasks = [
                self._answer_task(entry, source_files) for entry, source_files in looks_with_files
            ]
            fingerprint = self._fingerprints.places(looks_with_files)
            self.groups[str(file)] = plan_steps.PlaceGroup(file, tuple(tasks), fingerprint)
            files |= {entry.name: str(file) for entry in group}
        return plan_steps.places_of(entries, files)

    def _plan_look(self, look: "_CheckedLook", places: str) -> plan_steps.PlannedLook:
        """Return the plan of a look. places: file of its lights' places; "" if none may move."""
        entry, is_possible = look.entry, not look.failure
        if places:
            entry = replace(entry, places=places)
            for key, old_key in zip(
                work_items.bases_of(entry), work_items.bases_of(look.entry), strict=True
            ):
                if old_key in self.costs:
                    self.costs[key] = self.costs[old_key]
        steps = self._steps(entry, look.source_files, is_possible=is_possible)
        folder = self._folders[entry.name]
        return plan_steps.PlannedLook(entry, folder, steps, look.failure, look.remarks)

    def _answer_task(self, entry: LookEntry, source_files: Sequence[Path]) -> work_items.Task:
        options: dict[str, Any] = {"force": self._force, "command": self._command}
        return work_items.answer_task(entry, self._folders, source_files=source_files, **options)

    def collect_errors(self, entry: LookEntry) -> None:
        """Add all errors of a look that cannot be planned, not only the first."""
        _collect_errors(entry, self.cache, self._mistakes)

    def _steps(
        self, entry: LookEntry, source_files: Sequence[Path], *, is_possible: bool
    ) -> tuple[plan_steps.PlanStep, ...]:
        """Return the steps of a look: its answer, and its render and exports if requested."""
        folder = self._folders[entry.name]
        answer = self._answer_task(entry, source_files)
        tasks, group = [answer], self.groups.get(entry.places)
        places = "" if group is None else group.fingerprint
        fingerprints = [self._fingerprints.answer(entry, source_files, places)]
        if "render" in entry.want:
            tasks.append(work_items.render_task(answer, entry, folder))
            fingerprints.append(self._fingerprints.render(entry))
        if "export" in entry.want:
            tasks.append(work_items.export_task(answer, entry, folder))
            fingerprints.append(self._fingerprints.export(entry))
        is_whole = is_possible and pipeline.is_as_written(folder)
        steps = []
        for task, fingerprint in zip(tasks, fingerprints, strict=True):
            line = self.journal.lines.get((task.look, task.kind))
            is_done = line is not None and (line.state, line.made_of) == ("done", fingerprint)
            # A new answer invalidates its render and exports.
            is_whole = is_whole and is_done
            if task.kind == "export":
                is_whole = is_whole and pipeline.is_as_written(folder / work_items.EXPORT)
            steps.append(plan_steps.PlanStep(task, fingerprint, is_whole))
        return tuple(steps)

    def _resolve_entry(
        self, entry: LookEntry
    ) -> tuple[LookEntry, tuple[Path, ...], tuple[str, ...]]:
        """Return the entry with all defaults resolved, the files that it reads, and remarks."""
        scenes = tuple(map(self.cache.scene, entry.scenes))
        # At most one saved basis stays in memory, and only the cache holds it.
        self.cache.keep_only(work_items.bases_of(entry))
        basis = None if entry.basis is None else self.cache.source(entry.basis.without_content())
        if not entry.is_solved:
            return entry, *self._check_lighting_look(replace(entry, scenes=scenes, basis=basis))
        settings, constraints = entry.settings, entry.constraints
        job = self._job(entry, scenes, basis, settings, constraints)
        if entry.variation:
            options = replace(settings, hold=job.fit.hold)
            settings, constraints = vary(
                entry.variation, options, constraints, adjusted_light_count(job)
            )
            job = self._job(entry, scenes, basis, settings, constraints)
        if scenes:
            self._check_planes(entry.name, scenes[0].content, constraints, settings)
        if entry.is_by_sums:
            _check_by_sums(job)
        elif job.all_rigging and entry.basis is None:
            self._looks_with_moves.append(entry.name)
        elif entry.shares_places:
            raise BatchError(
                f"share = 'places', and no light may move in {scenes[0].path}: say in its lights "
                "file which may, or leave share out"
            )
        self._note_costs(entry, [view.scene for view in job.views], job.settings)
        if entry.final.resolution is not None and "render" in entry.want:
            on_film(scenes[0].content, None, entry.final.resolution)
        source_files = tuple(dict.fromkeys(job.results.reads))
        entry = replace(entry, settings=settings, constraints=constraints)
        return entry, source_files, (*job.remarks, *_remarks_on_suns(job))

    def _check_planes(
        self, name: str, scene: Scene, constraints: Constraints, settings: pipeline.Settings
    ) -> None:
        """Check the planes that settings of a look name, if any, and note what their lux cost; each
        file is read once for a scene.
        """

        def read(path: str | Path, scene: Scene) -> PlanesFile:
            key = str(path), scene.identity
            if key not in self._planes:
                self._planes[key] = read_planes(path, scene)
            return self._planes[key]

        if settings.planes is not None:
            pipeline.check_planes(scene, settings.planes, constraints, settings, read=read)
            self.measurements[name] = _cost_of_lux(scene, read(settings.planes, scene), settings)

    def _job(
        self,
        entry: LookEntry,
        scenes: Sequence[Any],
        basis: Any,
        settings: pipeline.Settings,
        constraints: Constraints,
    ) -> pipeline.Job:
        """Return the job of a look, which reads, checks and releases the look's painting."""
        paintings = tuple(painting.without_content() for painting in entry.paintings)
        settings = replace(settings, force=self._force, command=self._command)
        folder = self._folders[entry.name]
        return pipeline.Job(
            tuple(scenes), paintings, folder, basis, constraints, settings, entry.by_sensor
        )

    def _check_lighting_look(self, entry: LookEntry) -> tuple[tuple[Path, ...], tuple[str, ...]]:
        """Check a look with a given or combined lighting; return its input files and remarks."""
        scenes: list[Scene] = [file.content for file in entry.scenes]
        scene = scenes[0] if scenes else None
        basis = None if entry.basis is None else entry.basis.content
        groups = basis if isinstance(basis, LightGroups) else None
        files = entry.scenes[0].read_files if entry.scenes else ()
        if groups is not None:
            files += tuple(groups.files)
        elif entry.basis is not None:
            files += (Path(entry.basis.path),)
        if entry.settings.planes is not None:
            files += (Path(entry.settings.planes),)
        source_files = (*files, Path(entry.lighting)) if entry.lighting else files
        if entry.lighting:
            _check_given_lighting(entry, scene, basis)
        if scene is not None:
            self._check_planes(entry.name, scene, entry.constraints, entry.settings)
        elif entry.settings.planes is not None:
            raise BatchError("settings.planes needs the scene: give scene = ...")
        folders = [str(self._folders[name] / "lighting.json") for name in entry.combined_looks]
        lightings = tuple([entry.lighting] if entry.lighting else folders)
        views = pipeline.view_names(scenes) if entry.by_sensor else [""]
        options: dict[str, Any] = {"views": views, "groups": groups, "force": self._force}
        options["planes"] = entry.settings.planes
        derived_folder(self._folders[entry.name], scene, lightings, **options).check()
        settings = entry.settings
        films = [
            on_film(sensor_scene, settings.quality, settings.resolution) for sensor_scene in scenes
        ]
        self._note_costs(entry, films, settings)
        if scene is not None and entry.final.resolution is not None and "render" in entry.want:
            on_film(scene, None, entry.final.resolution)
        return source_files, ()

    def _note_costs(
        self, entry: LookEntry, films: Sequence[Scene | None], settings: pipeline.Settings
    ) -> None:
        """Store the cost of each basis that has to be obtained. films: one for each basis."""
        if entry.basis is not None:
            return
        for key, film in zip(work_items.bases_of(entry), films, strict=True):
            if film is None or key in self.costs:
                continue
            spp = settings.basis_spp
            self.costs[key] = plan_steps.Cost(
                f"{film.path.name} through {film.sensor_names[film.sensor]}",
                len(film.lights),
                film.size,
                film.spp if spp is None else spp,
                memory_needed(film),
            )


def _cost_of_lux(scene: Scene, planes: PlanesFile, settings: pipeline.Settings) -> plan_steps.Cost:
    """Return the cost of the illuminance of each light at all points."""
    points = sum(len(plane) for plane in planes.planes)
    error = settings.error or planes.error
    spp = min(max(LUX_SPP * (DEFAULT_ERROR / error) ** 2, FIRST_SPP), MOST_SPP)
    text = f"{planes.path.name} in {scene.path.name}"
    return plan_steps.Cost(text, len(scene.lights), (1, points), int(spp), 0)


def _collect_errors(entry: LookEntry, cache: WorkerCache, mistakes: Mistakes) -> None:
    """Add errors in scene, sensors, settings and constraints, each checked alone, to the mistakes.

    cache: scenes and bases that are already loaded. Errors that fail one look alone, like a basis
    that cannot be read, are not mistakes of the manifest.
    """

    def attempt(call: Callable[[], Any]) -> Any:
        try:
            return call()
        except LOOK_ERRORS:
            return None
        except LightpaintError as error:
            mistakes.add(entry.label, error.sentence.spelled(as_key))
            return None

    lights: Sequence[BasisLight] | None = None
    for scene in map(cache.scene, entry.scenes):
        loaded_scene = attempt(partial(pipeline.content, scene))
        if loaded_scene is None:  # the lights can be checked without a sensor
            without_sensor = cache.scene(replace(scene, sensor=None))
            loaded_scene = attempt(partial(pipeline.content, without_sensor))
        if loaded_scene is None:
            continue
        lights = basis_lights(loaded_scene)
        attempt(partial(on_film, loaded_scene, entry.settings.quality, entry.settings.resolution))
        if "render" in entry.want:
            attempt(partial(on_film, loaded_scene, None, entry.final.resolution))
    if entry.basis is not None:
        source = cache.source(entry.basis.without_content())
        loaded_scene = attempt(partial(pipeline.content, source))
        if loaded_scene is not None:
            lights = (
                loaded_scene.basis.lights
                if isinstance(loaded_scene, LightGroups)
                else loaded_scene.lights
            )
        if not entry.scenes:
            attempt(partial(pipeline.check_nothing_unused, entry.settings, entry.basis))
    if lights is not None:
        for part in _split_constraints(entry.constraints):
            attempt(partial(reduce_to, part, lights))
        for name, emission in entry.constraints.start.items():
            attempt(partial(start_weights, {name: emission}, lights))


def _split_constraints(constraints: Constraints) -> Iterator[Constraints]:
    """Yield the constraints on each light, each tie, and on all lights."""
    for light in constraints.lights:
        yield Constraints(lights=(light,))
    for tie in constraints.ties:
        yield Constraints(ties=(tie,))
    yield replace(constraints, lights=(), ties=(), start={})


def _check_by_sums(job: pipeline.Job) -> None:
    """Raise BatchError if the lighting of a job does not follow from sums alone."""
    [view] = job.views
    reason = reason_against_sums(view.target, job.fit)
    if not reason and view.basis is None and view.scene is not None:
        reason = why_not_one_pass(view.scene) or ""
    if view.scene is not None and view.scene.is_spectral and _chooses_mixes(job.all_constraints):
        reason = "with spectra, mixes of one colour are chosen by their pictures"
    if job.all_constraints.near:
        reason = "near depends on the area of the paint"
    if job.all_rigging:
        reason = "lights may move in it, unless move_lights is false"
    if reason:
        raise BatchError(f"want = ['lights'] takes sums alone, and {reason}: want 'solve' instead")


def _chooses_mixes(constraints: Constraints) -> bool:
    """Return whether lamps may get other mixes of their colours after the solve."""
    keys = {key for _, table, _ in constraints.lights for key in table}
    has_colors = bool(constraints.ties) or not keys.isdisjoint(("rf", "color", "kelvin"))
    return has_colors or constraints.prefer_emitters is not None


def _check_given_lighting(
    entry: LookEntry, scene: Scene | None, basis: Basis | LightGroups | None
) -> None:
    """Raise BatchError if the lighting of a look has other lights than its scene or basis."""
    lighting = read_lighting(entry.lighting)
    lighting_names = set(lighting)
    if scene is not None:
        scene_names = {light.name for light in scene_of(scene, lighting).lights}
        if lighting_names != scene_names:
            raise BatchError(
                f"{entry.lighting} has the lights {some_names(sorted(lighting_names))}, and the "
                f"scene {some_names(sorted(scene_names))}: load it with the same lights and groups"
            )
    elif isinstance(basis, LightGroups | Basis):
        names = (basis.basis if isinstance(basis, LightGroups) else basis).names
        if lighting_names != set(names):
            raise BatchError(f"{entry.lighting} is of other lights than {entry.basis}")


def _remarks_on_suns(job: pipeline.Job) -> tuple[str, ...]:
    """Return a remark on a sun that a lights file asks for, and that a batch does not find."""
    scene = next((view.scene for view in job.views if view.scene is not None), None)
    if scene is None or not (suns := {k: n for k, n in scene.requests.sun.items() if n}):
        return ()
    return (
        f"the lights file asks for a sun in {some_names(suns)}, which a batch does not find, since "
        "its looks share their basis: the texels stay as they are; solve a look alone for its sun",
    )
