"""A studio of the test room, whose lights tests move and add."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from patience import PATIENCE_S
from renderer import write_room

from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.paint import protocol
from lightpaint.paint.protocol import Message
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.studio.session_studio import Studio
from lightpaint.paint.subject import Subject
from lightpaint.pipeline.job.settings import Settings
from lightpaint.placement.free_space import pixels_of
from lightpaint.scene.scene_reader import load_scene


class MovingStudio:
    """A studio of the test room, and all that it says."""

    def __init__(
        self,
        folder: Path,
        lights: str | None = None,
        settings: Settings | None = None,
        constraints: Constraints | None = None,
        *,
        subject: Subject | None = None,
    ) -> None:
        self.folder = folder
        if subject is None:
            path = folder / "room.xml"
            scene = load_scene(path if path.exists() else write_room(folder, lights=lights))
            settings = settings or Settings(spp=16, use_cache=False)
            constraints = Constraints() if constraints is None else constraints
            subject = Subject("room", folder, scene, settings=settings, constraints=constraints)
        self.scene = subject.loaded_scene
        self.messages: list[Message] = []
        self.studio = Studio(
            [subject], lambda identity: Store.open(folder / "session.db", identity)
        )
        self.studio.on_message = self.messages.append
        self.studio.start()
        self.wait(lambda: self.studio.is_ready)
        self.wait(
            lambda: any(m.kind == "state" and m.fields["basis"]["spp"] for m in self.messages)
        )

    def wait(self, condition: Callable[[], Any], seconds: float = PATIENCE_S) -> Any:
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            if result := condition():
                return result
            time.sleep(0.02)
        raise AssertionError([m.fields.get("text", m.kind) for m in self.messages])

    def light(self, name: str) -> int:
        return self.studio.session.basis.names.index(name)

    def send(self, message: Any, **arrays: Any) -> list[Message]:
        return self.studio.handle(message, arrays)

    def plane(self, name: str) -> Any:
        return np.array(self.studio.session.basis.planes.plane(self.light(name)))

    def rendered(self) -> "MovingStudio":
        """Wait until all planes are rendered ones."""
        session, rig = self.studio.session, self.studio.rig

        def has_rendered_planes() -> bool:
            placed = session.requests.placed
            if rig.unrendered(placed):
                return False
            basis = rig.bases(session.bases, placed)[0]
            return all(np.array_equal(self.plane(x), basis.image(x)) for x in placed)

        self.wait(has_rendered_planes)
        return self

    def close(self) -> None:
        self.studio.close()
        self.studio.wait()


def stroke(moving: MovingStudio, number: int = 0) -> None:
    region = (2, 9, 2, 9)
    moving.send(
        protocol.Paint(number, region, True),
        image=np.full((7, 7, 3), 0.7, np.float32),
        importance=np.ones((7, 7), np.float32),
    )


def opened_rig(moving: MovingStudio) -> Any:
    moving.send(protocol.ShowRig())
    return moving.wait(lambda: next((m for m in moving.messages if m.kind == "rig"), None))


def pixel_of(moving: MovingStudio, point: Any) -> tuple[float, float]:
    """Where the camera of the scene itself sees a point."""

    def pixel_in_scene(loaded: Any) -> Any:
        return pixels_of(moving.scene, loaded, np.array([point]))[0]

    x, y = moving.scene.while_loaded(pixel_in_scene)
    height, width = moving.scene.size
    return x * width, y * height


def exact_answer(moving: MovingStudio) -> Any:
    """The exact answer to what was done last, and what is said of it."""

    def is_exact(fields: Any) -> bool:
        return "delta_e" in fields and fields["version"] == moving.studio.session.version

    return moving.wait(
        lambda: next(
            (m.fields for m in moving.messages if m.kind == "answer" and is_exact(m.fields)), None
        )
    )


def place_lights(moving: MovingStudio) -> Any:
    return moving.wait(
        lambda: next((m.fields for m in moving.messages if m.kind == "placed"), None)
    )
