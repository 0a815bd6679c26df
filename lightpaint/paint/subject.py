"""The subject of a painting: a scene, a saved basis, or light groups, with basis and identity."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from threading import Lock
from typing import Any, TypeVar

import numpy as np

from lightpaint.basis import Basis, LightGroups, Lights, meter_exposure
from lightpaint.basis.cache import SceneFacts, basis_cache, find_opening, scene_facts
from lightpaint.colour import TransformChoice, ViewTransform, read_observer
from lightpaint.errors import PaintError
from lightpaint.files import scene_name
from lightpaint.lighting import Constraints
from lightpaint.paint.layers.layer_files import read_layers
from lightpaint.paint.store.history_steps import Identity, ViewIdentity
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.pipeline import SceneFile, vars_of
from lightpaint.pipeline.job.settings import Settings
from lightpaint.placement import rigging_of
from lightpaint.progress import Progress, silent
from lightpaint.scene import Scene
from lightpaint.scene.quality_presets import samples

_View = TypeVar("_View")

#: Samples per pixel after which a basis that is still being rendered is shown, and shown again.
PREVIEW_SPP = (2, 8, 32, 128)


@dataclass
class LazyScene:
    """A scene by its file.

    prepare: returns the scene that is rendered, from the one on its film. checks: called with it
    once it is loaded; they raise if it cannot be painted. remarks: for the user; the cache keeps
    them for the next session.
    """

    file: SceneFile
    settings: Settings
    prepare: Callable[[Scene], Scene] = lambda scene: scene
    checks: list[Callable[[Scene], None]] = field(default_factory=list)
    remarks: tuple[str, ...] = ()
    _key: str = ""
    _scene: Scene | None = None
    _began_s: float = 0.0
    _clock_s: float = 0.0
    _lock: Any = field(default_factory=Lock)

    def __post_init__(self) -> None:
        self.record: SceneFacts | None = None
        if self.settings.use_cache:
            self._key = scene_facts.facts_key(self._cache_fields)
            self.record = scene_facts.recall_facts(self._key)
        if self.record is not None:
            self.remarks = self.record.remarks

    @property
    def _cache_fields(self) -> dict[str, Any]:
        """Arguments of loading, and of the film."""
        file = {name: value for name, value in vars_of(self.file).items() if value is not None}
        names = {key: list(members) for key, members in (file.get("groups") or {}).items()}
        lights = {"lights": list(file["lights"])} if "lights" in file else {}
        kept = ("quality", "resolution", "spectral")
        film = {name: getattr(self.settings, name) for name in kept}
        if self.settings.observer is not None:
            film["observer"] = asdict(read_observer(Path(self.settings.observer)))
        parameters = {key: str(value) for key, value in self.file.parameters.items()}
        return {**file, **lights, **film, "groups": names, "parameters": parameters}

    @property
    def scene(self) -> Scene:
        """Scene on the film of the basis, loaded when it is first needed, by whichever thread.

        Raises LightpaintError for a scene that cannot be painted, or that differs from the cached
        facts.
        """
        with self._lock:
            if self._scene is None:
                self._scene = self._load()
            return self._scene

    def when_loaded(self, check: Callable[[Scene], None]) -> None:
        """Call `check` with the scene once it is loaded; at once if it is."""
        with self._lock:
            self.checks.append(check)
            if self._scene is not None:
                check(self._scene)

    def _load(self) -> Scene:
        # Imported here: the first scene loads the renderer.
        from lightpaint.scene.quality_presets import on_film

        self._began_s, self._clock_s = time.time(), _clock_s()
        scene = on_film(self.file.content, self.settings.quality, self.settings.resolution)
        scene = self.prepare(scene)
        if self.record is not None and self.record.identity != scene.identity:
            raise PaintError(
                f"{self.file.path} is not what it was when this session was opened: its files have "
                "changed since; start the painter again"
            )
        for check in self.checks:
            check(scene)
        return scene

    def remember(self, basis: Basis) -> None:
        """Cache facts that let the next session begin without loading. basis: the cached one."""
        if abs(_clock_s() - self._clock_s) > scene_facts.COARSE_S / 2:
            return  # the clock was set, so file times are unreliable
        if self.record is None and self._scene is not None and self.settings.use_cache:
            scene_facts.remember_facts(
                self._key, self._scene, basis, remarks=self.remarks, began_s=self._began_s
            )


def _clock_s() -> float:
    """Return the seconds by which the clock is ahead of the monotonic one."""
    return time.time() - time.monotonic()


@dataclass(frozen=True)
class Subject:
    """A view to paint, alone or among others.

    source: the given path, for messages and commands. scene: on the film of the basis, or a lazy
    one; None without a renderer. basis: set if it exists already, as for light groups. settings,
    constraints: of the solve. choice: the view transform to paint through. folder: receives
    exports. command: returns the command that solves exported paintings, given by sensor ("" for
    the only view), with the session's requests; "" if there is none. view_count: number of views
    that share the time budget of the bases. layers: file of layers with which to begin, as a step.
    """

    source: str
    folder: Path
    scene: Scene | LazyScene | None = None
    basis: Basis | None = None
    groups: LightGroups | None = None
    settings: Settings = field(default_factory=Settings)
    constraints: Constraints = field(default_factory=Constraints)
    choice: TransformChoice = field(default_factory=TransformChoice)
    command: Callable[[Mapping[str, str], SessionRequests], str] = lambda paintings, requests: ""
    view_count: int = 1
    layers: Path | None = None

    @property
    def name(self) -> str:
        """Name in messages."""
        return scene_name(Path(self.source))

    @property
    def loaded_scene(self) -> Scene:
        """The scene, loaded if it is not yet. Raises LightpaintError."""
        assert self.scene is not None
        return self.scene.scene if isinstance(self.scene, LazyScene) else self.scene

    @property
    def record(self) -> SceneFacts | None:
        """Cached facts of a scene that need not be loaded for them."""
        return self.scene.record if isinstance(self.scene, LazyScene) else None

    @property
    def lets_lights_move(self) -> bool:
        """True if the lights file lets lights move, so that a solve searches for their places."""
        if self.scene is None:
            return False
        record = self.record
        return bool(rigging_of((record.lights if record else self.loaded_scene).requests))

    @property
    def sensor(self) -> str:
        """Name of the sensor."""
        if self.basis is not None:
            return self.basis.origin.sensor
        return self.record.sensor if self.record is not None else sensor_name(self.loaded_scene)

    @property
    def target_spp(self) -> int | None:
        """Samples per pixel that its basis will have; None if it is not rendered here."""
        if self.scene is None:
            return None
        settings = self.settings
        requested = samples(settings.quality, spp=settings.spp, time_s=settings.time_s)
        return requested or (self.record or self.loaded_scene).spp

    def prepare(self) -> None:
        """Load a scene without cached facts, so that its errors show at once."""
        if self.scene is not None and self.record is None:
            _ = self.loaded_scene

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) of the view."""
        return (self.basis or self.record or self.loaded_scene).size

    def check_files(self) -> None:
        """Load a scene without cached facts, and read the file of layers, so that mistakes show.

        Raises LightpaintError if the view cannot be painted, or not with these layers.
        """
        self.prepare()
        if self.layers is not None:
            # Which transform it is painted through is known with its basis, and refuses nothing.
            read_layers(self.layers, self.size, ViewTransform("srgb"))

    def bases(self, progress: Progress = silent) -> Iterator[Basis]:
        """Yield its basis; one that is still to be rendered follows a picture of the scene as it
        is, whose lights are unknown (`Origin.is_plain_look`), and previews of few samples.
        """
        if self.basis is not None:
            yield self.basis
            return
        if (cached := self._cached_basis()) is not None:
            yield cached
            return
        # Imported here: a basis that exists needs no renderer.
        from lightpaint.pipeline import obtain

        # Further samples for an error follow the paint.
        settings = replace(self.settings, error=None)
        scene, target_spp = self.loaded_scene, self.target_spp or 1
        if (opened := self._opened_basis(scene)) is not None:
            if isinstance(self.scene, LazyScene):
                self.scene.remember(opened)
            yield opened
            return
        of_scene = scene.identity, sensor_name(scene), settings.seed, scene.size
        done_spp = basis_cache.cached_spp(*of_scene) if settings.use_cache else 0
        if settings.time_s is None and not done_spp:
            yield self._plain_look(progress)
        if settings.use_cache and settings.time_s is None:
            for spp in PREVIEW_SPP:
                if done_spp < spp < target_spp:
                    report = progress_in_samples(
                        progress, done_spp, spp, target_spp, lights=len(scene.lights)
                    )
                    yield self._obtain_at(spp, report)
                    done_spp = spp
            done_spp = min(done_spp, target_spp)
            progress = progress_in_samples(
                progress, done_spp, target_spp, target_spp, lights=len(scene.lights)
            )
        basis = obtain(scene, settings, progress, views=self.view_count)
        if isinstance(self.scene, LazyScene):
            self.scene.remember(basis)
        yield basis.with_requests(scene.requests)

    def _cached_basis(self) -> Basis | None:
        """Return the basis of a scene with cached facts, if all of it is cached."""
        record, settings = self.record, self.settings
        if record is None or settings.time_s is not None or settings.exact_spp:
            return None
        of_scene = record.identity, record.sensor, settings.seed, record.size
        cached = find_opening(*of_scene) or basis_cache.find(*of_scene)
        return self._with_lights(cached, record.lights)

    def _opened_basis(self, scene: Scene) -> Basis | None:
        """Return the basis of a scene if all of it is cached and need not be read to begin."""
        settings = self.settings
        if not settings.use_cache or settings.time_s is not None or settings.exact_spp:
            return None
        from lightpaint.basis.render import basis_lights

        opened = find_opening(scene.identity, sensor_name(scene), settings.seed, scene.size)
        return self._with_lights(opened, basis_lights(scene))

    def _with_lights(self, cached: Basis | None, lights: Lights) -> Basis | None:
        """Return a cached basis with `lights`; None if it lacks something."""
        if cached is None or cached.names != lights.names:
            return None
        if cached.origin.spp < (self.target_spp or 1):
            return None
        if cached.features is None or cached.objects is None:  # an earlier version wrote it
            return None
        return replace(cached, lights=lights)

    def _plain_look(self, progress: Progress) -> Basis:
        """Return a picture of the scene as it is, which is there before its lights are."""
        from lightpaint.basis.render import render_plain_look

        def report() -> None:
            progress("basis", 0, self.target_spp or 1, "samples per pixel")

        report()
        scene, seed = self.loaded_scene, self.settings.seed
        return render_plain_look(scene, seed=seed, between=report)

    def _obtain_at(self, spp: int, progress: Progress) -> Basis:
        from lightpaint.basis.cache import obtain_basis

        scene = self.loaded_scene
        basis = obtain_basis(
            scene, spp=spp, seed=self.settings.seed, is_final=False, progress=progress
        )
        return basis.with_requests(scene.requests)


