"""The options of `lightpaint solve`: paintings, method, constraints."""

import argparse
from collections.abc import Callable, Mapping
from typing import Any

from lightpaint.cli.options import arguments
from lightpaint.cli.options.option_groups import add_view_transform

#: Names of the variations.
VARIATIONS = "warmer,cooler,fewer-lights,white-only,held-harder"


def add_paintings(parser: argparse.ArgumentParser) -> None:
    """Add the paintings, of one view or several."""
    parser.add_argument(
        "targets", metavar="TARGET", nargs="*", help="painting: EXR, PNG, TIFF, JPEG, ..."
    )
    parser.add_argument(
        "--target",
        dest="views",
        type=arguments.sensor_target,
        action="append",
        default=[],
        metavar="SENSOR=TARGET",
        help="instead of TARGET: painting of the view through that sensor; repeat it for several "
        "views that share one lighting",
    )
    parser.add_argument(
        "--mask",
        dest="masks",
        action="append",
        metavar="MASK",
        help="picture of the importance of pixels, instead of alpha or the difference to the "
        "template; "
        "once for all targets, or once for each in order",
    )
    parser.add_argument("--layer", metavar="NAME", help="layer, part or view of an EXR to read")
    default = "that of the template or the picture, else"
    add_view_transform(parser, f"{default} srgb", f"{default} 0")
    parser.add_argument(
        "--template",
        metavar="DIR",
        help="template that was painted over: only differences to it count (default: the template "
        "beside the painting, or ./template)",
    )
    parser.add_argument(
        "--no-template",
        dest="find_template",
        action="store_false",
        help="do not look for a template",
    )
    parser.add_argument(
        "--paint",
        choices=("look", "light"),
        default="look",
        help="meaning of painted colours: the look of a surface, or the light that falls on it, "
        "which is multiplied by the surface's albedo (default: %(default)s)",
    )


def add_error(parser: argparse.ArgumentParser) -> None:
    """Add the option for how sure the lights are to be."""
    parser.add_argument(
        "--error",
        type=arguments.share,
        metavar="SHARE",
        help="instead of --spp: the largest error of any light that shows, like 2%%; after 16 "
        "samples per pixel more are taken where the painting needs them, until that is met, or "
        "for --time seconds",
    )


def add_pattern(parser: argparse.ArgumentParser) -> None:
    """Add the option for names of light groups."""
    parser.add_argument(
        "--pattern",
        metavar="'Light_{name}'",
        help="naming pattern of the layers, parts or files of light groups, if it is not that of a "
        "known renderer",
    )


def add_fit(parser: argparse.ArgumentParser) -> None:
    """Add the options for what counts as close."""
    parser.add_argument(
        "--hold",
        type=arguments.number(may_be_zero=True),
        metavar="H",
        help="weight that keeps unpainted pixels at the current look, relative to all painted "
        "pixels; "
        "0 ignores them (default: 4 if the current look was painted over, else 0)",
    )
    parser.add_argument(
        "--colors",
        choices=("free", "gentle", "white"),
        help="colours of lamps. free: whatever fits best; gentle: their present ones, unless the "
        "painting "
        "asks for others; white: 2200 to 9000 K (default: gentle if the current look was painted "
        "over, or painted through a view, else free)",
    )
    parser.add_argument(
        "--space",
        choices=("linear", "display"),
        help="compare in linear light, or in display values through --view, as the eye sees them "
        "(default: display for paintings through a view, of 8 or 16 bits, else linear)",
    )
    parser.add_argument(
        "--literal",
        action="store_true",
        help="fit the painting exactly as given, like the paper: linear light, no hold, any "
        "colour, no noise correction, unless other options set these",
    )


def add_method(parser: argparse.ArgumentParser) -> None:
    """Add the options for how a painting is solved."""
    add_fit(parser)
    parser.add_argument(
        "--unpainted",
        type=arguments.number(may_be_zero=True),
        default=0.0,
        metavar="W",
        help="instead of --hold: weight of each unpainted pixel (default: %(default)s)",
    )
    parser.add_argument(
        "--emitters",
        choices=("auto", "count", "skip"),
        default="auto",
        help="whether painted pixels that show an emitter count; auto: if alpha, "
        "mask or template mark them as painted; count: always, so that emitters are fitted to "
        "their painted brightness; skip: never (default: %(default)s)",
    )
    parser.add_argument(
        "--resize", action="store_true", help="resample a target of another size (default: refuse)"
    )
    parser.add_argument(
        "--correct-noise",
        dest="noise_correction",
        action=argparse.BooleanOptionalAction,
        help="remove the noise's power from the equations, as far as that helps: the answer is "
        "closer to "
        "that of many samples (default: if the noise is known)",
    )
    parser.add_argument(
        "--refine",
        type=arguments.at_least(0, most=100),
        default=0,
        metavar="K",
        help="rounds of rendering the solved scene, with as many samples as the basis, to improve "
        "the answer (default: %(default)s)",
    )
    parser.add_argument(
        "--method",
        choices=("polished", "gauss-seidel"),
        default="polished",
        help="gauss-seidel: the paper's iteration alone, which converges slowly or stops before "
        "the "
        "optimum and says so (default: %(default)s)",
    )
    parser.add_argument(
        "--suggest",
        type=arguments.at_least(1, most=100),
        nargs="?",
        const=3,
        default=0,
        metavar="N",
        help="suggest up to N (3) additional point lights that would help most, with XML to paste, "
        "and the best turn of a spot that is there; takes about half a minute",
    )


