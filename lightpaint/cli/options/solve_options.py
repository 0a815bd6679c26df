"""The options of `lightpaint solve` for paintings, method and requirements."""

import argparse

from lightpaint.cli.options import arguments
from lightpaint.cli.options.option_groups import add_view_transform

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
    default = "that of the template or the picture, else"
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
    parser.add_argument(
        "--animate",
        action="store_true",
        help="of a shot with several painted frames: find a lighting for each, and lights that "
        "change smoothly between them (default: one lighting for all frames)",
    )
    parser.add_argument(
        "--frames",
        metavar="all|1-48x2,60",
        help="of a shot: also write these frames with the new lighting, as relit.####.exr; frames "
        "that are already written for this answer are skipped (default: none)",
    )


def add_error(parser: argparse.ArgumentParser) -> None:
    """Add the option for how sure the lights are to be."""
    parser.add_argument(
        "--error",
        type=arguments.share,
        metavar="SHARE",
        help="render until no visible light has a larger error than this, like 2%%, instead of "
        "--spp: 16 samples per pixel come first, then more where the painting needs them; "
        "--time limits the seconds",
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
    parser.add_argument(
        "--hold",
        type=arguments.number(may_be_zero=True),
        metavar="H",
        help="how strongly unpainted pixels keep the current look: the weight of all of them, "
        "relative to all painted ones; 0 ignores them (default: 4 if the current look was "
        "painted over, else 0)",
    )
    parser.add_argument(
        "--colors",
        choices=("free", "gentle", "white", "own"),
        help="colours that lights may take. free: any; gentle: their current ones, unless the "
        "painting needs others; white: 2200 to 9000 K; own: their current ones, so that lights "
        "only dim (default: gentle if the current look was painted over, or painted through a "
        "view, else free)",
    )
    parser.add_argument(
        "--space",
        choices=("linear", "display"),
        help="compare linear light, or display values through --view, as the eye sees them "
        "(default: display for paintings through a view, of 8 or 16 bits, else linear)",
    )
    parser.add_argument(
        "--literal",
        action="store_true",
        help="fit the painting exactly as it is, as in the paper: linear light, no hold, any "
        "colour and no noise correction, unless other options set these",
    )


def add_method(parser: argparse.ArgumentParser) -> None:
    """Add the options for how a painting is solved."""
    add_fit(parser)
    _add_counted_pixels(parser)
    parser.add_argument(
        "--resize",
        action="store_true",
        help="resample a target whose size differs from the basis (default: refuse it)",
    )
    _add_noise_reduction(parser)
    parser.add_argument(
        "--method",
        choices=("polished", "gauss-seidel"),
        default="polished",
        help="gauss-seidel: only the iteration of the paper, which converges slowly; if it stops "
        "before the optimum, it says so (default: %(default)s)",
    )
    parser.add_argument(
        "--sun",
        type=arguments.at_least(0, maximum=4096),
        nargs="?",
        const=72,
        metavar="N",
        help="find a sun in a sky that is split: split its texels again where the painting gains "
        "most by it, into N (72) more at most, 24 at a time (default: as the lights file says)",
    )
    parser.add_argument(
        "--suggest",
        type=arguments.at_least(1, maximum=32),
        nargs="?",
        const=3,
        default=0,
        metavar="N",
        help="suggest up to N (3) new point lights that would help most, with XML to paste, and "
        "the best turn of one spot of the scene; takes about half a minute",
    )


def _add_counted_pixels(parser: argparse.ArgumentParser) -> None:
    """Add the options for how much pixels count that nobody painted, or that show an emitter."""
    parser.add_argument(
        "--unpainted",
        type=arguments.number(may_be_zero=True),
        default=0.0,
        metavar="W",
        help="weight of each unpainted pixel, instead of --hold (default: %(default)s)",
    )
    parser.add_argument(
        "--emitters",
        choices=("auto", "count", "skip"),
        default="auto",
        help="whether painted pixels that show an emitter count. auto: only if alpha, mask or "
        "template mark them as painted; count: always, which fits emitters to their painted "
        "brightness; skip: never (default: %(default)s)",
    )


def _add_noise_reduction(parser: argparse.ArgumentParser) -> None:
    """Add the options against the noise of the basis in the answer."""
    parser.add_argument(
        "--correct-noise",
        dest="noise_correction",
        action=argparse.BooleanOptionalAction,
        help="subtract the power of the noise from the equations as far as that helps, so that "
        "the answer is closer to one from many samples (default: if the noise is known)",
    )
    parser.add_argument(
        "--refine",
        type=arguments.at_least(0, maximum=100),
        default=0,
        metavar="K",
        help="render the solved scene K times, with as many samples as the basis, and improve the"
        " answer each time (default: %(default)s)",
    )


def add_verification(parser: argparse.ArgumentParser) -> None:
    """Add the options for the verification."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument(
        "--no-verify",
        dest="verify",
        action="store_false",
        help="do not render the relit scene (default: render it with at most the samples of the "
        "basis, and only a part of the film if they do not suffice for all of it)",
    )
    group.add_argument(
        "--verify-spp",
        type=arguments.at_least(2, maximum=2**20),
        metavar="N",
        help="samples per pixel of the verification, which then covers the whole film, however "
        "long it takes",
    )


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
