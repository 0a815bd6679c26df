# SPDX-License-Identifier: GPL-3.0-or-later
"""Answers without anybody painting in the browser; these functions wait, so threads call them."""

import json
import os
import threading
import time
import traceback

from ..lamps.lamp_units import checked_factor
from ..shot.shot_files import read_json
from .painter_link import SocketClient
from .painter_messages import PROTOCOL_VERSION, PainterState, from_bytes, to_bytes
from .program import ProgramRun

#: Seconds after which a solve is given up.
SOLVE_S = 1800.0

#: Bytes of a file that are sent at once: the longest side of an array that the painter takes.
PART_BYTES = 2**16

#: Areas of a reference that are compared with the shot, by name in the protocol.
AREAS = ("whole", "regions", "parts")


class SolveError(Exception):
    """A solve that has failed; its text says why."""


class BackgroundWork:
    """A function that runs in a thread.

    Attributes:
        result: What it has returned; None before, and if it has failed.
        error: Why it has failed; "" otherwise.
    """

    def __init__(self, function, *arguments):
        self.result, self.error = None, ""
        self._function, self._arguments = function, arguments
        self._thread = threading.Thread(target=self._run, name="lightpaint", daemon=True)
        self._thread.start()

    @property
    def is_done(self):
        """True once it has ended."""
        return not self._thread.is_alive()

    def _run(self):
        try:
            self.result = self._function(*self._arguments)
        except Exception as error:
            # In a thread nobody else would tell.
            if not isinstance(error, (SolveError, OSError, ValueError)):
                traceback.print_exc()
            self.error = " ".join(str(error).split()) or type(error).__name__


def run_program(program, arguments, variables=None):
    """Run a command of lightpaint to its end. Raises SolveError with what it complains about."""
    run = ProgramRun(program, arguments, variables)
    end = time.monotonic() + SOLVE_S
    while run.code is None and time.monotonic() < end:
        time.sleep(0.05)
    if run.code is None:
        run.stop()
        raise SolveError(f"lightpaint {arguments[0]} took longer than {SOLVE_S:.0f} s")
    # A check that has failed, exit code 1, still leaves an answer.
    if run.code not in (0, 1):
        raise SolveError(run.error_text)


def run_with_views(program, arguments, views):
    """Run a command with the first of several view options that it takes.

    views: pairs of options and variables. Without OpenColorIO, lightpaint refuses Blender's own.
    """
    *earlier, last = views
    for options, variables in earlier:
        try:
            return run_program(program, [*arguments, *options], variables)
        except SolveError:
            continue
    options, variables = last
    return run_program(program, [*arguments, *options], variables)


def make_template(program, shot, folder, views):
    """Write the shot's picture to paint over. Return the path of the linear one."""
    run_with_views(program, ["template", "--lights", shot, "-o", folder, "--force"], views)
    clean = os.path.join(folder, "clean.exr")
    return clean if os.path.exists(clean) else os.path.join(folder, "template.exr")


def solve_picture(program, shot, picture, folder, views):
    """Return the multipliers that bring a shot closest to a picture, by name of group."""
    arguments = ["solve", "--lights", shot, picture, "-o", folder, "--force", "--resize"]
    run_with_views(program, arguments, views)
    return read_factors(os.path.join(folder, "lighting.json"))


def read_factors(path):
    """Return the multipliers in a lighting.json. Raises OSError or ValueError."""
    answer = read_json(path)
    try:
        return {name: checked_factor(x["weight"]) for name, x in answer["lights"].items()}
    except (KeyError, TypeError, AttributeError):
        raise ValueError(f"{path} is not a lighting of lightpaint") from None


def solve_like(program, shot, picture, session, areas):
    """Return the multipliers that give a shot the light of a reference, by name of group.

    A painter without a page is asked for it, in a session of its own.
    """
    with open(picture, "rb") as file:
        data = file.read()
    arguments = ["paint", "--lights", shot, "-o", session, "--json", "--no-browser", "--port", "0"]
    run = ProgramRun(program, [*arguments, "--new"])
    try:
        while run.first_line is None:
            if run.code is not None:
                raise SolveError(run.error_text)
            time.sleep(0.05)
        found = json.loads(run.first_line)
        painter = _Painter(found["address"], found["token"])
        painter.send("hello", version=PROTOCOL_VERSION)
        painter.wait_for(lambda kind, content: kind == "state")
        return _look_like(painter, os.path.basename(picture), data, areas)
    except (KeyError, TypeError, IndexError, AttributeError) as error:
        raise SolveError(f"the painter answered otherwise than expected ({error})") from None
    finally:
        run.stop()


def _look_like(painter, name, data, areas):
    """Send a reference, ask for its light, and return the exact answer."""
    for start in range(0, len(data), PART_BYTES):
        part = data[start : start + PART_BYTES]
        painter.send("add_reference", part, name=name, size=len(data), start=start)
    listed = painter.wait_for(lambda kind, content: kind == "references" and content["references"])
    reference = listed["references"][-1]["id"]
    asked = painter.send("look_like", reference=reference, areas=areas)
    painter.wait_for(lambda kind, content: content.get("reply") == asked)
    painter.wait_for(lambda kind, content: painter.state.is_exact)
    return dict(painter.state.factors)


class _Painter:
    """A client that paints, one request after the other."""

    def __init__(self, address, token):
        self._socket, self._seq, self.state = SocketClient.open(address, token), 0, PainterState()

    def send(self, kind, part=b"", **fields):
        """Send a request and return its number. part: of a file, which it has as an array."""
        self._seq += 1
        described = [{"name": "part", "dtype": "uint8", "shape": [len(part)]}] if part else []
        content = {"kind": kind, "seq": self._seq, **fields, "buffers": described}
        self._socket.send(to_bytes(content, [part] if part else []))
        return self._seq

    def wait_for(self, is_expected):
        """Return the next message of this kind. Raises SolveError for a refusal."""
        while (frame := self._socket.receive()) is not None:
            content, buffers = from_bytes(frame)
            self.state.receive(content, buffers)
            kind = content["kind"]
            if kind in ("failed", "closed") or (kind == "notice" and content.get("tone") == "warn"):
                raise SolveError(content["text"])
            if is_expected(kind, content):
                return content
        raise SolveError("the painter has ended")
