# SPDX-License-Identifier: GPL-3.0-or-later
"""The painter's messages (docs/protocol.md), as far as an observer needs them."""

import json
import math
import struct
from dataclasses import dataclass, field

#: Version of the protocol that this add-on speaks.
PROTOCOL_VERSION = 3

#: Sentences while the lights change, and until the painter has said how close they come.
LIVE_TEXT, ANALYSING_TEXT = "the lamps follow the brush", "the lamps are set; analysing"

#: Types of numbers in buffers: their letter for `struct`, and their size in bytes.
_NUMBERS = {"float16": "e", "float32": "f", "float64": "d", "int16": "h", "uint8": "B"}


def to_bytes(content, buffers=()):
    """Return a message as one frame."""
    text = json.dumps(content, ensure_ascii=False).encode("utf-8", "replace")
    parts = [struct.pack("<I", len(text)), text, b"\0" * (-(4 + len(text)) % 8)]
    for buffer in buffers:
        parts += [buffer, b"\0" * (-len(buffer) % 8)]
    return b"".join(parts)


def from_bytes(frame):
    """Return the JSON of a frame, and its buffers by name as flat tuples of numbers."""
    (length,) = struct.unpack_from("<I", frame)
    content = json.loads(frame[4 : 4 + length])
    position, buffers = 4 + length + -(4 + length) % 8, {}
    for description in content.get("buffers", ()):
        count = math.prod(description["shape"])
        layout = f"<{count}{_NUMBERS[description['dtype']]}"
        if description["name"] == "weights":
            buffers["weights"] = struct.unpack_from(layout, frame, position)
        size = struct.calcsize(layout)
        position += size + -size % 8
    return content, buffers


@dataclass
class SessionLook:
    """A kept look. factors: multiplier of red, green and blue by name of light group."""

    id: int
    name: str
    factors: dict


@dataclass
class PainterState:
    """State of a session, as far as an observer knows it.

    closing: why the painter has closed the connection, if it said so. factors: multipliers of the
    current answer by name of light group; 1 is the light as rendered.
    """

    lights: list = field(default_factory=list)
    is_fixed: dict = field(default_factory=dict)
    master: float = 1.0
    factors: dict = field(default_factory=dict)
    is_exact: bool = True
    looks: list = field(default_factory=list)
    headline: str = ""
    notice: str = ""
    progress: str = ""
    closing: str = ""
    is_open: bool = False
    is_new: bool = True
    _weights: tuple = ()

    def receive(self, content, buffers):
        """Take in one message. Return whether the lamps may have changed."""
        kind = content["kind"]
        if kind == "state":
            self.lights = [light["name"] for light in content["lights"]]
            self.is_fixed = {light["name"]: light["is_fixed"] for light in content["lights"]}
            self.is_open, self.is_new = True, content.get("is_new", False)
            self._set_looks(content["looks"])
        elif kind == "looks":
            self._set_looks(content["looks"])
        elif kind == "notice":
            self.notice = content["text"]
        elif kind in ("closed", "failed"):
            self.closing = self.notice = content["text"]
        elif kind == "waiting":
            self.notice = content["text"]
        elif kind == "progress":
            self.progress = f"{content['task']}: {content['done']} of {content['total']}"
        answer = content.get("answer", content)
        if isinstance(answer, dict) and answer.get("headline"):
            self.headline = answer["headline"]
        elif kind == "answer":
            self.headline = ANALYSING_TEXT if content.get("exact") else LIVE_TEXT
        if kind not in ("state", "answer"):
            return False
        self.is_exact = content.get("exact", True)
        self.master = content.get("master") if content.get("master") is not None else self.master
        self._weights = buffers.get("weights", self._weights)
        self.factors = {
            name: self._factor(name, self._weights[3 * i : 3 * i + 3])
            for i, name in enumerate(self.lights)
        }
        return True

    def _factor(self, name, weight):
        """Return the multipliers of a light; the master dimmer leaves fixed lights as they are."""
        level = 1.0 if self.is_fixed.get(name) else self.master
        return tuple(level * value for value in weight)

    def _set_looks(self, looks):
        self.looks = [
            SessionLook(look["id"], look["name"], look_factors(look["lights"], look["weights"]))
            for look in looks
        ]


def look_factors(lights, weights):
    """Return weights by name of light."""
    return {name: tuple(weight) for name, weight in zip(lights, weights, strict=True)}
