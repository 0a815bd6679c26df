"""The views of a job: their scenes, bases and paintings, brought to one size."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from lightpaint.arrays import Bools
from lightpaint.basis.basis import Basis
from lightpaint.basis.lightgroups.light_groups import LightGroups
from lightpaint.errors import TargetError
from lightpaint.images.pixel_blocks import whole_factor
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import Painting
from lightpaint.pipeline.results.results import checked_names, view_names
from lightpaint.scene.quality_presets import on_film
from lightpaint.scene.scene import Scene
from lightpaint.target.target import Target


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


def names_of_views(
    scenes: Sequence[Scene], bases: Sequence[Basis], groups: Sequence[LightGroups]
) -> list[str]:
    """Return the name of each view, after which its folder is named: its sensor, or its file.

    groups: the light groups of the bases, if they are those of another renderer.
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
    """Return the resolution in the settings, else that of a smaller painted template."""
    if settings.quality is not None or settings.resolution is not None or settings.resize:
        return settings.resolution
    factor = whole_factor(scene.size, target.size)
    return f"1/{factor}" if target.content and factor and factor > 1 else None


def check_target(target: object) -> None:
    """Raise TargetError for anything but a target."""
    if not isinstance(target, Target):
        raise TargetError(f"the target is a {type(target).__name__}: pass what read_target returns")


def check_same_picture(target: Target, scene: Scene) -> None:
    """Raise TargetError if the painting's sensor is not that of `scene`."""
    sensor = scene.sensor_names[scene.sensor]
    if target.sensor not in ("", sensor):
        raise TargetError(
            f"{target.name} was painted on a template of the sensor {target.sensor}, not of "
            f"{sensor}: choose it with sensor={target.sensor!r}, or pass find=False"
        )
