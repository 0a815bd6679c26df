"""The options of `lightpaint solve` alone: paintings, method, constraints."""

import argparse
from collections.abc import Callable
from typing import Any

from lightpaint.cli.options import arguments
from lightpaint.cli.options.option_groups import add_view_transform

#: Variations, as they are typed.
VARIATIONS = "warmer,cooler,fewer-lights,white-only,held-harder"


def add_paintings(parser: argparse.ArgumentParser) -> None:
    """What was painted, of one view or several."""
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
        help="instead of TARGET: painting of the view through that sensor; give it once for each "
        "view, and one lighting answers all of them",
    )
    parser.add_argument(
        "--mask",
        dest="masks",
        action="append",
        metavar="MASK",
        help="picture of what counts, instead of the alpha or what differs from the template; once "
        "for all targets, or once for each in order",
    )
    parser.add_argument("--layer", metavar="NAME", help="layer, part or view of an EXR to read")
    said = "what the template or the picture says, else"
    add_view_transform(parser, f"{said} srgb", f"{said} 0")
    parser.add_argument(
        "--template",
        metavar="DIR",
        help="what was painted on, so that only what differs from it counts (default: the template "
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
        help="what the brush puts down: the look of a surface, or the light that falls on it, "
        "which is multiplied by what the surface reflects (default: %(default)s)",
    )


def add_pattern(parser: argparse.ArgumentParser) -> None:
    """How light groups are named."""
    parser.add_argument(
        "--pattern",
        metavar="'Light_{name}'",
        help="how the layers, parts or files of light groups are named, where no renderer that "
        "is known names them so",
    )


def add_fit(parser: argparse.ArgumentParser) -> None:
    """What it is to be close."""
    parser.add_argument(
        "--hold",
        type=arguments.number(may_be_zero=True),
        metavar="H",
        help="weight of all that is not painted, against the current look, beside that of all that "
        "is; 0 lets it go (default: 3 where it was painted over the current look, else 0)",
    )
    parser.add_argument(
        "--colors",
        choices=("free", "gentle", "white"),
        help="of lamps. free: whatever is best; gentle: those they have, unless the painting asks "
        "for others; white: 2200 to 9000 K (default: gentle where it was painted over the current "
        "look or through a view, else free)",
    )
    parser.add_argument(
        "--space",
        choices=("linear", "display"),
        help="linear: come closest in light; display: in what the eye sees of it through --view "
        "(default: display for what was painted through a view, 8 and 16 bits, else linear)",
    )
    parser.add_argument(
        "--literal",
        action="store_true",
        help="take the painting at its word, as the paper does: linear light, nothing held, any "
        "colour, noise left in; but for what other options say",
    )


def add_method(parser: argparse.ArgumentParser) -> None:
    """How a painting is answered."""
    add_fit(parser)
    parser.add_argument(
        "--unpainted",
        type=arguments.number(may_be_zero=True),
        default=0.0,
        metavar="W",
        help="instead of --hold: weight of each pixel that is not painted (default: %(default)s)",
    )
    parser.add_argument(
        "--emitters",
        choices=("auto", "count", "skip"),
        default="auto",
        help="whether painted pixels in which the camera sees an emitter count; auto: where alpha, "
        "mask or template say that they were painted; count: always, which holds the emitters "
        "themselves to how bright they were painted; skip: never (default: %(default)s)",
    )
    parser.add_argument(
        "--resize", action="store_true", help="resample a target of another size (default: refuse)"
    )
    parser.add_argument(
        "--correct-noise",
        dest="noise_correction",
        action=argparse.BooleanOptionalAction,
        help="take the power of the noise, as far as that pays, out of the equations: closer to "
        "the answer of many samples (default: where it is known)",
    )
    parser.add_argument(
        "--refine",
        type=arguments.at_least(0, most=100),
        default=0,
        metavar="K",
        help="times to render the scene as solved, with as many samples as the basis, and improve "
        "the answer by what that shows (default: %(default)s)",
    )
    parser.add_argument(
        "--method",
        choices=("polished", "gauss-seidel"),
        default="polished",
        help="gauss-seidel: the paper's iteration alone, which comes late to the optimum or runs "
        "out of sweeps, and says so (default: %(default)s)",
    )
    parser.add_argument(
        "--suggest",
        type=arguments.at_least(1, most=100),
        nargs="?",
        const=3,
        default=0,
        metavar="N",
        help="look for up to N (3) further point lights that would help most, with XML to paste; "
        "takes some ten seconds",
    )


