"""The options of `send` and `listen`: the rig, the network, and how long."""

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from lightpaint.cli.options import arguments
from lightpaint.cli.options.option_groups import add_rig_reading
from lightpaint.dmx import PROTOCOLS, SACN, ConsoleTarget, parse_target
from lightpaint.errors import ConsoleError
from lightpaint.validation import parse_number, parse_whole_number

#: When sending ends: with Ctrl-C, once all has been sent, or after so many seconds.
Until = Literal["ctrl-c", "done"] | float

#: Seconds of a unit of time.
UNITS = {"": 1.0, "ms": 0.001, "s": 1.0, "min": 60.0}

#: Longest time that may be given, a day: more is a mistake.
MAX_DURATION_S = 86400.0


@dataclass(frozen=True)
class RigFile:
    """An MVR, and how to read it. gdtf: folder with fixture types, if there is one."""

    path: Path
    gdtf: Path | None
    pixels: bool


@dataclass(frozen=True)
class Sending:
    """A target, how to send to it, and until when.

    target: None to send nothing. universes: of the network by the universes of the rig, for some.
    priority: None for the priority of the link.
    """

    target: ConsoleTarget | None
    universes: dict[int, int]
    priority: int | None
    fps: int
    fade_s: float
    until: Until
    blackout: bool
    interface: str
    positions: bool


def add_rig(parser: argparse.ArgumentParser, *, required: bool, purpose: str = "") -> None:
    """Add the options for the rig of fixtures. purpose: what needs it, if not all does."""
    parser.add_argument(
        "--rig",
        required=required,
        metavar="show.mvr",
        help=f"{purpose}MVR with the fixtures, their modes and addresses",
    )
    add_rig_reading(parser, has_zoom=False)


def rig_file(options: argparse.Namespace) -> RigFile | None:
    """Return the rig that the options name, if any."""
    if options.rig is None:
        return None
    gdtf = None if options.gdtf is None else Path(options.gdtf)
    return RigFile(Path(options.rig), gdtf, options.pixels)


def add_fade(parser: argparse.ArgumentParser, purpose: str) -> None:
    """Add the option for the time of a fade. purpose: what takes it."""
    parser.add_argument(
        "--fade", dest="fade_s", type=duration, default=0.0, metavar="3s", help=purpose
    )


def add_console(parser: argparse.ArgumentParser) -> None:
    """Add the options for a console that follows the painter."""
    add_rig(parser, required=False, purpose="for --to: ")
    _add_target(parser, "(default: none)")
    _add_universes(parser)
    _add_priority(parser)
    add_positions(parser)


def add_positions(parser: argparse.ArgumentParser, *, purpose: str = "") -> None:
    """Add the option for pan and tilt. purpose: what needs it, if not all does."""
    parser.add_argument(
        "--positions",
        action="store_true",
        help=f"{purpose}set pan and tilt so that fixtures point where their lights do (default: "
        "they rest)",
    )


def _add_target(parser: argparse.ArgumentParser, default: str) -> None:
    parser.add_argument(
        "--to",
        dest="target",
        metavar="TARGET",
        help="sacn://HOST or artnet://HOST, maybe with a :PORT, to send to one receiver; "
        f"sacn://multicast or artnet://broadcast to reach all {default}",
    )


def _add_priority(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--priority",
        type=arguments.at_least(0, maximum=200),
        metavar="N",
        help="priority of sACN, of which receivers take the highest (default: 90, below the 100 of "
        "consoles, which win)",
    )


def console_of(options: argparse.Namespace) -> tuple[RigFile, ConsoleTarget | None] | None:
    """Return the rig of a painter and the target of its console, if the options name them.

    Raises ConsoleError for a target without a rig, for positions without a target, for what is not
    a target, and for a priority that its protocol lacks.
    """
    rig, target = rig_file(options), _target_of(options)
    if options.positions and target is None:
        raise ConsoleError("--positions belongs to what is sent: add --to, or leave it out")
    if rig is None:
        if target is not None:
            raise ConsoleError(f"--to {target} sends to the fixtures of a rig: add --rig")
        return None
    return rig, target