def add_verification(parser: argparse.ArgumentParser) -> None:
    """Add the options for the verification."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument(
        "--no-verify",
        dest="verify",
        action="store_false",
        help="do not render the relit scene (default: render it with at most the samples of the "
        "basis, "
        "on the whole film or as much of it as they allow)",
    )
    group.add_argument(
        "--verify-spp",
        type=arguments.at_least(2, most=2**20),
        metavar="N",
        help="samples per pixel of the verification, on the whole film, however long it takes",
    )


def add_several(parser: argparse.ArgumentParser) -> None:
    """Add the option for failures among several paintings."""
    parser.add_argument(
        "--keep-going",
        action="store_true",
        help="with several paintings: if one cannot be read or solved, continue with the others "
        "and "
        "exit with 1 (default: check all first, and start nothing if one fails)",
    )


def add_variations(parser: argparse.ArgumentParser) -> None:
    """Add the option for variations of each answer."""
    parser.add_argument(
        "--variations",
        type=arguments.names_of,
        action="extend",
        default=[],
        metavar=VARIATIONS,
        help="variations of each answer, one or several, in folders beside it",
    )


def add_tolerances(parser: argparse.ArgumentParser) -> None:
    """Add the requirements of scripts."""
    parser.add_argument(
        "--max-miss",
        type=arguments.number(" of ΔE", may_be_zero=True),
        metavar="DE",
        help="exit with 1 if the mean ΔE over the painted pixels, as in the first line of an "
        "answer, "
        "is larger than this; results are written anyway",
    )
    parser.add_argument(
        "--min-fit",
        type=arguments.number(" as a share", may_be_zero=True, most=1),
        metavar="SHARE",
        help="exit with 1 if the answer realises less than this share, 0 to 1, of the painted "
        "change: 1 − "
        "its mean ΔE / the mean ΔE of the present scene",
    )


def _repeated(
    group: argparse._ArgumentGroup, dests: Mapping[str, str]
) -> Callable[[str, str, Callable[[str], Any], str], None]:
    """Return a function that adds an option which may be repeated: its flag, metavar, type, help.

    dests: attributes of options that are not named after their flag.
    """

    def add(option: str, metavar: str, kind: Callable[[str], Any], about: str) -> None:
        dest = dests.get(option, option[2:])
        group.add_argument(
            option, dest=dest, type=kind, action="append", default=[], metavar=metavar, help=about
        )

    return add


def add_constraints(parser: argparse.ArgumentParser) -> None:
    """Add the constraints on lights, which override those of the lights file."""
    group = parser.add_argument_group(
        "constraints",
        "NAME is a light, a group or a pattern; all options may be repeated. LEVEL is a "
        "luminance like 2.5, a share of the present one like 40%, or r,g,b. COLOR is #ffaa66, "
        "3200K or r,g,b.",
    )

    add = _repeated(group, {"--limit": "limits"})

    add(
        "--lock",
        "NAME[=LEVEL]",
        arguments.lock,
        "keep the light as it is, or at a level, or at '3200K 40%%'",
    )
    add(
        "--limit",
        "NAME=MIN:MAX",
        arguments.limits,
        "keep the light between these levels; one may be left out",
    )
    add(
        "--tie",
        "A,B,...",
        arguments.names_of,
        "put these lights on one dimmer, with their present colours",
    )
    add(
        "--color",
        "NAME=COLOR",
        arguments.named,
        "give the light this colour, and adjust only its dimmer",
    )
    group.add_argument(
        "--kelvin",
        type=arguments.kelvin,
        action=arguments.Kelvin,
        default=[],
        metavar="NAME=2700:6500[,duv=D]",
        help="white between these temperatures, or of one; duv is the distance from Planck's "
        "locus, like "
        "0.003, positive towards green (default: on it)",
    )
    parser.set_defaults(duv=[])
    add(
        "--primaries",
        "NAME=COLOR,...",
        arguments.primaries,
        "colours that a fixture with these LEDs can mix",
    )
    add("--off", "NAME", str, "switch the light off")
    group.add_argument(
        "--prefer-current",
        type=arguments.number(may_be_zero=True),
        default=0.0,
        metavar="STRENGTH",
        help="pull towards the present lighting, like 0.01: lights that the painting does not "
        "determine stay (default: %(default)s)",
    )
    group.add_argument(
        "--sparse",
        type=arguments.at_least(1),
        metavar="K",
        help="use only the K lights that fit best, besides locked ones; switch the others off",
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
        "let the light move so far from its place, or along a rail or surface of the lights file",
    )
    add("--aim", "NAME=DEGREES|any", arguments.aim, "let the light turn so far")
    add(
        "--cone",
        "NAME=10:45",
        arguments.cone,
        "let the spot's cone end between these degrees from its axis",
    )
    add(
        "--add",
        "KIND[:N][@WHERE]",
        arguments.new_light,
        "add a light, or up to N: point, spot, panel, or the name of one to add another like it; "
        "anywhere, or on a rail or surface of the lights file, or a shape",
    )
    group.add_argument(
        "--no-move",
        dest="move_lights",
        action="store_false",
        help="leave all lights where they are, whatever the lights file lets move",
    )