def progress_in_samples(
    progress: Progress, done_spp: int, spp: int, target_spp: int, *, lights: int
) -> Progress:
    """Return a listener to passes that reports them as samples per pixel of the whole basis.

    done_spp: samples when the passes begin. spp: samples at their end. lights: of the scene; where
    each light is rendered alone, its passes carry its own label.
    """
    labels: dict[str, int] = {}

    def hear(label: str, done: int, total: int, unit: str = "passes") -> None:
        index = labels.setdefault(label, len(labels))
        if unit == "passes":
            parts = lights if ":" in label else 1
            share = min((index + done / max(total, 1)) / parts, 1)
            progress(
                "basis", done_spp + round((spp - done_spp) * share), target_spp, "samples per pixel"
            )
        else:
            progress(label, done, total, unit)

    return hear


def joint_progress(progress: Progress, count: int) -> list[Progress]:
    """Return listeners to the parts of one task, which report to `progress` as one.

    A part that has not reported yet counts as much as the mean of the others.
    """
    states: dict[int, tuple[int, int]] = {}

    def listener(part: int) -> Progress:
        def hear(label: str, done: int, total: int, unit: str = "passes") -> None:
            states[part] = done, total
            sums = [sum(values) for values in zip(*states.values(), strict=True)]
            progress(label, sums[0], sums[1] * count // len(states), unit)

        return hear

    return [listener(part) for part in range(count)]


def obtain_bases(subjects: Sequence[Subject], progress: Progress = silent) -> Iterator[list[Basis]]:
    """Yield the bases of several views; previews of all come first if they must be rendered."""
    for subject in subjects:
        subject.prepare()
    parts = joint_progress(progress, len(subjects))
    streams = [subject.bases(part) for subject, part in zip(subjects, parts, strict=True)]
    current = [next(bases) for bases in streams]
    yield list(current)
    while True:
        improved = [next(bases, None) for bases in streams]
        if all(basis is None for basis in improved):
            return
        current = [
            basis or current_basis for basis, current_basis in zip(improved, current, strict=True)
        ]
        yield list(current)


def painting_transform(subjects: Sequence[Subject], bases: Sequence[Basis]) -> ViewTransform:
    """Return the chosen transform to paint through, or sRGB at an exposure that suits all views."""
    looks = [basis.current_look for basis in bases]
    whole = looks[0] if len(looks) == 1 else np.concatenate([x.reshape(1, -1, 3) for x in looks], 1)
    return subjects[0].choice.over(ViewTransform("srgb", meter_exposure(whole, *bases)))


def sensor_name(scene: Scene | SceneFacts) -> str:
    """Return the name of the sensor that a scene is seen through."""
    return scene.sensor if isinstance(scene, SceneFacts) else scene.sensor_names[scene.sensor]


def view_at(views: Sequence[_View], number: int) -> _View:
    """Return what belongs to a view, from 0 on. Raises PaintError if there is no such view."""
    if number >= len(views):
        raise PaintError(f"no view {number}: there are {len(views)}")
    return views[number]


def painting_path(folder: Path, sensor: str) -> Path:
    """Return the export path of a view's painting. sensor: "" for the only view."""
    return folder / (f"painting-{sensor}.exr" if sensor else "painting.exr")


def layers_paths(folder: Path, sensor: str) -> tuple[Path, Path]:
    """Return the export paths of a view's layers. sensor: "" for the only view."""
    name = f"layers-{sensor}" if sensor else "layers"
    return folder / f"{name}.exr", folder / f"{name}.ora"


def places_path(folder: Path) -> Path:
    """Return the export path of the places of moved and added lights."""
    return folder / "places.json"


def picture_path(folder: Path, sensor: str) -> Path:
    """Return the export path of the answer's picture in a view. sensor: "" for the only view."""
    return folder / (f"answer-{sensor}.png" if sensor else "answer.png")


def session_identity(
    subjects: Sequence[Subject], loaded: Mapping[int, Scene] | None = None
) -> Identity | None:
    """Return the identity of a session; None while a scene still has to be loaded for it.

    loaded: scenes that have been loaded, by view. A scene has the same identity as its later basis.
    """
    bases = [subject.basis for subject in subjects if subject.basis is not None]
    if bases:
        return Identity.of(bases)
    records = []
    for k, subject in enumerate(subjects):
        scene = subject.loaded_scene if not isinstance(subject.scene, LazyScene) else None
        record = subject.record or scene or (loaded or {}).get(k)
        if record is None:
            return None
        records.append(record)
    first = records[0]
    names = tuple(light.name for light in first.lights)
    views = tuple(ViewIdentity(sensor_name(record), record.size) for record in records)
    return Identity(Path(first.path).name, first.identity, names, views)


def check_view_names(sensors: Sequence[str]) -> None:
    """Raise PaintError unless several views have distinct names that are valid names of folders."""
    if len(sensors) > 1:
        from lightpaint.pipeline import checked_names

        checked_names([*sensors], PaintError)
