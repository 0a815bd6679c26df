"""The options of `lightpaint solve` for paintings, method and requirements."""

import argparse

from lightpaint.cli.options import arguments
from lightpaint.cli.options.option_groups import add_fields, add_view_transform
from lightpaint.pipeline.job.settings import Settings

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
    add_fields(parser, Settings, "method", "sun", "suggest")


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
