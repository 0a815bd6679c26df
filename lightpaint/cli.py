"""The command line: one sub-command per room. Parses, calls, prints; no more.

Results go to stdout, progress and remarks to stderr. Exit code 0: done; 1: `verify` found
a disagreement; 2: something the user can mend, said in one line; 130: interrupted.
"""

import argparse
import io
import sys
from collections.abc import Sequence
from typing import NoReturn

from lightpaint.errors import LightpaintError
from lightpaint.version import __version__


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    for stream in (sys.stdout, sys.stderr):
        # A terminal that lacks a character shows another, and loses no result over it.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    options = _parser().parse_args(given)
    try:
        # What a command needs is imported when it runs: --help answers at once.
        from lightpaint import commands

        return int(getattr(commands, options.command)(options, given))
    except LightpaintError as error:
        print(f"lightpaint {options.command}: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt as interrupt:
        how_to_go_on = f": {interrupt}" if str(interrupt) else ""
        print(f"lightpaint {options.command}: interrupted{how_to_go_on}", file=sys.stderr)
        return 130


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message} (see {self.prog} --help)\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="lightpaint",
        description="Paint how a scene should look; get the lighting that comes closest.",
    )
    parser.add_argument("--version", action="version", version=f"lightpaint {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)

    lights = _command(commands, "lights", "list the lights of a scene")
    _add_scene(lights)
    _add_lights(lights)
    lights.add_argument("--json", action="store_true", help="as JSON, for other programs")

    basis = _command(commands, "basis", "render the image of each light alone")
    _add_scene(basis)
    _add_lights(basis)
    _add_budget(basis)
    _add_cache(basis)
    _add_output(basis, "F.basis.exr", "file to write (default: <scene>.basis.exr)")

    template = _command(commands, "template", "render the current look, to paint over")
    _add_scene(template)
    _add_sampling(template)
    _add_resolution(template)
    _add_output(template, "F.exr", "file to write, a PNG beside it (default: template.exr)")
    template.add_argument(
        "--force", action="store_true", help="replace an existing file (default: refuse)"
    )

    solve = _command(commands, "solve", "find the lighting that comes closest to a painting")
    solve.add_argument("source", metavar="SCENE|BASIS", help="scene XML, or a *.basis.exr")
    solve.add_argument("targets", metavar="TARGET", nargs="+", help="painted EXR")
    _add_output(solve, "DIR", "result folder (default: named after the target)")
    solve.add_argument(
        "--mask",
        dest="masks",
        action="append",
        metavar="M.exr",
        help="what counts, instead of the alpha; once for all targets, or once for each in order",
    )
    solve.add_argument(
        "--unpainted",
        type=_weight,
        default=0.0,
        metavar="W",
        help="weight of unpainted pixels against the current look (default: %(default)s)",
    )
    solve.add_argument(
        "--resize", action="store_true", help="resample a target of another size (default: refuse)"
    )
    solve.add_argument(
        "--correct-noise",
        dest="noise_correction",
        action="store_true",
        help="take half of the noise's power, as the halves of the samples show it, out of the "
        "equations: closer to the answer of many samples at low --spp, and costs next to nothing",
    )
    solve.add_argument(
        "--refine",
        type=_at_least(0),
        default=0,
        metavar="K",
        help="times to render the scene as solved, with as many samples as the basis, and improve "
        "the answer by what that shows (default: %(default)s)",
    )
    _add_lights(solve)
    _add_budget(solve)
    _add_cache(solve)
    _add_view(solve)

    relight = _command(commands, "relight", "write lightings into the scene and render it")
    _add_scene(relight)
    relight.add_argument("lightings", metavar="lighting.json", nargs="+", help="as solve left them")
    _add_sampling(relight)
    _add_output(relight, "DIR", "result folder (default: named after the lighting's target)")

    verify = _command(commands, "verify", "render results anew and compare with the prediction")
    verify.add_argument("folders", metavar="DIR", nargs="+", help="result folder of solve")
    _add_sampling(verify, default="the basis's")
    _add_variant(verify)

    cache = _command(commands, "cache", "list or delete the bases kept from earlier runs")
    cache.add_argument(
        "action",
        nargs="?",
        choices=("list", "clear"),
        default="list",
        help="what to do (default: %(default)s)",
    )

    doctor = _command(commands, "doctor", "say what works here and what to install")
    _add_variant(doctor)
    return parser


def _command(commands: "argparse._SubParsersAction[_Parser]", name: str, about: str) -> _Parser:
    return commands.add_parser(name, help=about, description=about[0].upper() + about[1:] + ".")


def _add_scene(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", metavar="SCENE", help="Mitsuba scene XML")
    _add_view(parser)


def _add_view(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "-s", "--sensor", metavar="SENSOR", help="sensor by index or id (default: the first)"
    )
    parser.add_argument(
        "-D",
        dest="parameters",
        type=_key_value,
        action="append",
        default=[],
        metavar="key=value",
        help="set a $parameter of the scene; may be repeated",
    )
    _add_variant(parser)


def _add_lights(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--lights",
        type=_names,
        action="extend",
        metavar="a,b,window_*",
        help="lights to adjust, by name or pattern; the others stay as they are (default: all)",
    )
    parser.add_argument(
        "--group",
        dest="groups",
        type=_group,
        action="append",
        default=[],
        metavar="name=a,b,c",
        help="adjust these emitters, by name or pattern, as one light; may be repeated",
    )
    parser.add_argument(
        "--lights-file",
        metavar="F.toml",
        help="lights and groups (default: <scene>.lights.toml where there is one); --lights "
        "replaces its list, --group adds to its groups or replaces the one of that name",
    )
    parser.add_argument(
        "--no-lights-file",
        dest="use_lights_file",
        action="store_false",
        help="leave the lights file beside the scene alone",
    )


def _add_variant(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "-m",
        "--variant",
        metavar="VARIANT",
        help="Mitsuba variant (default: llvm_ad_rgb, or scalar_rgb without LLVM)",
    )


def _add_sampling(parser: argparse.ArgumentParser, *, default: str = "the scene's") -> None:
    _add_spp(parser, default)
    _add_seed(parser)


def _add_budget(parser: argparse.ArgumentParser) -> None:
    """What a basis may cost."""
    group = parser.add_mutually_exclusive_group()
    _add_spp(group, "the scene's")
    group.add_argument(
        "--time",
        dest="time_s",
        type=_seconds,
        metavar="SECONDS",
        help="instead: render the basis for so long, besides what earlier runs have kept; "
        "compiling counts, the verification does not",
    )
    parser.add_argument(
        "--quality",
        choices=("preview", "final"),
        help="preview: 64 samples per pixel on a film of some 30,000 pixels; final: 512 on the "
        "whole film; --spp, --time and --resolution go before",
    )
    _add_resolution(parser)
    _add_seed(parser)


def _add_spp(parser: "argparse._ActionsContainer", default: str) -> None:
    parser.add_argument(
        "--spp", type=_at_least(2), metavar="N", help=f"samples per pixel (default: {default})"
    )


def _add_seed(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--seed",
        type=_at_least(0),
        default=0,
        metavar="S",
        help="random seed (default: %(default)s)",
    )


def _add_resolution(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--resolution",
        metavar="1/N|WxH",
        help="render on a film reduced by a whole factor, like 1/4 or 320x180; the verification "
        "of solve keeps the whole film (default: the whole film)",
    )


def _add_cache(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--no-cache",
        dest="cache",
        action="store_false",
        help="neither take nor keep the basis for later runs (default: do both)",
    )


def _add_output(parser: argparse.ArgumentParser, metavar: str, about: str) -> None:
    parser.add_argument("-o", "--output", metavar=metavar, help=about)


def _key_value(text: str) -> tuple[str, str]:
    key, equals, value = text.partition("=")
    if not key or not equals:
        raise argparse.ArgumentTypeError(f"{text!r} is not key=value")
    return key, value


def _names(text: str) -> list[str]:
    names = [name.strip() for name in text.split(",")]
    if not all(names):
        raise argparse.ArgumentTypeError(f"{text!r} is not a list of names, a,b,c")
    return names


def _group(text: str) -> tuple[str, list[str]]:
    name, equals, members = text.partition("=")
    if not name.strip() or not equals:
        raise argparse.ArgumentTypeError(f"{text!r} is not name=a,b,c")
    return name.strip(), _names(members)


class _at_least:  # noqa: N801 (used as a function)
    """An integer no smaller than a bound."""

    def __init__(self, bound: int) -> None:
        self.bound = bound

    def __call__(self, text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = self.bound - 1
        if value < self.bound:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number >= {self.bound}")
        return value


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of seconds > 0")
    return value


def _weight(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number >= 0")
    return value


if __name__ == "__main__":
    sys.exit(main())
