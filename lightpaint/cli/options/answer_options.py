"""The options of `solve` and `batch`: paintings, method, requirements, constraints, workers."""

import argparse
from collections.abc import Callable, Mapping
from typing import Any, get_args

from lightpaint.batch import RunOptions
from lightpaint.cli.options import arguments
from lightpaint.cli.options.option_groups import add_fields, add_output, add_view_transform
from lightpaint.colour import Preference
from lightpaint.pipeline import Settings

#: Names of the variations.
VARIATIONS = "warmer,cooler,fewer-lights,white-only,held-harder"


def add_paintings(parser: argparse.ArgumentParser) -> None:
    """Add the paintings, of one view or several."""
    parser.add_argument(
        "targets", metavar="TARGET", nargs="*", help="painting: EXR, PNG, TIFF, JPEG and others"
    )
    parser.add_argument(
        "--target",
        dest="views",
        type=arguments.sensor_target,
        action="append",
        default=[],
        metavar="SENSOR=TARGET",
        help="painting of the view through this sensor, or of this frame of a shot, instead of "
        "TARGET; repeat it for several views that share one lighting",
    )
    parser.add_argument(
        "--mask",
        dest="masks",
        action="append",
        metavar="MASK",
        help="picture of how much each pixel counts, instead of alpha or the difference to the "
        "template; give one for all targets, or one for each, in order",
    )
    parser.add_argument("--layer", metavar="NAME", help="layer, part or view to read from an EXR")
    default = "the view of the template or the picture, else"
    add_view_transform(parser, f"{default} srgb", f"{default} 0")
    _add_template(parser)
    parser.add_argument(
        "--paint",
        choices=("look", "light"),
        default="look",
        help="what painted colours mean. look: the colour of the surface as the picture shows it;"
        " light: the light that falls on it, which lightpaint multiplies by the surface's "
        "albedo (default: %(default)s)",
    )


def _add_template(parser: argparse.ArgumentParser) -> None:
    """Add the options for the template that was painted over."""
    parser.add_argument(
        "--template",
        metavar="DIR",
        help="template that was painted over: only pixels that differ from it count (default: the"
        " folder of the painting, the template beside it, or ./template)",
    )
    parser.add_argument(
        "--no-template",
        dest="find_template",
        action="store_false",
        help="do not look for a template",
    )


def add_frames(parser: argparse.ArgumentParser) -> None:
    """Add the options for the frames of a shot."""
    add_fields(parser, Settings, "animate")
    parser.add_argument(
        "--frames",
        metavar="all|1-48x2,60",
        help="of a shot: also write these frames with the new lighting, as relit.####.exr; frames "
        "that are already written for this answer are skipped (default: none)",
    )


def add_pattern(parser: argparse.ArgumentParser) -> None:
    """Add the option for names of light groups."""
    parser.add_argument(
        "--pattern",
        metavar="'Light_{name}'",
        help="how the layers, parts or files of light groups are named, if not as a known "
        "renderer names them",
    )


def add_fit(parser: argparse.ArgumentParser) -> None:
    """Add the options for what counts as close."""
    add_fields(parser, Settings, "hold", "colors", "space", "literal")


def add_method(parser: argparse.ArgumentParser) -> None:
    """Add the options for how a painting is solved."""
    add_fit(parser)
    add_fields(parser, Settings, "unpainted", "emitters", "resize", "noise_correction", "refine")
    add_fields(parser, Settings, "method", "sun", "spectral", "observer", "suggest")


def add_verification(parser: argparse.ArgumentParser) -> None:
    """Add the options for the verification."""
    add_fields(parser.add_mutually_exclusive_group(), Settings, "verify", "verify_spp")


def add_several(parser: argparse.ArgumentParser) -> None:
    """Add the option for failures among several paintings."""
    parser.add_argument(
        "--keep-going",
        action="store_true",
        help="if one of several paintings cannot be read or solved, continue with the others, and"
        " exit with 1 (default: check all first, and start none if one fails)",
    )


def add_variations(parser: argparse.ArgumentParser) -> None:
    """Add the option for variations of each answer."""
    parser.add_argument(
        "--variations",
        type=arguments.names_of,
        action="extend",
        default=[],
        metavar=VARIATIONS,
        help="also solve these variations of each answer, into folders beside it",
    )


def add_tolerances(parser: argparse.ArgumentParser) -> None:
    """Add the requirements of scripts."""
    parser.add_argument(
        "--max-miss",
        type=arguments.number(" of ΔE", may_be_zero=True),
        metavar="DE",
        help="exit with 1 if the mean ΔE over the painted pixels, which the first line of an "
        "answer shows, is larger than this; the results are written anyway",
    )
    parser.add_argument(
        "--min-fit",
        type=arguments.number(" as a share", may_be_zero=True, maximum=1),
        metavar="SHARE",
        help="exit with 1 if the answer realises less than this share of the painted change, 0 to"
        " 1: 1 − its mean ΔE / the mean ΔE of the current scene",
    )


def add_batch(parser: argparse.ArgumentParser) -> None:
    """Add all options of the command."""
    _add_looks(parser)
    _add_failures(parser)
    add_fields(parser, RunOptions, "workers", "cluster", "shared_fs", "task_limit_s")
    add_fields(parser, RunOptions, "shares_folder")
    parser.add_argument(
        "--export",
        choices=("openjd",),
        help="write a job for a render farm, as an Open Job Description template, into the "
        "folder that follows the manifest, and do nothing else",
    )
    parser.add_argument(
        "--log", metavar="FILE", help="append a line with the time of each step to this file"
    )
    add_fields(parser, Settings, "force")


def _add_looks(parser: argparse.ArgumentParser) -> None:
    """Add options for the looks and their folder."""
    parser.add_argument(
        "paths",
        metavar="looks.toml",
        nargs="+",
        help="manifest of looks; with --init a scene, followed by paintings",
    )
    add_output(
        parser,
        "DIR",
        "folder for all looks (default: named after the manifest); with --init the file to write "
        "(default: looks.toml)",
    )
    parser.add_argument(
        "--init",
        action="store_true",
        help="write a first manifest for a scene and paintings, and do nothing else",
    )
    parser.add_argument(
        "--dry-run",
        action="store_true",
        help="check the manifest and print the steps to do, with estimates of time and memory, "
        "but do none",
    )
    parser.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="PATTERN",
        help="do only looks whose names match, like 'dusk-*'; repeat it for several patterns",
    )


def _add_failures(parser: argparse.ArgumentParser) -> None:
    """Add options for the handling of failed steps."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument(
        "--keep-going",
        dest="keep_going",
        action="store_true",
        default=True,
        help="continue with the other looks after one has failed (default)",
    )
    add_fields(group, RunOptions, "keep_going")
    add_fields(parser, RunOptions, "retry")


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
    """Add the constraints on lights, which override the constraints of the lights file."""
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
    add(
        "--rf",
        "NAME=85",
        arguments.light_number,
        "of all mixes of the lamp's emitters that look the same, take one whose fidelity index Rf "
        "(TM-30) is at least this; if none is, the best",
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
        "--prefer-emitters",
        choices=get_args(Preference),
        help="among mixes of a lamp's emitters that look the same, choose the one that needs the "
        "least power, with the most light from white emitters, of the fewest emitters, or that "
        "renders colours best by their spectra (Rf of TM-30; default: watts)",
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
        help="stay near the current lighting, or --start, with this strength relative to "
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
