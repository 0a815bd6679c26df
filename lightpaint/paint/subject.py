"""What is painted: a scene, a saved basis, or light groups; and how its lights come to be known."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from lightpaint.basis import cache
from lightpaint.basis.basis import Basis
from lightpaint.basis.lightgroups.read import LightGroups
from lightpaint.colour.display import choose_exposure
from lightpaint.colour.transform import TransformChoice, ViewTransform
from lightpaint.files import called
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.paint.wishes import Wishes
from lightpaint.pipeline import obtain
from lightpaint.progress import Progress, silent
from lightpaint.scene.quality import samples
from lightpaint.scene.scene import Scene
from lightpaint.settings import Settings

#: Samples per pixel after which a basis that is still being rendered is shown, and shown again.
FIRST = (2, 8, 32, 128)


@dataclass(frozen=True)
class Subject:
    """One view to be painted.

    source: as it was named, for people and for command lines. scene: on the film of the basis;
    None without a renderer. basis: where there is one already, as of light groups. settings,
    constraints: how paintings are answered. choice: of a view transform, to paint through. folder:
    receives what is exported. command: that answers an exported painting, by its path, as a session
    does in which this is wished; "" where there are no commands.
    """

    source: str
    folder: Path
    scene: Scene | None = None
    basis: Basis | None = None
    groups: LightGroups | None = None
    settings: Settings = field(default_factory=Settings)
    constraints: Constraints = field(default_factory=Constraints)
    choice: TransformChoice = field(default_factory=TransformChoice)
    command: Callable[[str, Wishes], str] = lambda painting, wishes: ""

    @property
    def name(self) -> str:
        """What it is called, for people."""
        return called(Path(self.source))

    @property
    def wanted(self) -> int | None:
        """Samples per pixel that its basis is to have; None where that is not asked here."""
        if self.scene is None:
            return None
        settings = self.settings
        asked = samples(settings.quality, spp=settings.spp, time_s=settings.time_s)
        return asked or self.scene.spp

    def bases(self, progress: Progress = silent) -> Iterator[Basis]:
        """Its basis; where it is still to be rendered, first ones of few samples."""
        if self.basis is not None:
            yield self.basis
            return
        assert self.scene is not None
        scene, settings, wanted = self.scene, self.settings, self.wanted or 1
        sensor = scene.sensor_names[scene.sensor]
        kept = cache.find(scene.identity, sensor, settings.seed, scene.size)
        has = 0 if kept is None or not settings.use_cache else kept.origin.spp
        if settings.use_cache and settings.time_s is None:
            for spp in FIRST:
                if has < spp < wanted:
                    yield self._obtained(spp, progress)
        yield obtain(scene, settings, progress).asking(scene.asked)

    def _obtained(self, spp: int, progress: Progress) -> Basis:
        from lightpaint.basis.render.obtain import obtain_basis

        assert self.scene is not None
        basis = obtain_basis(self.scene, spp=spp, seed=self.settings.seed, progress=progress)
        return basis.asking(self.scene.asked)

    def transform(self, basis: Basis) -> ViewTransform:
        """What it is painted through: as asked, else sRGB at an exposure that shows something."""
        stops = choose_exposure(basis.present_look)
        return self.choice.over(ViewTransform("srgb", stops))
