"""The options of commands, in groups that several of them share."""

import argparse

from lightpaint.cli.options import arguments


def add_scene(parser: argparse.ArgumentParser) -> None:
    """The scene, and how it is loaded."""
    parser.add_argument("scene", metavar="SCENE", help="Mitsuba scene XML")
    add_view(parser)


def add_view(parser: argparse.ArgumentParser, *, several: bool = False) -> None:
    """What a scene is seen through, and loaded with. several: whether by several sensors."""
    if several:
        parser.add_argument(
            "-s",
            "--sensor",
            dest="sensors",
            action="append",
            default=[],
            metavar="SENSOR",
            help="sensor by index or id; give it once for each view that one lighting is to serve "
            "(default: the first)",
        )
    else:
        parser.add_argument(
            "-s", "--sensor", metavar="SENSOR", help="sensor by index or id (default: the first)"
        )
    parser.add_argument(
        "-D",
        dest="parameters",
        type=arguments.key_value,
        action="append",
        default=[],
        metavar="key=value",
        help="set a $parameter of the scene; may be repeated",
    )
    parser.add_argument(
        "--integrator",
        metavar="PLUGIN",
        help="integrator to render with instead of the scene's own, which Mitsuba may lack: path, "
        "direct, or with options path:max_depth=8; what the scene says of max_depth, rr_depth "
        "and hide_emitters stays (default: the scene's)",
    )
    add_variant(parser)


def add_lights(parser: argparse.ArgumentParser) -> None:
    """Which lights are adjusted, and which go together."""
    parser.add_argument(
        "--lights",
        type=arguments.names_of,
        action="extend",
        metavar="a,b,window_*",
        help="lights to adjust, by name or pattern; the others stay as they are (default: all)",
    )
    parser.add_argument(
        "--group",
        dest="groups",
        type=arguments.group,
        action="append",
        default=[],
        metavar="name=a,b,c",
        help="adjust these emitters, by name or pattern, as one light; may be repeated",
    )
    parser.add_argument(
        "--lights-file",
        metavar="F.toml",
        help="lights, groups and constraints (default: <scene>.lights.toml where there is one); "
        "--lights replaces its list, --group adds to its groups or replaces the one of that "
        "name; with a saved basis only its constraints apply",
    )
    parser.add_argument(
        "--no-lights-file",
        dest="use_lights_file",
        action="store_false",
        help="leave the lights file beside the scene alone",
    )
    parser.add_argument(
        "--no-group-alike",
        dest="group_alike",
        action="store_false",
        help="adjust emitters without names one by one, also where more than 24 are alike "
        "(default: those are one light)",
    )


def add_view_transform(parser: argparse.ArgumentParser, name: str, stops: str) -> None:
    """How a picture is seen. name, stops: what they are where nobody says."""
    parser.add_argument(
        "--view",
        metavar="VIEW",
        help="view transform of pictures of 8 or 16 bits: srgb, linear, filmic, agx, ocio or "
        f"ocio:DISPLAY/VIEW (default: {name})",
    )
    parser.add_argument(
        "--exposure",
        type=float,
        metavar="STOPS",
        help=f"exposure of that view (default: {stops})",
    )


def add_variant(parser: argparse.ArgumentParser) -> None:
    """What Mitsuba renders with."""
    parser.add_argument(
        "-m",
        "--variant",
        metavar="VARIANT",
        help="Mitsuba variant (default: llvm_ad_rgb, or scalar_rgb without LLVM)",
    )


def add_sampling(parser: argparse.ArgumentParser, *, default: str = "the scene's") -> None:
    """How well one picture is rendered."""
    add_spp(parser, default)
    add_seed(parser)


