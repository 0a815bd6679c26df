"""The files of a job: a scene, a painting, a saved basis, light groups.

Each consists of plain values that can be sent elsewhere, and is read once, on first use.
"""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Self

from lightpaint import lighting
from lightpaint.arrays import Floats
from lightpaint.basis import (
    Basis,
    LightGroups,
    is_light_groups,
    read_basis,
    read_light_groups,
)
from lightpaint.basis.render import basis_lights, check_renders_spectra
from lightpaint.colour import EYE, Observer, TransformChoice, read_observer
from lightpaint.errors import BasisError, ConstraintError, LightpaintError, SceneError
from lightpaint.keywords import keywords
from lightpaint.pipeline.job.settings import Settings
from lightpaint.placement import PlacementRecord, read_placement
from lightpaint.scene import Scene, load_scene, part_name
from lightpaint.sentences import Hint, Sentence
from lightpaint.target import Paint, Target, read_over_look, read_target

#: Settings of sampling, of rendering, and those that light groups do not support.
SAMPLING_SETTINGS = ("spp", "exact_spp", "time_s", "error", "quality", "resolution")
RENDER_SETTINGS = (
    *SAMPLING_SETTINGS,
    *("refine", "suggest", "sun", "planes", "spectral", "observer", "verify_spp"),
)
NOT_IN_GROUPS = (*RENDER_SETTINGS, "seed", "noise_correction", "cd_per_unit", "emitters")


class ReadOnce:
    """A file described by plain values, whose content is read on first use, and kept.

    The content stays in this process: a copy that is sent elsewhere reads the file there.
    """

    def without_content(self) -> Self:
        """Return the same file, not read yet."""
        return type(self)(**vars_of(self))

    def __getstate__(self) -> dict[str, Any]:
        return vars_of(self)

    def __setstate__(self, fields: dict[str, Any]) -> None:
        vars(self).update(fields)


@keywords()
@dataclass(frozen=True)
class SceneFile(ReadOnce):
    """A scene file with the arguments of `load_scene`; loaded once, on first use.

    Attributes:
        path: Mitsuba XML.
        sensor: Index or id of the sensor.
        parameters: Values of the `$name` parameters.
        variant: Mitsuba variant.
        lights: Names or patterns of the lights to adjust.
        groups: Emitters that form one light, by its name.
        lights_file: TOML to read instead of the one beside the scene.
        use_lights_file: False to ignore that one.
        only_luminaires: Whether to read only the luminaires of it.
        group_alike: False to adjust similar emitters without names one by one.
        integrator: Integrator to use instead of the scene's own.
        split: Columns and rows of lights that are images, `16x8`, by name, or layouts of texels.
        symmetric: Names of those whose images are symmetric.
        map_size: Columns and rows of their images in the relit scene, `1024x512`.
        lamps: Names or patterns of lights whose colour may lie outside Rec.709.
        spectral: Whether each emitter of its lamps is a light, under its spectrum in the lights
            file.
        observer: With `spectral`, the table of a camera's sensitivities; None for the eye.

    Examples:
        >>> lp.SceneFile("room.xml").content.size
        (16, 16)
    """

    path: str
    sensor: int | str | None = None
    parameters: Mapping[str, str] = field(default_factory=dict)
    variant: str | None = None
    lights: Sequence[str] | None = None
    groups: Mapping[str, Sequence[str]] | None = None
    lights_file: str | None = None
    use_lights_file: bool = True
    only_luminaires: bool = False
    group_alike: bool = True
    integrator: str | None = None
    split: Mapping[str, str] | None = None
    symmetric: Sequence[str] | None = None
    map_size: str | None = None
    lamps: Sequence[str] = ()
    spectral: bool = False
    observer: str | None = None

    @cached_property
    def content(self) -> Scene:
        """The scene, loaded on first use, with luminaires as `with_full_lamps` has them."""
        fields = vars_of(self)
        spectral, observer = fields.pop("spectral"), fields.pop("observer")
        scene = with_full_lamps(load_scene(**fields))
        if not spectral:
            return scene
        return spectral_scene(scene, lighting.constraints_of(scene.requests), observer_of(observer))

    @property
    def read_files(self) -> tuple[Path, ...]:
        """All files of the scene, and the file of its observer."""
        observers = [] if self.observer is None else [Path(self.observer)]
        return (*self.content.read_files, *observers)


