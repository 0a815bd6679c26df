# SPDX-License-Identifier: GPL-3.0-or-later
"""The painter's messages (docs/protocol.md), as far as an observer needs them."""

import json
import math
import struct
from dataclasses import dataclass, field

from ..lamps.lamp_units import checked_factor, is_amount

#: Version of the protocol that this add-on speaks.
PROTOCOL_VERSION = 3

#: Largest side of an array in a message, as the painter has it.
MAX_SIDE = 2**16

#: Maximum size of the JSON of a message in bytes, whose values need thirty times as much memory.
MAX_JSON = 2**24

#: Maximum number of looks, and of characters of a sentence, that a panel can show.
MAX_LOOKS, MAX_SENTENCE = 1000, 400

#: Sentences while the lights change, and until the painter has sent how close they come.
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


class MessageError(ValueError):
    """A message that is none of a painter of this version; its text says why."""


def from_bytes(frame):
    """Return the JSON of a frame, and its buffers by name as flat tuples of numbers.

    Raises MessageError for anything else.
    """
    try:
        return _parsed(frame)
    except MessageError:
        raise
    # A deep JSON is too much for its parser, and everything in it may be of another type.
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError, struct.error) as error:
        raise MessageError(f"a frame that is not a message ({type(error).__name__})") from None


def _parsed(frame):
    (length,) = struct.unpack_from("<I", frame)
    if length > MAX_JSON:
        raise MessageError("a message that is longer than a painter's")
    if length > len(frame) - 4:
        raise MessageError("a frame that is shorter than its message")
    content = json.loads(frame[4 : 4 + length].decode(), parse_constant=_refuse)
    if not isinstance(content, dict) or not isinstance(content.get("kind"), str):
        raise MessageError("a message without its kind")
    position, buffers = 4 + length + -(4 + length) % 8, {}
    for description in content.get("buffers", ()):
        shape = description["shape"]
        if not all(type(side) is int and 0 <= side <= MAX_SIDE for side in shape):
            raise MessageError(f"an array of the shape {str(shape)[:60]}")
        count, letter = math.prod(shape), _NUMBERS[description["dtype"]]
        size = count * struct.calcsize(f"<{letter}")
        if position + size > len(frame):
            raise MessageError("a frame that is shorter than its arrays")
        if description["name"] == "weights":
            buffers["weights"] = struct.unpack_from(f"<{count}{letter}", frame, position)
        position += size + -size % 8
    return content, buffers


def _refuse(constant):
    raise MessageError(f"a message with {constant}, which is not a number")


@dataclass
class SessionLook:
    """A kept look. factors: multiplier of red, green and blue by name of light group."""

    id: int
    name: str
    factors: dict