def add_budget(parser: argparse.ArgumentParser) -> None:
    """What a basis may cost."""
    group = parser.add_mutually_exclusive_group()
    add_spp(group, "the scene's")
    group.add_argument(
        "--time",
        dest="time_s",
        type=arguments.number(" of seconds"),
        metavar="SECONDS",
        help="instead: render the basis for so long, besides what earlier runs have kept; "
        "compiling counts, the verification does not",
    )
    parser.add_argument(
        "--quality",
        choices=("preview", "final"),
        help="preview: 64 samples per pixel on some 30,000 pixels, each a block of the film's; "
        "final: 512 on the whole film; --spp, --time and --resolution go before",
    )
    add_resolution(parser)
    add_seed(parser)


def add_spp(parser: "argparse._ActionsContainer", default: str) -> None:
    """How many samples."""
    parser.add_argument(
        "--spp",
        type=arguments.at_least(2, most=2**20),
        metavar="N",
        help=f"samples per pixel (default: {default})",
    )


def add_seed(parser: argparse.ArgumentParser) -> None:
    """Which samples."""
    parser.add_argument(
        "--seed",
        type=arguments.at_least(0),
        default=0,
        metavar="S",
        help="random seed (default: %(default)s)",
    )


def add_resolution(parser: argparse.ArgumentParser) -> None:
    """On how small a film."""
    parser.add_argument(
        "--resolution",
        metavar="1/N|WxH",
        help="render with a pixel for each square block of the film's pixels, like 1/4 or 320x180; "
        "what makes no whole block at the right and at the bottom is left out (default: the whole "
        "film)",
    )


def add_cache(parser: argparse.ArgumentParser) -> None:
    """Whether bases are kept."""
    parser.add_argument(
        "--no-cache",
        dest="use_cache",
        action="store_false",
        help="neither take nor keep the basis for later runs (default: do both)",
    )
    parser.add_argument(
        "--exact-spp",
        action="store_true",
        help="take just as many samples per pixel as are asked for, even where a basis with more "
        "is kept, and leave that one kept (default: take what is kept)",
    )


def add_unit(parser: argparse.ArgumentParser) -> None:
    """What a number stands for."""
    parser.add_argument(
        "--unit",
        dest="cd_per_unit",
        type=arguments.number(" of cd/m²"),
        metavar="CD/M2",
        help="cd/m² that a radiance of 1 in the scene stands for, to have lumen, candela and lux "
        "(default: numbers in proportion, without a unit)",
    )


def add_output(parser: "argparse._ActionsContainer", metavar: str, about: str) -> None:
    """Where results go."""
    parser.add_argument("-o", "--output", metavar=metavar, help=about)


def add_server(parser: argparse.ArgumentParser) -> None:
    """Where the painter's page is, and which session it shows."""
    parser.add_argument(
        "--new",
        action="store_true",
        help="start afresh; the session that is there is kept under another name (default: go on)",
    )
    parser.add_argument(
        "--port",
        type=arguments.at_least(0, most=65535),
        metavar="N",
        help="where the page is served; 0 for any (default: 8421, or any if that is taken)",
    )
    parser.add_argument(
        "--host",
        metavar="ADDRESS",
        help="listen at this address of the machine, or at all of them (0.0.0.0), so that others "
        "can reach the page: whoever has its token can paint (default: nobody but this machine)",
    )
    parser.add_argument(
        "--no-browser",
        dest="with_browser",
        action="store_false",
        help="only say where the page is",
    )


def add_force(parser: argparse.ArgumentParser) -> None:
    """What may be given up."""
    parser.add_argument(
        "--force",
        action="store_true",
        help="replace results of something else, or that were changed by hand (default: refuse)",
    )


def add_manner(parser: argparse.ArgumentParser) -> None:
    """How results are said, and what beside them."""
    parser.add_argument(
        "--json",
        dest="as_json",
        action="store_true",
        help="print the results as one JSON document on stdout, for other programs",
    )
    group = parser.add_mutually_exclusive_group()
    group.add_argument(
        "-q",
        "--quiet",
        dest="is_quiet",
        action="store_true",
        help="neither progress nor remarks: only results and errors",
    )
    group.add_argument(
        "-v",
        "--verbose",
        dest="is_verbose",
        action="store_true",
        help="also what was used, and how long each stage took",
    )
