"""A job: scene or basis, paintings, constraints, settings and folder, in one record; and its views.

A job is checked once, when it is created: every mistake in it is reported before the first sample.
A job of files and plain values can be sent to another machine, which reads the files again; a job
of objects in memory can only run where it is.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from lightpaint import lighting
from lightpaint.arrays import Bools
from lightpaint.basis import Basis, FrameSequence, LightGroups, Lights, spoken_frames
from lightpaint.basis.cache import check_same_view
from lightpaint.basis.render import basis_lights
from lightpaint.display_text import short_repr
from lightpaint.errors import ConstraintError, LightpaintError, SceneError, TargetError
from lightpaint.files import check_writable
from lightpaint.images import whole_factor
from lightpaint.keywords import keywords
from lightpaint.pipeline.job import job_checks
from lightpaint.pipeline.job.job_record import decode_job, encode_job
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import (
    BasisFile,
    GroupsFile,
    Painting,
    PlacementFile,
    SceneFile,
    check_nothing_unused,
    check_spectral,
    content,
    observer_of,
    spectral_scene,
)
from lightpaint.pipeline.look import SOLVE_RESULTS, VIEW_RESULTS, checked_names, view_names
from lightpaint.pipeline.result_folder import ResultFolder, answer_files, files_of_planes
from lightpaint.placement import PlacementRecord, Rigging, check_suggestible
from lightpaint.relit import plugin_remark, spoken_unreadable
from lightpaint.scene import Scene
from lightpaint.scene.quality_presets import on_film
from lightpaint.sentences import Hint, Sentence
from lightpaint.target import Target
from lightpaint.threads import parallel_map

#: A basis, or light groups of another renderer, in memory or in a file.
AnyBasis = Basis | BasisFile | LightGroups | GroupsFile


@dataclass(frozen=True)
class PaintedView:
    """The view through one sensor: its painting, and the folder of its results.

    scene: on the film of the basis; None if there is only a basis. target: of the size of the
    basis. basis: None if it is still to be rendered.
    """

    scene: Scene | None
    target: Target
    folder: Path
    basis: Basis | None = None

    def without(self, holes: Bools) -> "PaintedView":
        """Return the view with importance 0 in the pixels `holes`, (h, w)."""
        return replace(self, target=self.target.without(holes))


@keywords()
@dataclass(frozen=True, eq=False)
class Job:
    """A lighting to find, for one view or several; it is checked completely when it is created.

    Attributes:
        scenes: The scene through the sensor of each view; empty to solve from `basis` alone,
            without a renderer.
        targets: The painting of each view.
        folder: Receives the results; a path or its text.
        basis: Existing basis, of several views a tuple with one for each; taken from the cache or
            rendered if not given. With another renderer's light groups `folder` also receives files
            for other programs.
        constraints: Constraints on the lights; they override the constraints of the scene's lights
            file.
        settings: Settings of the solve.
        by_sensor: True to write the pictures to a folder for each sensor, as with several views.
        rigging: Lights that may move, and lights to add; needs a scene. It overrides the rigging of
            the scene's lights file.
        placement: Places found earlier for several looks; then there is no search.
        sequence: The frames of the shot whose light groups are in `basis`.
        views: Set on creation: the views, each with what it needs.
        all_constraints: Set on creation: all constraints, the lights file's first.
        scale: Set on creation: cd/m² of a radiance of 1, and the lights for which that is a guess.
        all_rigging: Set on creation: all rigging, the lights file's first.
        fit: Set on creation: the settings, including those that the paintings decide.
        remarks: Set on creation: remarks for the user, in plain text.
        all_groups: Set on creation: the light groups of each view, all with the same lights; empty
            without any.
        results: Set on creation: the folder, and the files that may be replaced there.

    Raises:
        LightpaintError: For an invalid job.

    Examples:
        >>> from pathlib import Path
        >>> scenes, targets = (lp.SceneFile("room.xml"),), (lp.Painting("painting.exr"),)
        >>> job = lp.Job(scenes, targets, Path("evening"), settings=lp.Settings(spp=4))
        >>> lp.Job.from_json(job.to_json()) == job
        True
    """

    scenes: tuple[Scene | SceneFile, ...]
    targets: tuple[Target | Painting, ...]
    folder: Path
    basis: AnyBasis | tuple[AnyBasis, ...] | None = None
    constraints: lighting.Constraints = field(default_factory=lighting.Constraints)
    settings: Settings = field(default_factory=Settings)
    by_sensor: bool = False
    rigging: Rigging = field(default_factory=Rigging)
    placement: PlacementRecord | PlacementFile | None = None
    sequence: FrameSequence | None = None
    views: tuple[PaintedView, ...] = field(init=False, repr=False)
    all_constraints: lighting.Constraints = field(init=False, repr=False)
    scale: lighting.Scale = field(init=False, repr=False)
    all_rigging: Rigging = field(init=False, repr=False)
    fit: Settings = field(init=False, repr=False)
    remarks: tuple[str, ...] = field(init=False, repr=False)
    all_groups: tuple[LightGroups, ...] = field(init=False, repr=False)
    results: ResultFolder = field(init=False, repr=False)

    __repr__ = short_repr

    def __post_init__(self) -> None:
        self._set(folder=Path(self.folder))
        given = self.given_bases
        job_checks.check_inputs(self.scenes, self.targets, given, self.constraints, self.settings)
        if not self.scenes:
            check_nothing_unused(self.settings, given[0])
        job_checks.check_sizes(self.targets, given or self.scenes, self.settings)
        # Paintings and bases are read in parallel; an error in a painting is reported first.
        contents = parallel_map(content, [*self.targets, *given])
        targets, read = (
            contents[: len(self.targets)],
            job_checks.with_same_lights(contents[len(self.targets) :]),
        )
        groups = (x for x in read if isinstance(x, LightGroups))
        self._set(all_groups=tuple(replace(x, sequence=self.sequence) for x in groups))
        bases = [x.basis if isinstance(x, LightGroups) else x for x in read]
        targets = targets_over_looks(self.targets, targets, bases)
        scenes = [content(scene) for scene in self.scenes]
        folders = [self.folder]
        if self.by_sensor or len(targets) > 1:
            names = [self.sequence.numbers[x] for x in self.painted_frames] if self.sequence else []
            names = names or names_of_views(scenes, bases, self.all_groups)
            folders = [self.folder / name for name in names]
        for basis, target in zip(given, self.targets, strict=False):
            job_checks.check_painting_is_no_light(basis, target)
        source = scenes[0] if scenes else bases[0]
        all_constraints = self.constraints
        if isinstance(source, Scene | Basis):
            all_constraints = lighting.constraints_of(source.requests).and_then(all_constraints)
        _check_one_scale(all_constraints, self.settings)
        for scene in scenes:
            lighting.agreed_scale(scene.cd_per_unit, self.settings.cd_per_unit)
        scale = lighting.Constraints(cd_per_unit=self.settings.cd_per_unit)
        all_constraints = all_constraints.and_then(scale)
        if self.settings.spectral:
            observer = observer_of(self.settings.observer)
            scenes = [spectral_scene(scene, all_constraints, observer) for scene in scenes]
        if scenes and bases:
            check_same_view(scenes[0], bases[0])
        job_checks.check_places(self.placement, scenes)
        job_checks.check_animation(self.settings, all_constraints, len(self.painted_frames))
        # Reports impossible constraints before rendering.
        lights = self._lights(scenes, bases)
        # Which lights reach planes is known after these are measured.
        self._set(scale=lighting.Scale.of(all_constraints, lights))
        scaled = lighting.with_sure_scale if self.settings.planes is None else lighting.with_scale
        all_constraints = scaled(all_constraints, lights)
        reduction = lighting.reduce_to(all_constraints, lights)
        if self.settings.watts is not None:
            lighting.check_powers(reduction, [light.name for light in lights], "a limit of power")
        if self.settings.planes is not None:
            job_checks.checked_scale(self.settings.planes, all_constraints.cd_per_unit)
        if scenes and (count := job_checks.wanted_sun(self.settings, scenes)):
            job_checks.sky_for_sun(scenes[0], count)
        if self.settings.suggest:
            check_suggestible(scenes[0])
        all_rigging = job_checks.rigging_for(self.rigging, scenes, self.settings)
        check_spectral(self.settings, all_constraints, all_rigging, self.placement)
        views = painted_views(scenes, targets, bases, folders, self.settings)
        if self.all_groups:
            views = tuple(x.without(y.holes) for x, y in zip(views, self.all_groups, strict=True))
        results = self._result_folder(views, scenes, targets)
        results.check()
        fit = lighting.resolve_for_targets(self.settings, [view.target for view in views])
        self._set(views=views, all_constraints=all_constraints, fit=fit, results=results)
        self._set(all_rigging=all_rigging)
        self._set(remarks=tuple(self._remarks(targets, scenes)))

    def _lights(self, scenes: Sequence[Scene], bases: Sequence[Basis]) -> Lights:
        """Return the lights of the answer: the lights of scene or basis, and lights of given
        places."""
        if self.placement is not None:
            return basis_lights(content(self.placement).hung_in(scenes).scene)
        return bases[0].lights if bases else basis_lights(scenes[0])

    @property
    def given_bases(self) -> tuple[AnyBasis, ...]:
        """The given basis of each view, as given; empty without any."""
        if self.basis is None:
            return ()
        return self.basis if isinstance(self.basis, tuple) else (self.basis,)

    @property
    def groups(self) -> LightGroups | None:
        """The light groups that the job is solved from, of the first view; None for others."""
        return self.all_groups[0] if self.all_groups else None

    @property
    def painted_frames(self) -> tuple[int, ...]:
        """The frame of each view in the sequence; empty without one."""
        if self.sequence is None:
            return ()
        return tuple(self.sequence.frame_of(groups.path) for groups in self.all_groups)

    def with_moved_lights(
        self, scenes: Sequence[Scene], constraints: lighting.Constraints
    ) -> "Job":
        """Return this job with moved lights.

        scenes: the scene of each view, on the same film. constraints: on added lights. Raises
        SceneError for another number of scenes.
        """
        if len(scenes) != len(self.views):
            raise SceneError(f"{len(scenes)} scenes for {len(self.views)} views: give one for each")
        views = zip(self.views, scenes, strict=True)
        return copy(self)._set(
            all_constraints=self.all_constraints.and_then(constraints),
            views=tuple(replace(x, scene=scene, basis=None) for x, scene in views),
        )

    def with_scenes(self, scenes: Sequence[Scene]) -> "Job":
        """Return this job with another scene for each view, on the same film."""
        return self.with_moved_lights(scenes, lighting.Constraints())

    def with_placement(self, placement: PlacementRecord) -> "Job":
        """Return this job with the places of lights found for another look."""
        return copy(self)._set(placement=placement)

    def to_json(self) -> str:
        """Return this job as text, to run it elsewhere; paths stay as given.

        Raises LightpaintError for a job of objects in memory.
        """
        return encode_job(
            self.scenes,
            self.targets,
            self.basis,
            self.constraints,
            self.settings,
            folder=str(self.folder),
            by_sensor=self.by_sensor,
            rigging=self.rigging,
            placement=self.placement,
            sequence=self.sequence,
        )

    @staticmethod
    def from_json(text: str) -> "Job":
        """Return the job that `to_json` wrote, with the files as they are on this machine.

        Raises LightpaintError for invalid text, and for a job that cannot run here.
        """
        return Job(**decode_job(text))

    def __eq__(self, other: object) -> bool:
        """Return True if requests and files are equal; objects in memory must be identical."""
        if self is other or not isinstance(other, Job):
            return self is other
        try:
            return self.to_json() == other.to_json()
        except LightpaintError:
            return False

    def __hash__(self) -> int:
        return hash(self.folder)

    def _set(self, **fields: Any) -> "Job":
        """Set fields of a new job, and return it; it is frozen afterwards."""
        for name, value in fields.items():
            object.__setattr__(self, name, value)
        return self

    def _result_folder(
        self, views: Sequence[PaintedView], scenes: Sequence[Scene], targets: Sequence[Target]
    ) -> ResultFolder:
        """Return the result folder, with all input files. targets: as read."""
        scene = scenes[0] if scenes else None
        files = answer_files(self.folder, scene=scene, groups=self.groups)
        for view in views:
            check_writable(view.folder)
            files += [view.folder / name for name in (VIEW_RESULTS if scenes else SOLVE_RESULTS)]
        if self.settings.planes is not None:
            files += files_of_planes(self.folder, self.settings.planes)
        reads = [file for target in targets for file in target.files]
        settings = self.settings
        reads += [Path(x) for x in (settings.planes, settings.observer) if x is not None]
        reads += [file for scene in scenes for file in scene.read_files]
        others = (*self.given_bases, self.placement)
        reads += [Path(x.path) for x in others if isinstance(x, BasisFile | PlacementFile)]
        for groups in self.all_groups:
            reads += groups.files
        return ResultFolder(
            self.folder,
            tuple(dict.fromkeys(files)),
            tuple(dict.fromkeys(reads)),
            tuple(target.files[0] if target.files else target.name for target in targets),
            force=self.settings.force,
        )

    def _remarks(self, targets: Sequence[Target], scenes: Sequence[Scene]) -> list[str]:
        """Return remarks for the user before this runs. targets, scenes: as read."""
        remarks: list[str] = []
        for groups in self.all_groups:
            remarks += groups.remarks
        if self.groups is not None:
            remarks += spoken_unreadable(self.groups, self.folder)
        if len(self.painted_frames) > 1 and not self.settings.animate:
            frames = spoken_frames(self.painted_frames)
            remark = Sentence(
                f"one lighting for the frames {frames}: ",
                Hint("animate", True),
                " finds one for each, and lights that change between them",
            )
            remarks.append(remark)
        rendered_scenes = [] if self.basis is not None else [x.scene for x in self.views if x.scene]
        if (first := self.views[0].scene) is not None:
            remarks += job_checks.remarks_of_scene(first, is_rendered=bool(rendered_scenes))
            remarks += filter(None, [plugin_remark(first)])
        films = [scene.size for scene in scenes] if rendered_scenes else [None] * len(targets)
        for target, view, film in zip(targets, self.views, films, strict=True):
            remarks += job_checks.remarks_of_target(
                target, view.target.size, view.scene, self.fit, film=film
            )
        for scene in rendered_scenes[:1]:
            remarks += job_checks.remarks_on_spectra(scene, self.all_constraints)
        for scene in rendered_scenes:
            remarks += [
                *job_checks.remarks_of_film(scene, self.settings),
                *job_checks.remarks_of_memory(scene, self.settings.basis_spp),
            ]
        return remarks + job_checks.remarks_of_pictures()


def names_of_views(
    scenes: Sequence[Scene], bases: Sequence[Basis], groups: Sequence[LightGroups]
) -> list[str]:
    """Return the name of each view, after which its folder is named: its sensor, or its file.

    groups: the light groups of the bases, if they are the groups of another renderer.
    """
    if scenes:
        return view_names(scenes)
    if groups:
        return checked_names([x.path.stem for x in groups])
    return checked_names([basis.origin.sensor for basis in bases])


def targets_over_looks(
    sources: Sequence[Target | Painting], targets: Sequence[Target], bases: Sequence[Basis]
) -> list[Target]:
    """Return targets, read as painted over the look of their light groups where they were.

    sources, targets: as given, and as read. bases: of each view, empty without any.
    """
    resolved = list(targets)
    for k, (source, basis) in enumerate(zip(sources, bases, strict=False)):
        if basis.origin.is_light_groups and isinstance(source, Painting):
            name = f"the look of {basis.origin.scene}"
            resolved[k] = source.over(basis.current_look, name) or targets[k]
    return resolved


def painted_views(
    scenes: Sequence[Scene],
    targets: Sequence[Target],
    bases: Sequence[Basis],
    folders: Sequence[Path],
    settings: Settings,
) -> tuple[PaintedView, ...]:
    """Return the view of each target, with scene and target in the size of the basis.

    scenes, bases: of each view; one of the two may be empty.
    """
    return tuple(
        _painted_view(
            scenes[k] if scenes else None, target, bases[k] if bases else None, folder, settings
        )
        for k, (target, folder) in enumerate(zip(targets, folders, strict=True))
    )


def _painted_view(
    scene: Scene | None, target: Target, basis: Basis | None, folder: Path, settings: Settings
) -> PaintedView:
    """Return a view in the size that its basis has, or will have."""
    check_target(target)
    if scene is not None:
        check_same_picture(target, scene)
    if scene is not None and basis is None:
        scene = on_film(scene, settings.quality, _resolution(scene, target, settings))
    sized_source = scene if basis is None else basis
    assert sized_source is not None
    fitted = target.fitted_to(sized_source.size, resize=settings.resize)
    return PaintedView(scene, fitted, folder, basis)


def _resolution(scene: Scene, target: Target, settings: Settings) -> str | None:
    """Return the resolution in the settings, else the resolution of a smaller painted template."""
    if settings.quality is not None or settings.resolution is not None or settings.resize:
        return settings.resolution
    factor = whole_factor(scene.size, target.size)
    return f"1/{factor}" if target.content and factor and factor > 1 else None


def check_target(target: object) -> None:
    """Raise TargetError for anything but a target."""
    if not isinstance(target, Target):
        raise TargetError(f"the target is a {type(target).__name__}: pass what read_target returns")


def check_same_picture(target: Target, scene: Scene) -> None:
    """Raise TargetError if the painting's sensor is not the sensor of `scene`."""
    sensor = scene.sensor_names[scene.sensor]
    if target.sensor not in ("", sensor):
        raise TargetError(
            f"{target.name} was painted on a template of the sensor {target.sensor}, not of "
            f"{sensor}: choose it with ",
            Hint("sensor", target.sensor),
            ", or pass ",
            Hint("find", False),
        )


def _check_one_scale(constraints: lighting.Constraints, settings: Settings) -> None:
    """Raise ConstraintError if a lights file and the settings say different scales."""
    own, given = constraints.cd_per_unit, settings.cd_per_unit
    if own is not None and given is not None and own != given:
        raise ConstraintError(
            f"cd_per_unit is {own:g} in the lights file and {given:g} by ",
            Hint("cd_per_unit"),
            ": drives depend on it; leave one out",
        )