@dataclass
class PainterState:
    """State of a session, as far as an observer knows it.

    closing: why the painter has closed the connection, if it gave a reason. factors: multipliers of
    the current answer by name of light group; 1 is the light as rendered. drives: of the emitters
    of light groups that have some, by both names, under the master dimmer.
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
    drives: dict = field(default_factory=dict)
    _weights: tuple = ()
    _emitters: dict = field(default_factory=dict)
    _undimmed: dict = field(default_factory=dict)

    def receive(self, content, buffers):
        """Take in one message. Return whether the lamps may have changed.

        Raises MessageError for a message that lacks something, or has it in another form.
        """
        try:
            return self._receive(content, buffers)
        except MessageError:
            raise
        except (KeyError, TypeError, AttributeError, IndexError, ValueError) as error:
            reason = " ".join(str(error).split())[:80]
            kind = str(content.get("kind"))[:40]
            raise MessageError(f"a message {kind!r} with a fault ({reason})") from None

    def _receive(self, content, buffers):
        kind = content["kind"]
        if kind == "state":
            self.lights = [_text(light["name"]) for light in content["lights"]]
            self.is_fixed = {light["name"]: light["is_fixed"] for light in content["lights"]}
            self._emitters = {
                light["name"]: [_text(x["name"]) for x in light.get("emitters", ())]
                for light in content["lights"]
            }
            self._undimmed = {}
            self.is_open, self.is_new = True, content.get("is_new", False)
            self._set_looks(content["looks"])
        elif kind == "looks":
            self._set_looks(content["looks"])
        elif kind == "notice":
            self.notice = _sentence(content["text"])
        elif kind in ("closed", "failed"):
            self.closing = self.notice = _sentence(content["text"])
        elif kind == "waiting":
            self.notice = _sentence(content["text"])
        elif kind == "progress":
            done = f"{content['task']}: {content['done']} of {content['total']}"
            self.progress = _sentence(done)
        answer = content.get("answer", content)
        if isinstance(answer, dict) and answer.get("headline"):
            self.headline = _sentence(answer["headline"])
        elif kind == "answer":
            self.headline = ANALYSING_TEXT if content.get("exact") else LIVE_TEXT
        if kind not in ("state", "answer"):
            return False
        master = content.get("master")
        if master is not None and (type(master) not in (int, float) or not is_amount(master)):
            raise MessageError(f"a master dimmer at {str(master)[:40]}")
        master = self.master if master is None else float(master)
        weights = buffers.get("weights", self._weights)
        if len(weights) != 3 * len(self.lights):
            raise MessageError(f"{len(weights)} weights for {len(self.lights)} lights")
        factors = {
            name: self._factor(name, weights[3 * k : 3 * k + 3], master)
            for k, name in enumerate(self.lights)
        }
        self.is_exact = content.get("exact", True) is True
        self.master, self._weights, self.factors = master, weights, factors
        self._set_drives(content.get("answer") or {} if kind == "state" else content)
        return True

    def _set_drives(self, answer):
        """Take the drives of an answer, which some under the brush do not have."""
        listed = answer.get("drives")
        if answer.get("lights"):
            listed = [light.get("drives") for light in answer["lights"]]
        for name, values in zip(self.lights, listed or (), strict=False):
            if values is not None:
                self._undimmed[name] = _named_drives(self._emitters.get(name, ()), values)
        self.drives = {
            name: {emitter: self.master * drive for emitter, drive in drives.items()}
            for name, drives in self._undimmed.items()
        }

    def _factor(self, name, weight, master):
        """Return the multipliers of a light; the master dimmer leaves fixed lights as they are."""
        level = 1.0 if self.is_fixed.get(name) else master
        return checked_factor([level * value for value in self._shown(name, weight)])

    def _shown(self, name, weight):
        """Return a weight as a lamp here can have it: LEDs mix colours outside of Rec.709."""
        return [max(x, 0.0) for x in weight] if self._emitters.get(name) else weight

    def _set_looks(self, looks):
        if len(looks) > MAX_LOOKS:
            raise MessageError(f"{len(looks)} looks, more than {MAX_LOOKS}")
        self.looks = []
        for look in looks:
            pairs = zip(look["lights"], look["weights"], strict=True)
            weights = [self._shown(name, weight) for name, weight in pairs]
            factors = look_factors(look["lights"], weights)
            self.looks.append(SessionLook(look["id"], _sentence(look["name"]), factors))


def _named_drives(emitters, values):
    """Return drives by name of emitter. Raises MessageError for others than from 0 to 1."""
    if not all(type(x) in (int, float) and 0 <= x <= 1 for x in values):
        raise MessageError(f"the drives {str(values)[:60]}")
    return dict(zip(emitters, map(float, values), strict=True))


def look_factors(lights, weights):
    """Return weights by name of light. Raises ValueError for weights that no light has."""
    return {
        _text(name): checked_factor(weight) for name, weight in zip(lights, weights, strict=True)
    }


def _sentence(value):
    """Return a text as a panel can show it: one line that is not too long."""
    shown = "".join(x if x.isprintable() else " " for x in _text(value)[: 2 * MAX_SENTENCE])
    return " ".join(shown.split())[:MAX_SENTENCE]


def _text(value):
    if not isinstance(value, str):
        raise MessageError(f"{str(value)[:60]} in the place of a text")
    return value