@keywords()
@dataclass(frozen=True)
class Painting(ReadOnce):
    """A painting file with the arguments of `read_target`; read once.

    Attributes:
        path: EXR, PNG, TIFF, JPEG or a layered file.
        mask: Picture of the importance of pixels.
        layer: Layer of an EXR.
        transform: View transform that encoded it.
        template: Folder of the template it was painted on.
        find: Whether to look for a template beside it.
        paint: `look` or `light`.

    Examples:
        >>> lp.Painting("painting.exr").content.size
        (16, 16)
    """

    path: str
    mask: str | None = None
    layer: str | None = None
    transform: TransformChoice = field(default_factory=TransformChoice)
    template: str | None = None
    find: bool = True
    paint: Paint = "look"

    @cached_property
    def content(self) -> Target:
        """The target, read on first use."""
        return read_target(**vars_of(self))

    def over(self, look: Floats, name: str) -> Target | None:
        """Return the target if it was painted over that look and nothing else marks the paint.

        look: (h, w, 3) linear, the current look of a basis or light groups called `name`.
        """
        target = self.content
        if not (self.find and target.everything) or self.template or self.paint != "look":
            return None
        return read_over_look(
            Path(self.path), look, name, layer=self.layer, transform=self.transform
        )


@dataclass(frozen=True)
class BasisFile(ReadOnce):
    """A file of a saved basis; read once."""

    path: str

    @cached_property
    def content(self) -> Basis:
        """The basis, read on first use."""
        path = Path(self.path)
        try:
            return read_basis(path)
        except BasisError:
            if not is_light_groups(path):
                raise
            how = " is not a basis: light groups of another renderer are given as "
            raise BasisError(path, how, Hint("light_groups", path.name)) from None


@dataclass(frozen=True)
class GroupsFile(ReadOnce):
    """A file of light groups with the arguments of `read_light_groups`; read once."""

    path: str
    pattern: str | None = None
    leave_out: Sequence[str] = ()

    @cached_property
    def content(self) -> LightGroups:
        """The light groups, read on first use."""
        return read_light_groups(**vars_of(self))


@dataclass(frozen=True)
class PlacementFile(ReadOnce):
    """A file of places of lights; read once."""

    path: str

    @cached_property
    def content(self) -> PlacementRecord:
        """The places, read on first use."""
        return read_placement(Path(self.path))


#: Kinds of files in a job, which can be sent elsewhere.
File = SceneFile | Painting | BasisFile | GroupsFile | PlacementFile


def vars_of(record: Any) -> dict[str, Any]:
    """Return the fields of a dataclass, by name."""
    return {name: getattr(record, name) for name in record.__dataclass_fields__}


def content(source: Any) -> Any:
    """Return the content of a file of a job; return objects in memory, and None, unchanged."""
    return source.content if isinstance(source, File) else source


def check_needed(names: Iterable[str], basis: Any) -> None:
    """Raise BasisError for arguments that are useless with a basis without its scene.

    basis: a saved one, or light groups.
    """
    if not (unused := [Hint(name) for name in names]):
        return
    subject = Sentence.joined(unused)
    if isinstance(basis, LightGroups | GroupsFile):
        raise BasisError(
            subject,
            f" cannot be used with {basis.path}: its light groups are rendered "
            "already, and say nothing of samples, noise, units or emitters in view; leave it out",
        )
    raise BasisError(
        subject,
        " cannot change a saved basis: leave "
        f"{'it' if len(unused) == 1 else 'them'} out, or give the scene",
    )


def check_nothing_unused(settings: Settings, basis: Any) -> None:
    """Raise BasisError for settings without effect, since nothing is rendered.

    basis: a saved one, or light groups.
    """
    names = NOT_IN_GROUPS if isinstance(basis, LightGroups | GroupsFile) else RENDER_SETTINGS
    default = Settings()
    unused_settings = [name for name in names if getattr(settings, name) != getattr(default, name)]
    check_needed(unused_settings, basis)


