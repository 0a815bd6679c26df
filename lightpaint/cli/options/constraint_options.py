"""The options that constrain lights, and those that let them move."""

import argparse
from collections.abc import Callable, Mapping
from typing import Any

from lightpaint.cli.options import arguments
from lightpaint.cli.options.option_groups import add_fields
from lightpaint.pipeline.job.settings import Settings

#: Adds an option which may be repeated: its flag, metavar, type and help.
AddOption = Callable[[str, str, Callable[[str], Any], str], None]


def _repeated(group: argparse._ArgumentGroup, dests: Mapping[str, str]) -> AddOption:
    """Return a function that adds options to `group`.

    dests: attributes of options that are not named after their flag.
    """

    def add(option: str, metavar: str, kind: Callable[[str], Any], description: str) -> None:
        dest = dests.get(option, option[2:])
        group.add_argument(
            option,
            dest=dest,
            type=kind,
            action="append",
            default=[],
            metavar=metavar,
            help=description,
        )

    return add


def add_constraints(parser: argparse.ArgumentParser) -> None:
    """Add the constraints on lights, which override those of the lights file."""
    group = parser.add_argument_group(
        "constraints",
        "NAME is a light, a group or a pattern; all options may be repeated. LEVEL is a "
        "luminance like 2.5, a share of the current one like 40%, or r,g,b. COLOR is #ffaa66, "
        "3200K or r,g,b.",
    )

    add = _repeated(group, {"--limit": "limits"})
    _add_levels(add)
    _add_colors(group, add)
    parser.set_defaults(duv=[])
    add("--off", "NAME", str, "switch the light off")
    _add_preferences(group)


def _add_levels(add: AddOption) -> None:
    """Add the constraints on brightness."""
    add(
        "--lock",
        "NAME[=LEVEL]",
        arguments.lock,
        "keep the light as it is, or at this level, or at '3200K 40%%'",
    )
    add(
        "--limit",
        "NAME=MIN:MAX",
        arguments.limits,
        "keep the light between these levels; one of them may be left out",
    )
    add(
        "--tie",
        "A,B,...",
        arguments.names_of,
        "put these lights on one dimmer, with their current colours",
    )


def _add_colors(group: argparse._ArgumentGroup, add: AddOption) -> None:
    """Add the constraints on colour."""
    add(
        "--color",
        "NAME=COLOR",
        arguments.light_value,
        "give the light this colour, and adjust only its brightness",
    )
    group.add_argument(
        "--kelvin",
        type=arguments.kelvin,
        action=arguments.Kelvin,
        default=[],
        metavar="NAME=2700:6500[,duv=D]",
        help="keep the light white, between these temperatures or at one; duv is the distance "
        "from the black-body locus, like 0.003, positive towards green (default: on it)",
    )
    add(
        "--primaries",
        "NAME=COLOR,...",
        arguments.primaries,
        "restrict the light to colours that a fixture with these LEDs can mix",
    )


def _add_preferences(group: argparse._ArgumentGroup) -> None:
    """Add the options that choose among good answers, for all lights at once."""
    group.add_argument(
        "--prefer-current",
        type=arguments.number(may_be_zero=True),
        default=0.0,
        metavar="STRENGTH",
        help="prefer the current lighting with this strength, like 0.01: lights that the painting"
        " does not determine then stay as they are (default: %(default)s)",
    )
    group.add_argument(
        "--start",
        type=arguments.light_value,
        action="append",
        default=[],
        metavar="NAME=R,G,B",
        help="start from this emission of a light instead of the current one: unpainted parts are "
        "held to the look of the lighting to start from, and lamps to its colours",
    )
    group.add_argument(
        "--near",
        type=arguments.number(may_be_zero=True),
        default=0.0,
        metavar="STRENGTH",
        help="stay near the current lighting, or that of --start, with this strength relative to "
        "the paint, like 0.1 (default: %(default)s)",
    )
    group.add_argument(
        "--sparse",
        type=arguments.at_least(1),
        metavar="K",
        help="use only the K lights that fit best, besides locked ones, and switch the others off",
    )


def add_rigging(parser: argparse.ArgumentParser) -> None:
    """Add options for lights that may move, in addition to the lights file."""
    group = parser.add_argument_group(
        "places",
        "NAME is a light or a pattern; all options may be repeated. Lights that may move go where "
        "they bring the answer closest to the painting.",
    )

    add = _repeated(group, {"--add": "added"})

    add(
        "--move",
        "NAME=DISTANCE|@RAIL",
        arguments.move,
        "let the light move up to this distance, or along a rail or surface of the lights file",
    )
    add(
        "--aim", "NAME=DEGREES|any", arguments.aim, "let the light turn up to this angle, or freely"
    )
    add(
        "--cone",
        "NAME=10:45",
        arguments.cone,
        "let the cutoff angle of the spot vary between these, in degrees from its axis",
    )
    add(
        "--beam",
        "NAME=5:20|any",
        arguments.beam,
        "let the spot's beam, the part at full brightness, end between these angles, in degrees "
        "from its axis, or anywhere in its cone (default: at the same share of the cone as now)",
    )
    add(
        "--add",
        "KIND[:N][@WHERE]",
        arguments.new_light,
        "add a light, or up to N. KIND is point, spot, panel, or the name of a light to "
        "copy; WHERE is a rail or surface of the lights file, or a shape (default: anywhere)",
    )
    group.add_argument(
        "--places",
        metavar="FILE",
        help="hang lights as the places.json of a painter's export says, without a search",
    )
    add_fields(group, Settings, "move_lights")
