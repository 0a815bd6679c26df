"""Subjects made from files or from objects in memory, and checked before any render."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from lightpaint import lighting
from lightpaint.basis import Basis, LightGroups, Lights
from lightpaint.basis.cache import folder as cache_folder
from lightpaint.basis.cache import open_kept
from lightpaint.colour import TransformChoice, read_observer
from lightpaint.errors import PaintError, SceneError
from lightpaint.files import file_length, scene_name
from lightpaint.paint.layers.layer_files import check_kind
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.paint.subject import LazyScene, Subject, check_view_names, session_identity
from lightpaint.pipeline import BasisFile, GroupsFile, SceneFile, check_nothing_unused, content
from lightpaint.pipeline.job.settings import Settings
from lightpaint.scene import Scene
from lightpaint.scene.lights.lights_file import lights_file_for
from lightpaint.scene.quality_presets import on_film

#: Checks the names of emitters, by light.
CheckLamps = Callable[[Mapping[str, Sequence[str]]], None]

#: Types that can be painted: files, which are read when they are needed, and loaded objects.
Paintable = SceneFile | BasisFile | GroupsFile | Scene | Basis | LightGroups


def make_subjects(
    sources: Sequence[Paintable], folder: Path | None = None, **options: Any
) -> tuple[Subject, ...]:
    """Return the views of one lighting, to be painted together.

    options: parameters of `make_subject`. Raises LightpaintError if the sources cannot be painted,
    alone or together, as far as that is known without rendering.
    """
    subjects = tuple(
        make_subject(source, folder, view_count=len(sources), **options) for source in sources
    )
    if len({subject.scene is None for subject in subjects}) > 1:
        raise PaintError("scenes and bases at once: give one kind for all views")
    if len(subjects) > 1 and any(subject.groups is not None for subject in subjects):
        raise PaintError("light groups have one view only: give bases, or scenes")
    if (identity := session_identity(subjects)) is not None:
        check_view_names([view.sensor for view in identity.views])
    bases = [subject.basis for subject in subjects if subject.basis is not None]
    for basis in bases[1:]:
        lighting.check_same_lights(bases[0], basis)
    return subjects


def make_subject(
    source: Paintable,
    folder: Path | None = None,
    *,
    settings: Settings | None = None,
    constraints: lighting.Constraints | None = None,
    choice: TransformChoice | None = None,
    command: Callable[[Mapping[str, str], SessionRequests], str] = lambda paintings, requests: "",
    view_count: int = 1,
    layers: Path | None = None,
    check_lamps: CheckLamps = lambda _: None,
) -> Subject:
    """Return one view to be painted, checked as far as possible without a renderer.

    folder: by default one that is named after the source. check_lamps: is called with the names of
    emitters by light, as soon as they are known, and raises if these cannot be painted with. The
    others are as in `Subject`. Raises LightpaintError if the source cannot be painted, or its
    lights cannot meet the constraints, and OutputError if there is no folder for its cache.
    """
    settings = settings or Settings()
    constraints = lighting.Constraints() if constraints is None else constraints
    constraints = constraints.and_then(lighting.Constraints(cd_per_unit=settings.cd_per_unit))
    if layers is not None:
        if view_count > 1:
            raise PaintError(f"{layers} has the layers of one view: open that view alone")
        check_kind(layers)
    if isinstance(source, SceneFile | Scene):
        cache_folder()  # raises before anybody opens a page that could show no picture
        scene = _scene_on_film(source, settings, constraints, check_lamps)
        fields: dict[str, Any] = {"scene": scene}
    else:
        check_nothing_unused(settings, source)
        loaded = _kept(source) or content(source)
        basis = loaded.basis if isinstance(loaded, LightGroups) else loaded
        _check_constraints(basis.lights, constraints, settings, check_lamps)
        groups = loaded if isinstance(loaded, LightGroups) else None
        fields = {"basis": basis, "groups": groups}
    name = _name_of(source)
    return Subject(
        source=name,
        folder=Path(f"{scene_name(Path(name))}.paint").absolute() if folder is None else folder,
        settings=settings,
        constraints=constraints,
        choice=choice or TransformChoice(),
        command=command,
        view_count=view_count,
        layers=layers,
        **fields,
    )


def _scene_on_film(
    source: SceneFile | Scene,
    settings: Settings,
    constraints: lighting.Constraints,
    check_lamps: CheckLamps,
) -> Scene | LazyScene:
    """Return a scene on the film of its basis, or one that is loaded when it is needed."""

    def check(scene: Scene) -> None:
        from lightpaint.basis.render import basis_lights

        _check_constraints(basis_lights(scene), constraints, settings, check_lamps)
        if settings.planes is not None:
            from lightpaint.pipeline import check_planes

            check_planes(scene, settings.planes, constraints, settings)

    prepare = partial(_with_spectra, settings=settings, constraints=constraints)
    if isinstance(source, Scene):
        whole = prepare(on_film(source, settings.quality, settings.resolution))
        check(whole)
        return whole
    # Errors that need no renderer are raised before the scene is loaded.
    file_length(Path(source.path), "scene file", SceneError)
    if settings.observer is not None:
        read_observer(Path(settings.observer))
    scene = LazyScene(source, settings, prepare)
    if scene.record is not None:
        _check_constraints(scene.record.lights, constraints, settings, check_lamps)
    else:
        _check_named_lamps(source, check_lamps)
    scene.checks.append(check)
    if settings.planes is not None:  # mistakes in their file show before the painter opens
        _ = scene.scene
    return scene


def _with_spectra(scene: Scene, *, settings: Settings, constraints: lighting.Constraints) -> Scene:
    """Return a scene with a light for each emitter if settings ask for spectra, else as it is.

    Raises LightpaintError if it cannot be rendered with spectra.
    """
    if not settings.spectral:
        return scene
    from lightpaint.pipeline import check_spectral, observer_of, spectral_scene

    every = lighting.constraints_of(scene.requests).and_then(constraints)
    check_spectral(settings, every)
    return spectral_scene(scene, every, observer_of(settings.observer))


def _kept(source: Paintable) -> Basis | None:
    """Return the basis of a file that need not be read to begin; None for all others."""
    return open_kept(Path(source.path)) if isinstance(source, BasisFile) else None


def _check_constraints(
    lights: Lights, constraints: lighting.Constraints, settings: Settings, check_lamps: CheckLamps
) -> None:
    """Raise ConstraintError unless lights can meet these constraints and their lights file's, and
    have the power that a limit in the settings needs.
    """
    all_constraints = lighting.constraints_of(lights.requests).and_then(constraints)
    # Of planes it is known after a measurement which lights reach them.
    scaled = lighting.with_sure_scale if settings.planes is None else lighting.with_scale
    reduction = lighting.reduce_to(scaled(all_constraints, lights), lights)
    check_lamps({lights[k].name: lamp.names for k, lamp in reduction.lamps.items()})
    if settings.watts is not None:
        lighting.check_powers(reduction, [light.name for light in lights], "a limit of power")


def _check_named_lamps(source: SceneFile, check_lamps: CheckLamps) -> None:
    """Check the lamps that the lights file of a scene names, before the scene is loaded; lamps of
    patterns are known only then.
    """
    file = lights_file_for(
        Path(source.path), source.lights_file, beside_scene=source.use_lights_file
    )
    named = {
        name: [x.name for x in lighting.LightConstraint.of(table, where=where).emitters]
        for name, table, where in lighting.constraints_of(file.requests).lights
        if "emitters" in table
    }
    if named and not any(lighting.is_pattern(name) for name in named):
        check_lamps(named)


def _name_of(source: Paintable) -> str:
    """Return the path of a source, as given or as stored in the object."""
    if isinstance(source, Basis):
        return source.source or source.origin.scene
    return str(source.path)