def observer_of(path: str | None) -> Observer:
    """Return the camera of a table, or the eye without one. Raises ColorError."""
    return EYE if path is None else read_observer(Path(path))


def scaled_constraints(scene: Scene, cd_per_unit: float | None = None) -> lighting.Constraints:
    """Return the constraints of a scene's lights file, with the scale of its lights. cd_per_unit:
    if it is given. Raises ConstraintError.
    """
    constraints = lighting.constraints_of(scene.requests).and_then(
        lighting.Constraints(cd_per_unit=cd_per_unit)
    )
    return lighting.with_scale(constraints, basis_lights(scene))


def lamps_of_scene(
    scene: Scene, constraints: lighting.Constraints
) -> Mapping[str, lighting.FullLamp]:
    """Return the lamps at full, by light. constraints: that make them. Raises ConstraintError."""
    lights = basis_lights(scene)
    return {lights[k].name: x for k, x in lighting.full_lamps(constraints, lights).items()}


def with_full_lamps(scene: Scene) -> Scene:
    """Return a scene whose luminaires are at full as the lights file makes them: all emitters on.

    Luminaires whose level the scene says, as a relit scene does, stay at it; so do all if the
    lights file has a mistake, which whoever solves reports.
    """
    hung = {x.name for x in scene.luminaires if not x.has_own_level}
    names = {x.name for x in scene.lights if not x.is_fixed and hung.issuperset(x.member_names)}
    if not names:
        return scene
    with suppress(ConstraintError):
        lamps = lamps_of_scene(scene, scaled_constraints(scene))
        return scene.with_emission({k: x.emission for k, x in lamps.items() if k in names})
    return scene


def spectral_scene(
    scene: Scene, constraints: lighting.Constraints, observer: Observer = EYE
) -> Scene:
    """Return a scene with a light for each emitter of its lamps, as the observer sees it.

    One that has them already, which looks of a batch share, has to have the spectra of
    `constraints`. Raises SceneError if a light that is adjusted has no emitters with spectra, or
    the scene cannot be rendered with them.
    """
    if scene.is_spectral:
        _check_same_emitters(scene, constraints)
        return scene
    check_renders_spectra(scene)
    return scene.with_lamps(lighting.lamps_by_name(constraints, basis_lights(scene)), observer)


def _check_same_emitters(scene: Scene, constraints: lighting.Constraints) -> None:
    """Raise SceneError if constraints give lamps other spectra than the spectra of a spectral
    scene."""
    lights = lighting.WholeLamps.of(basis_lights(scene)).lights
    lamps = lighting.lamps_by_name(constraints, lights)
    expected = {
        part_name(name, x.name): x.spectrum for name, lamp in lamps.items() for x in lamp.emitters
    }
    rendered = {x.name: x.spectrum for x in scene.lights if not x.is_fixed}
    if changed := sorted(k for k in rendered if rendered[k] != expected.get(k)):
        raise SceneError(
            f"the emitters of a lamp, like {changed[0]!r}, come from the lights file, which "
            "looks with spectra share: give them there, and not for one look"
        )


def check_spectral(settings: Settings, constraints: lighting.Constraints, *others: object) -> None:
    """Raise LightpaintError for what does not go with spectra. others: what moves or adds lights;
    false if there is nothing.
    """
    if not settings.spectral:
        return
    unusable = [name for name in ("suggest", "refine", "animate") if getattr(settings, name)]
    if settings.sun:
        unusable.append("sun")
    if unusable:
        raise LightpaintError(
            Hint("spectral", True), " does not go with ", Hint(unusable[0]), ": leave one out"
        )
    if constraints.start:
        raise LightpaintError(
            Hint("spectral", True), " starts from the scene as it is: leave ", Hint("start"), " out"
        )
    if any(others):
        raise LightpaintError(
            Hint("spectral", True),
            " keeps all lights in place: solve with ",
            Hint("move_lights", False),
        )
