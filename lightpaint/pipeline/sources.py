"""What a job is made of, by file: a scene, a painting, a saved basis, light groups.

Each is plain values that can be sent, and is read once, when it is first asked for.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Self

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.file import read_basis
from lightpaint.basis.lightgroups.read import LightGroups, read_light_groups
from lightpaint.colour.display.view_transform import TransformChoice
from lightpaint.errors import BasisError
from lightpaint.keywords import keywords
from lightpaint.pipeline.settings import Settings
from lightpaint.scene.scene import Scene, load_scene
from lightpaint.target.target import Target
from lightpaint.target.target_reader import Paint, read_over_look, read_target

#: Settings that only change what is rendered, and those that light groups know nothing of.
SAMPLED = ("spp", "exact_spp", "time_s", "quality", "resolution")
RENDERED = (*SAMPLED, "refine", "suggest", "verify_spp")
NOT_IN_GROUPS = (*RENDERED, "seed", "noise_correction", "cd_per_unit", "emitters")


class ReadOnce:
    """A file by plain values, whose content is read when it is first asked for, and kept.

    What was read stays in this process: a copy that is sent elsewhere reads the file there.
    """

    def unread(self) -> Self:
        """Return the same file, of which nothing is read or kept yet."""
        return type(self)(**vars_of(self))

    def __getstate__(self) -> dict[str, Any]:
        return vars_of(self)

    def __setstate__(self, fields: dict[str, Any]) -> None:
        vars(self).update(fields)


@keywords()
@dataclass(frozen=True)
class SceneFile(ReadOnce):
    """A scene by its file, as `load_scene` takes it; loaded once, when it is first asked for.

    Attributes:
        path: Mitsuba XML.
        sensor: Index or id of the sensor.
        parameters: Values of the `$name` parameters.
        variant: Mitsuba variant.
        lights: Names or patterns of the lights to adjust.
        groups: Emitters that are one light, by its name.
        lights_file: TOML to read instead of the one beside the scene.
        use_lights_file: False leaves that one alone.
        group_alike: False adjusts emitters that are alike and without names one by one.
        integrator: To render with instead of the scene's own.

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
    group_alike: bool = True
    integrator: str | None = None

    @cached_property
    def content(self) -> Scene:
        """The scene, as it is when it is first asked for."""
        return load_scene(**vars_of(self))


@keywords()
@dataclass(frozen=True)
class Painting(ReadOnce):
    """A painting by its file, as `read_target` takes it; read once.

    Attributes:
        path: EXR, PNG, TIFF, JPEG or a layered file.
        mask: Picture of what counts.
        layer: Of an EXR.
        transform: What it was encoded by.
        template: Folder of the template it was painted on.
        find: Whether one is looked for beside it.
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
        """The target, as it is when it is first asked for."""
        return read_target(**vars_of(self))

    def over(self, look: Floats, name: str) -> Target | None:
        """The target, if it was painted over that look and nothing else says what counts.

        look: (h, w, 3) linear, what a basis or light groups called `name` show as they are.
        """
        target = self.content
        if not (self.find and target.everything) or self.template or self.paint != "look":
            return None
        return read_over_look(
            Path(self.path), look, name, layer=self.layer, transform=self.transform
        )


@dataclass(frozen=True)
class BasisFile(ReadOnce):
    """A saved basis; read once."""

    path: str

    @cached_property
    def content(self) -> Basis:
        """The basis, as it is when it is first asked for."""
        return read_basis(Path(self.path))


@dataclass(frozen=True)
class GroupsFile(ReadOnce):
    """Light groups of another renderer, as `read_light_groups` takes them; read once."""

    path: str
    pattern: str | None = None
    leave_out: Sequence[str] = ()

    @cached_property
    def content(self) -> LightGroups:
        """The light groups, as they are when they are first asked for."""
        return read_light_groups(**vars_of(self))


#: What of a job can be sent.
File = SceneFile | Painting | BasisFile | GroupsFile


def vars_of(given: Any) -> dict[str, Any]:
    """What a dataclass holds, by name."""
    return {name: getattr(given, name) for name in given.__dataclass_fields__}


def content(given: Any) -> Any:
    """What is in a file that a job names; what is in memory already, and None, as it is."""
    return given.content if isinstance(given, File) else given


def check_needed(given: Iterable[str], basis: Any) -> None:
    """Raise BasisError for anything `given`, by name, that a basis without its scene has no use of.

    basis: a saved one, or light groups.
    """
    if not (idle := [f"{name}=..." for name in given]):
        return
    if isinstance(basis, LightGroups | GroupsFile):
        raise BasisError(
            f"{', '.join(idle)} cannot be used with {basis.path}: its light groups are rendered "
            "already, and say nothing of samples, noise, units or emitters in view; leave it out"
        )
    raise BasisError(
        f"{', '.join(idle)} cannot change a saved basis: leave "
        f"{'it' if len(idle) == 1 else 'them'} out, or give the scene"
    )


def check_nothing_idle(settings: Settings, basis: Any) -> None:
    """Raise BasisError for settings that change nothing, since nothing is rendered.

    basis: a saved one, or light groups.
    """
    names = NOT_IN_GROUPS if isinstance(basis, LightGroups | GroupsFile) else RENDERED
    default = Settings()
    idle = [name for name in names if getattr(settings, name) != getattr(default, name)]
    check_needed(idle, basis)