def add_send(parser: argparse.ArgumentParser) -> None:
    """Add the options of `send`."""
    parser.add_argument("lighting", metavar="lighting.json", help="file that solve wrote")
    add_rig(parser, required=True)
    _add_target(parser, "(default: send nothing, and print the levels)")
    _add_universes(parser)
    _add_priority(parser)
    add_positions(parser)
    parser.add_argument(
        "--fps",
        type=arguments.at_least(1, maximum=60),
        default=30,
        metavar="N",
        help="frames a second while levels change; else a packet leaves every 0.8 s (default: "
        "%(default)s)",
    )
    add_fade(parser, "fade in from darkness, evenly in light (default: at once)")
    parser.add_argument(
        "--until",
        type=until,
        default="ctrl-c",
        metavar="ctrl-c|done|SECONDS",
        help="when to end: with Ctrl-C, once the fade is over and sent, or after a time (default: "
        "%(default)s)",
    )
    parser.add_argument(
        "--blackout",
        action="store_true",
        help="go dark at the end (default: end the stream with the last levels, of which receivers "
        "do what they are set to do)",
    )
    _add_interface(parser, "send from this IPv4 address of the machine (default: any)")
    parser.add_argument(
        "--dump",
        type=Path,
        metavar="dmx.csv|dmx.json",
        help="write the levels of all channels into a table, or with whole universes into "
        "a JSON file",
    )
    parser.add_argument(
        "--force", action="store_true", help="replace an existing file (default: refuse)"
    )


def sending_of(options: argparse.Namespace) -> Sending:
    """Return where and how the options say to send.

    Raises ConsoleError for what is not a target, and for a priority that its protocol lacks.
    """
    return Sending(
        _target_of(options),
        dict(options.universes),
        options.priority,
        options.fps,
        options.fade_s,
        options.until,
        options.blackout,
        options.interface or "",
        options.positions,
    )


def _target_of(options: argparse.Namespace) -> ConsoleTarget | None:
    """Return the target that the options name, if any, once it goes with their priority."""
    if options.target is None:
        return None
    target = parse_target(options.target)
    if options.priority is not None and target.protocol is not SACN:
        raise ConsoleError(f"{target.protocol.name} has no priority: leave --priority out")
    return target


def add_listen(parser: argparse.ArgumentParser) -> None:
    """Add the options of `listen`."""
    add_rig(parser, required=False, purpose="print drives of lights instead of channels: ")
    parser.add_argument(
        "--from",
        dest="protocol",
        choices=tuple(PROTOCOLS),
        default="sacn",
        help="protocol to listen for (default: %(default)s)",
    )
    _add_universes(parser)
    parser.add_argument(
        "--port",
        type=arguments.at_least(1, maximum=65535),
        metavar="N",
        help="port to listen at (default: the protocol's)",
    )
    _add_interface(
        parser,
        "listen at this IPv4 address of the machine; 0.0.0.0 for all, with the multicast of the "
        "rig's universes (default: 127.0.0.1, for programs of this machine)",
    )
    parser.add_argument(
        "--seconds",
        type=duration,
        metavar="N",
        help="end after this time (default: with Ctrl-C)",
    )


def _add_universes(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--universe",
        dest="universes",
        type=universe_pairs,
        action="extend",
        default=[],
        metavar="1:5,...",
        help="universe 1 of the rig is universe 5 of the network; may be repeated (default: the "
        "same number; of Art-Net one less)",
    )


def _add_interface(parser: argparse.ArgumentParser, description: str) -> None:
    parser.add_argument("--interface", metavar="ADDRESS", help=description)


def universe_pairs(text: str) -> list[tuple[int, int]]:
    """Parse universes of a rig and of the network, `1:5,2:6`."""
    pairs = []
    for part in text.split(","):
        own, colon, network = part.partition(":")
        try:
            pairs.append((parse_whole_number(own), parse_whole_number(network)))
        except ValueError:
            colon = ""
        if not colon:
            raise argparse.ArgumentTypeError(f"{text!r} is not RIG:NETWORK, such as 1:5")
    return pairs


def duration(text: str) -> float:
    """Parse a time in seconds, `3`, `3s`, `500ms` or `2min`."""
    number_text = text.strip().rstrip("abcdefghijklmnopqrstuvwxyz")
    unit = text.strip()[len(number_text) :]
    try:
        seconds = parse_number(number_text) * UNITS[unit]
    except (ValueError, KeyError):
        seconds = -1.0
    if not 0 <= seconds <= MAX_DURATION_S:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a time like 3s, 500ms or 2min, of a day at most"
        )
    return seconds


def until(text: str) -> Until:
    """Parse when to end."""
    match text.strip():
        case "ctrl-c" | "done" as word:
            return word
    try:
        return duration(text)
    except argparse.ArgumentTypeError:
        raise argparse.ArgumentTypeError(
            f"{text!r} is neither ctrl-c nor done, nor a time like 10s"
        ) from None
