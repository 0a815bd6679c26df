"""A studio of saved bases for tests, and all that it says."""

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from patience import PATIENCE_S

import lightpaint as lp
from lightpaint.basis.derived_planes import ScaledPlanes
from lightpaint.basis.light_basis import PLAIN_LOOK
from lightpaint.cli.commands.paint_command import command_for_paintings
from lightpaint.paint import protocol
from lightpaint.paint.protocol import Message
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.studio.session_studio import Studio
from lightpaint.paint.subject import Subject


def look_of(basis: lp.Basis) -> lp.Basis:
    """The picture of a basis that stands in until its lights are rendered."""
    planes = ScaledPlanes.summing_to(basis.current_look, basis.current_weights)
    origin = replace(basis.origin, method=PLAIN_LOOK, halves=(0, 0), passes=(0, 0))
    noise = np.zeros((*basis.images.shape,), np.float32)
    return replace(basis, planes=planes, noise=noise, origin=origin, features=None, objects=None)


class StudioClient:
    """A studio of saved bases, and all that it says."""

    def __init__(self, folder: Path, *bases: lp.Basis, scene: Any = None) -> None:
        command = partial(command_for_paintings, "room.basis.exr")
        options = {"command": lambda paths, requests: command(paths, (), requests), "scene": scene}
        subjects = [
            Subject(f"view {k}", folder, basis=view_basis, **options)
            for k, view_basis in enumerate(bases)
        ]
        self.messages: list[Message] = []
        self.studio = Studio(
            subjects, lambda view_basis: Store.open(folder / "session.db", view_basis)
        )
        self.studio.on_message = self.messages.append
        self.studio.start()
        self.wait(lambda m: m.kind == "state")

    def wait(self, is_match: Callable[[Message], Any], seconds: float = PATIENCE_S) -> Message:
        """Return the first message, from now or from before, that matches."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            for message in list(self.messages):
                if is_match(message):
                    return message
            time.sleep(0.01)
        raise AssertionError([m.kind for m in self.messages])

    def exact(self) -> Message:
        """The exact answer to what was done last."""
        version = self.studio.session.version
        return self.wait(
            lambda m: (
                m.kind == "answer" and "headline" in m.fields and m.fields["version"] == version
            )
        )

    def paint(
        self, stroke: int, light: float, region: Any = (3, 12, 4, 15), *, view: int = 0
    ) -> Message:
        """A stroke, whole."""
        shape = region[1] - region[0], region[3] - region[2]
        arrays = {
            "image": np.full((*shape, 3), light, np.float32),
            "importance": np.ones(shape, np.float32),
        }
        [answer] = self.studio.handle(protocol.Paint(stroke, region, True, view=view), arrays)
        return answer