def add_verification(parser: argparse.ArgumentParser) -> None:
    """How the answer is checked."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument(
        "--no-verify",
        dest="verify",
        action="store_false",
        help="do not render the scene as it was relit (default: as many samples as the basis has, "
        "at most, on the whole film or as much of it as they are enough for)",
    )
    group.add_argument(
        "--verify-spp",
        type=arguments.at_least(2, most=2**20),
        metavar="N",
        help="samples per pixel of that render, on the whole film, however long it takes",
    )


def add_several(parser: argparse.ArgumentParser) -> None:
    """What several paintings of one scene are to each other."""
    parser.add_argument(
        "--keep-going",
        action="store_true",
        help="of several paintings: one that cannot be read or answered fails alone, the others go "
        "on, and the exit code is 1 (default: all are checked first, and nothing is begun)",
    )


def add_variations(parser: argparse.ArgumentParser) -> None:
    """Siblings of each answer."""
    parser.add_argument(
        "--variations",
        type=arguments.names_of,
        action="extend",
        default=[],
        metavar=VARIATIONS,
        help="one or several: siblings of each answer, in folders beside it",
    )


def add_wanted(parser: argparse.ArgumentParser) -> None:
    """What a script asks of the answer."""
    parser.add_argument(
        "--max-miss",
        type=arguments.number(" of ΔE", may_be_zero=True),
        metavar="DE",
        help="exit with 1 if an answer misses more than this mean ΔE over what was painted, as "
        "its first line says it; results are written all the same",
    )
    parser.add_argument(
        "--min-fit",
        type=arguments.number(" as a share", may_be_zero=True, most=1),
        metavar="SHARE",
        help="exit with 1 if less than this share, 0 to 1, of what was asked has come about: 1 − "
        "that mean ΔE / the ΔE as the scene is now",
    )


def add_constraints(parser: argparse.ArgumentParser) -> None:
    """What is asked of the lights, as in the lights file and before it."""
    group = parser.add_argument_group(
        "constraints",
        "NAME is a light, a group or a pattern; all may be repeated. LEVEL is a luminance like "
        "2.5, a share of the present one like 40%, or r,g,b. COLOR is #ffaa66, 3200K or r,g,b.",
    )

    def add(option: str, metavar: str, kind: Callable[[str], Any], about: str) -> None:
        dest = "limits" if option == "--limit" else option[2:]
        group.add_argument(
            option, dest=dest, type=kind, action="append", default=[], metavar=metavar, help=about
        )

    add(
        "--lock", "NAME[=LEVEL]", arguments.lock, "keep it as it is, or at a level, or '3200K 40%%'"
    )
    add(
        "--limit",
        "NAME=MIN:MAX",
        arguments.limits,
        "emit between these levels; one may be left out",
    )
    add(
        "--tie", "A,B,...", arguments.names_of, "put these on one dimmer, their colours as they are"
    )
    add("--color", "NAME=COLOR", arguments.named, "this colour, and only a dimmer")
    group.add_argument(
        "--kelvin",
        type=arguments.kelvin,
        action=arguments.Kelvin,
        default=[],
        metavar="NAME=2700:6500[,duv=D]",
        help="white between these, or of one temperature; so far from Planck's locus, like "
        "duv=0.003, positive towards green (default: on it)",
    )
    parser.set_defaults(duv=[])
    add(
        "--primaries",
        "NAME=COLOR,...",
        arguments.primaries,
        "what a fixture with these LEDs can mix",
    )
    add("--off", "NAME", str, "off")
    group.add_argument(
        "--prefer-current",
        type=arguments.number(may_be_zero=True),
        default=0.0,
        metavar="STRENGTH",
        help="pull to the present lighting, like 0.01: where the painting leaves it open, "
        "lights stay (default: %(default)s)",
    )
    group.add_argument(
        "--sparse",
        type=arguments.at_least(1),
        metavar="K",
        help="use the K lights that serve best, besides locked ones; the others are off",
    )
