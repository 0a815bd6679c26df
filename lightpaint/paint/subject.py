"""What is painted: a scene, a saved basis, or light groups; and how its lights come to be known."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from lightpaint.basis import cache
from lightpaint.basis.basis import Basis, meter_exposure
from lightpaint.basis.known import Known
from lightpaint.basis.lightgroups.read import LightGroups
from lightpaint.colour.display.view_transform import TransformChoice, ViewTransform
from lightpaint.files import called
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.paint.lazy_scene import Opening
from lightpaint.paint.store.light_requests import Wishes
from lightpaint.pipeline.settings import Settings
from lightpaint.progress import Progress, silent
from lightpaint.scene.presets import samples
from lightpaint.scene.scene import Scene

#: Samples per pixel after which a basis that is still being rendered is shown, and shown again.
FIRST = (2, 8, 32, 128)


@dataclass(frozen=True)
class Subject:
    """One view to be painted, alone or among others.

    source: as it was named, for people and for command lines. scene: on the film of the basis, or
    one that is loaded when it is needed; None without a renderer. basis: where there is one
    already, as of light groups. settings, constraints: how paintings are answered. choice: of a
    view transform, to paint through. folder: receives what is exported. command: that answers
    exported paintings as a session does in which this is wished; their paths by sensor, "" for that
    of the only view; "" where there are no commands. among: how many views the time is for in which
    bases are rendered.
    """

    source: str
    folder: Path
    scene: Scene | Opening | None = None
    basis: Basis | None = None
    groups: LightGroups | None = None
    settings: Settings = field(default_factory=Settings)
    constraints: Constraints = field(default_factory=Constraints)
    choice: TransformChoice = field(default_factory=TransformChoice)
    command: Callable[[Mapping[str, str], Wishes], str] = lambda paintings, wishes: ""
    among: int = 1

    @property
    def name(self) -> str:
        """What it is called, for people."""
        return called(Path(self.source))

    @property
    def loaded(self) -> Scene:
        """Its scene, which it has; loaded if it is not yet. Raises LightpaintError."""
        assert self.scene is not None
        return self.scene.scene if isinstance(self.scene, Opening) else self.scene

    @property
    def known(self) -> Known | None:
        """What is known of a scene that need not be loaded for it."""
        return self.scene.known if isinstance(self.scene, Opening) else None

    @property
    def sensor(self) -> str:
        """That it is seen through."""
        if self.basis is not None:
            return self.basis.origin.sensor
        return self.known.sensor if self.known is not None else sensor_of(self.loaded)

    @property
    def wanted(self) -> int | None:
        """Samples per pixel that its basis is to have; None where that is not asked here."""
        if self.scene is None:
            return None
        settings = self.settings
        asked = samples(settings.quality, spp=settings.spp, time_s=settings.time_s)
        return asked or (self.known or self.loaded).spp

    def prepare(self) -> None:
        """Load a scene of which nothing is known, so that what is wrong with it is said at once."""
        if self.scene is not None and self.known is None:
            _ = self.loaded

    def bases(self, progress: Progress = silent) -> Iterator[Basis]:
        """Its basis; where it is still to be rendered, first ones of few samples."""
        if self.basis is not None:
            yield self.basis
            return
        if (kept := self._kept()) is not None:
            yield kept
            return
        # What renders is not needed for a basis that is there.
        from lightpaint.pipeline.pipeline import obtain

        scene, settings, wanted = self.loaded, self.settings, self.wanted or 1
        kept = cache.find(scene.identity, sensor_of(scene), settings.seed, scene.size)
        has = 0 if kept is None or not settings.use_cache else kept.origin.spp
        if settings.use_cache and settings.time_s is None:
            for spp in FIRST:
                if has < spp < wanted:
                    hears = in_samples(progress, has, spp, wanted, lights=len(scene.lights))
                    yield self._obtained(spp, hears)
                    has = spp
            has = min(has, wanted)
            progress = in_samples(progress, has, wanted, wanted, lights=len(scene.lights))
        basis = obtain(scene, settings, progress, views=self.among)
        if isinstance(self.scene, Opening):
            self.scene.remember(basis)
        yield basis.with_requests(scene.requests)

    def _kept(self) -> Basis | None:
        """The basis of a scene that is known, if all of it is kept."""
        known, settings = self.known, self.settings
        if known is None or settings.time_s is not None or settings.exact_spp:
            return None
        kept = cache.find(known.identity, known.sensor, settings.seed, known.size)
        names = tuple(light.name for light in known.lights)
        if kept is None or kept.names != names or kept.origin.spp < (self.wanted or 1):
            return None
        if kept.features is None or kept.objects is None:  # by an earlier version
            return None
        return replace(kept, lights=known.lights)

    def _obtained(self, spp: int, progress: Progress) -> Basis:
        from lightpaint.basis.render.obtain import obtain_basis

        scene = self.loaded
        basis = obtain_basis(scene, spp=spp, seed=self.settings.seed, progress=progress)
        return basis.with_requests(scene.requests)


def in_samples(progress: Progress, has: int, spp: int, wanted: int, *, lights: int) -> Progress:
    """A listener to passes, of which `progress` hears as samples per pixel of all that are wanted.

    has: how many there are when the passes begin. spp: how many at their end. lights: of the scene;
    where each is rendered alone, passes are those of one light, whose label is its own.
    """
    labels: dict[str, int] = {}

    def hear(label: str, done: int, total: int, unit: str = "passes") -> None:
        before = labels.setdefault(label, len(labels))
        if unit == "passes":
            parts = lights if ":" in label else 1
            share = min((before + done / max(total, 1)) / parts, 1)
            progress("basis", has + round((spp - has) * share), wanted, "samples per pixel")
        else:
            progress(label, done, total, unit)

    return hear


def together(progress: Progress, count: int) -> list[Progress]:
    """Listeners to parts of one work, of which `progress` hears as one.

    A part that has said nothing yet is taken to be as large as those that have.
    """
    heard: dict[int, tuple[int, int]] = {}

    def listener(part: int) -> Progress:
        def hear(label: str, done: int, total: int, unit: str = "passes") -> None:
            heard[part] = done, total
            sums = [sum(each) for each in zip(*heard.values(), strict=True)]
            progress(label, sums[0], sums[1] * count // len(heard), unit)

        return hear

    return [listener(part) for part in range(count)]


def bases_of(subjects: Sequence[Subject], progress: Progress = silent) -> Iterator[list[Basis]]:
    """Bases of several views; where they are still to be rendered, all of few samples first."""
    for subject in subjects:
        subject.prepare()
    parts = together(progress, len(subjects))
    each = [subject.bases(part) for subject, part in zip(subjects, parts, strict=True)]
    found = [next(bases) for bases in each]
    yield list(found)
    while True:
        more = [next(bases, None) for bases in each]
        if all(basis is None for basis in more):
            return
        found = [basis or before for basis, before in zip(more, found, strict=True)]
        yield list(found)


def transform_of(subjects: Sequence[Subject], bases: Sequence[Basis]) -> ViewTransform:
    """What is painted through: as asked, else sRGB at an exposure that shows something of all."""
    looks = [basis.present_look for basis in bases]
    whole = looks[0] if len(looks) == 1 else np.concatenate([x.reshape(1, -1, 3) for x in looks], 1)
    return subjects[0].choice.over(ViewTransform("srgb", meter_exposure(whole, *bases)))


def sensor_of(scene: Scene | Known) -> str:
    """The name of the sensor that it is seen through."""
    return scene.sensor if isinstance(scene, Known) else scene.sensor_names[scene.sensor]


def painting_of(folder: Path, sensor: str) -> Path:
    """Where the painting of a view goes among exports. sensor: "" of the only one."""
    return folder / (f"painting-{sensor}.exr" if sensor else "painting.exr")


def picture_of(folder: Path, sensor: str) -> Path:
    """Where the answer in a view goes, as it is seen. sensor: "" of the only one."""
    return folder / (f"answer-{sensor}.png" if sensor else "answer.png")
