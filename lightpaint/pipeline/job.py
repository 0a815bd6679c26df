"""One record of what is asked: scene or basis, paintings, constraints, settings, folder.

A job is checked once, when it is born: whatever somebody gave is looked at before the first
sample is taken. One of files and plain values can be sent to another machine, which reads the
files anew; one of objects in memory can only be run where it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from lightpaint.basis.basis import Basis
from lightpaint.basis.lightgroups.read import LightGroups
from lightpaint.basis.render.obtain import check_same_view
from lightpaint.basis.render.render import basis_lights
from lightpaint.errors import BasisError, ConstraintError, LightpaintError, TargetError
from lightpaint.files import check_writable
from lightpaint.images.pixel_blocks import whole_factor
from lightpaint.keywords import keywords
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.lighting.constraints.reduction import reduce_to
from lightpaint.lighting.fit import resolve_for_targets
from lightpaint.pipeline.answer_folder import answer_files
from lightpaint.pipeline.job_record import decode_job, encode_job
from lightpaint.pipeline.remarks import (
    remarks_of_film,
    remarks_of_memory,
    remarks_of_pictures,
    remarks_of_scene,
    remarks_of_target,
)
from lightpaint.pipeline.result_folder import ResultFolder
from lightpaint.pipeline.results import ALWAYS, VIEW_RESULTS, view_names
from lightpaint.pipeline.settings import Settings
from lightpaint.pipeline.sources import (
    BasisFile,
    GroupsFile,
    Painting,
    SceneFile,
    check_nothing_idle,
    content,
)
from lightpaint.placement.light_search import check_suggestible
from lightpaint.relit.export.nuke import spoken_unreadable
from lightpaint.scene.presets import on_film
from lightpaint.scene.scene import Scene
from lightpaint.screen import short_repr
from lightpaint.target.target import Target
from lightpaint.threads import parallel_map


@dataclass(frozen=True)
class PaintedView:
    """What is seen through one sensor: its painting, and where its results go.

    scene: on the film of the basis; None where there is only a basis. target: of the size of the
    basis. basis: None where it is still to be rendered.
    """

    scene: Scene | None
    target: Target
    folder: Path
    basis: Basis | None = None


@keywords()
@dataclass(frozen=True, eq=False)
class Job:
    """One lighting to be found, for one view or several; checked whole when it is born.

    Attributes:
        scenes: The scene through the sensor of each view; none to solve from `basis` alone, without
            a renderer.
        targets: What each view is to show.
        folder: Receives the results.
        basis: Made before of the one view; taken from the cache or rendered if not given. Of light
            groups that another renderer made, `folder` receives the answer for other programs, too.
        constraints: What is asked of the lights; it goes before what the scene's lights file asks.
        settings: How it is to be answered.
        by_sensor: Whether pictures go to a folder for each sensor, as they do of several.
        views: Found at birth: each view, with what it needs.
        asked: Found at birth: all constraints, those of the lights file first.
        fit: Found at birth: the settings, with all decided that follows from the paintings.
        remarks: Found at birth: what is worth saying to a person, in plain text.
        results: Found at birth: the folder, and what may be replaced there.

    Raises:
        LightpaintError: For what cannot be.

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
    basis: Basis | BasisFile | LightGroups | GroupsFile | None = None
    constraints: Constraints = field(default_factory=Constraints)
    settings: Settings = field(default_factory=Settings)
    by_sensor: bool = False
    views: tuple[PaintedView, ...] = field(init=False, repr=False)
    asked: Constraints = field(init=False, repr=False)
    fit: Settings = field(init=False, repr=False)
    remarks: tuple[str, ...] = field(init=False, repr=False)
    results: ResultFolder = field(init=False, repr=False)

    __repr__ = short_repr

    def __post_init__(self) -> None:
        self._check_counts()
        if not self.scenes:
            check_nothing_idle(self.settings, self.basis)
        # A painting is read beside the basis, and a mistake in it is said first.
        *targets, basis = parallel_map(content, [*self.targets, self.basis])
        basis = basis.basis if isinstance(basis, LightGroups) else basis
        if basis is not None and basis.origin.is_light_groups:
            pairs = zip(self.targets, targets, strict=True)
            targets = [_over_look(given, target, basis) for given, target in pairs]
        scenes = [content(scene) for scene in self.scenes]
        folders = [self.folder]
        if self.by_sensor or len(scenes) > 1:
            folders = [self.folder / name for name in view_names(scenes)]
        self._check_painting_is_no_light()
        told = scenes[0] if scenes else basis
        asked = self.constraints
        if isinstance(told, Scene | Basis):
            asked = constraints_of(told.requests).and_then(asked)
        if scenes and basis is not None:
            check_same_view(scenes[0], basis)
        # Names what cannot be had before it renders.
        reduce_to(asked, basis_lights(scenes[0]) if basis is None else basis.lights)
        if self.settings.suggest:
            check_suggestible(scenes[0])
        views = tuple(
            PaintedView(*self._on_one_film(scene, target, basis), folder, basis)
            for scene, target, folder in zip(scenes or [None], targets, folders, strict=True)
        )
        results = self._result_folder(views, scenes, targets)
        results.check()
        # The only place that sets what was found; frozen afterwards.
        born = vars(self)
        fit = resolve_for_targets(self.settings, [view.target for view in views])
        born.update(views=views, asked=asked, fit=fit, results=results)
        born.update(remarks=tuple(self._remarks(targets, scenes)))

    @property
    def groups(self) -> LightGroups | None:
        """The light groups it is solved from, if it is from such."""
        found = content(self.basis)
        return found if isinstance(found, LightGroups) else None

    def to_json(self) -> str:
        """This job as text, to be run elsewhere; paths stay as they were given.

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
        )

    @staticmethod
    @keywords()
    def from_json(text: str) -> "Job":
        """The job that `to_json` wrote, of the files as they are here and now.

        Raises LightpaintError for what is no job, and for one that cannot be done here.
        """
        return Job(**decode_job(text))

    def __eq__(self, other: object) -> bool:
        """Whether the same is asked of the same files. Jobs in memory equal only themselves."""
        if self is other or not isinstance(other, Job):
            return self is other
        try:
            return self.to_json() == other.to_json()
        except LightpaintError:
            return False

    def __hash__(self) -> int:
        return hash(self.folder)

    def _check_counts(self) -> None:
        """Raise unless every view has its painting, and there is something to solve with."""
        if not isinstance(self.constraints, Constraints):
            raise ConstraintError(
                f"the constraints are a {type(self.constraints).__name__}: give Constraints.of(...)"
            )
        if not self.scenes and self.basis is None:
            raise LightpaintError("give a scene, a basis, or both")
        if not self.targets:
            raise TargetError("no painting to solve for: give a target")
        several = len(self.targets) > 1 or len(self.scenes) > 1
        if several and self.basis is not None:
            raise BasisError("a basis has one view only: give the scene, to solve for several")
        if several and self.settings.suggest:
            raise LightpaintError("lights are suggested for one view only: leave out the others")
        if self.scenes and len(self.targets) != len(self.scenes):
            raise TargetError(
                f"{len(self.targets)} targets for {len(self.scenes)} views: give one for each; "
                "several paintings of one view are a job each"
            )

    def _check_painting_is_no_light(self) -> None:
        """Raise BasisError where a folder of light groups has the painting among its lights."""
        if self.groups is None or not self.groups.path.is_dir():
            return
        files = {layer.file.resolve() for layer in self.groups.layers}
        for target in self.targets:
            if isinstance(target, Painting) and Path(target.path).resolve() in files:
                raise BasisError(
                    f"the painting {target.path} is among the lights of {self.groups.path}: pass "
                    "it to read_light_groups in leave_out, or move it elsewhere"
                )

    def _result_folder(
        self, views: Sequence[PaintedView], scenes: Sequence[Scene], targets: Sequence[Target]
    ) -> ResultFolder:
        """Where results go, with all that is read for them. targets: as they were read."""
        scene = scenes[0] if scenes else None
        files = answer_files(self.folder, scene=scene, groups=self.groups)
        for view in views:
            check_writable(view.folder)
            files += [view.folder / name for name in (VIEW_RESULTS if scenes else ALWAYS)]
        reads = [file for target in targets for file in target.files]
        reads += [file for scene in scenes for file in scene.read_files]
        if isinstance(self.basis, BasisFile):
            reads.append(Path(self.basis.path))
        if self.groups is not None:
            reads += self.groups.files
        return ResultFolder(
            self.folder,
            tuple(dict.fromkeys(files)),
            tuple(dict.fromkeys(reads)),
            tuple(target.files[0] if target.files else target.name for target in targets),
            force=self.settings.force,
        )

    def _on_one_film(
        self, scene: Scene | None, target: Target, basis: Basis | None
    ) -> tuple[Scene | None, Target]:
        """Scene and target of the size that the basis has, or will have."""
        if not isinstance(target, Target):
            raise TargetError(
                f"the target is a {type(target).__name__}: give what read_target returns"
            )
        if scene is not None:
            check_same_picture(target, scene)
        if scene is not None and basis is None:
            scene = on_film(scene, self.settings.quality, self._resolution(scene, target))
        given = scene if basis is None else basis
        assert given is not None
        fitted = target.fitted_to(given.size, resize=self.settings.resize)
        return scene, fitted if self.groups is None else fitted.without(self.groups.holes)

    def _resolution(self, scene: Scene, target: Target) -> str | None:
        """Return the resolution asked for; else, of a smaller template, that it was painted at."""
        asked = self.settings
        if asked.quality is not None or asked.resolution is not None or asked.resize:
            return asked.resolution
        factor = whole_factor(scene.size, target.size)
        return f"1/{factor}" if target.content and factor and factor > 1 else None

    def _remarks(self, targets: Sequence[Target], scenes: Sequence[Scene]) -> list[str]:
        """Say what a person should know before this is run. targets, scenes: as they were read."""
        remarks = []
        if self.groups is not None:
            remarks += [*self.groups.remarks, *spoken_unreadable(self.groups, self.folder)]
        rendered = [] if self.basis is not None else [x.scene for x in self.views if x.scene]
        if (first := self.views[0].scene) is not None:
            remarks += remarks_of_scene(first, is_rendered=bool(rendered))
        films = [scene.size for scene in scenes] if rendered else [None] * len(targets)
        for target, view, film in zip(targets, self.views, films, strict=True):
            remarks += remarks_of_target(target, view.target.size, view.scene, self.fit, film=film)
        for scene in rendered:
            remarks += [*remarks_of_film(scene, self.settings), *remarks_of_memory(scene)]
        return remarks + remarks_of_pictures()


def _over_look(given: Target | Painting, target: Target, basis: Basis) -> Target:
    """Return `target`, as it was painted over what `basis` shows, where it was."""
    if not isinstance(given, Painting):
        return target
    return given.over(basis.present_look, f"the look of {basis.origin.scene}") or target


def check_same_picture(target: Target, scene: Scene) -> None:
    """Raise TargetError for a painting of another view than `scene` is seen through."""
    sensor = scene.sensor_names[scene.sensor]
    if target.sensor not in ("", sensor):
        raise TargetError(
            f"{target.name} was painted on a template of the sensor {target.sensor}, not of "
            f"{sensor}: choose it with sensor={target.sensor!r}, or pass find=False"
        )
