"""A scene that is loaded on first use; until then the cache has its facts."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Lock
from typing import Any

from lightpaint.basis.basis import Basis
from lightpaint.basis.cache import scene_facts
from lightpaint.basis.cache.scene_facts import SceneFacts
from lightpaint.errors import PaintError
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import SceneFile, vars_of
from lightpaint.scene.scene import Scene


@dataclass
class LazyScene:
    """A scene by its file.

    checks: called with the scene once it is loaded; they raise if it cannot be painted. remarks:
    for the user; the cache keeps them for the next session.
    """

    file: SceneFile
    settings: Settings
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
        film = {"quality": self.settings.quality, "resolution": self.settings.resolution}
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

    def _load(self) -> Scene:
        # Imported here: the first scene loads the renderer.
        from lightpaint.scene.quality_presets import on_film

        self._began_s, self._clock_s = time.time(), _clock_s()
        scene = on_film(self.file.content, self.settings.quality, self.settings.resolution)
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
