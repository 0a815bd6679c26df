"""What the command line understands: one sub-command per room, and their options."""

import argparse
from collections.abc import Callable
from typing import Any, NoReturn

from lightpaint.version import __version__


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message} (see {self.prog} --help)\n")


def command_parser() -> argparse.ArgumentParser:
    """The parser of all commands."""
    parser = _Parser(
        prog="lightpaint",
        description="Paint how a scene should look; get the lighting that comes closest.",
    )
    parser.add_argument("--version", action="version", version=f"lightpaint {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)

    lights = _command(commands, "lights", "list the lights of a scene")
    _add_scene(lights)
    _add_lights(lights)
    _add_unit(lights)
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
    _add_view_transform(template, "srgb", "one that shows something; 0 where --view is given")
    _add_output(
        template, "DIR|F.exr", "folder to write, or only an EXR and a PNG (default: template/)"
    )
    template.add_argument(
        "--force", action="store_true", help="replace an existing file (default: refuse)"
    )

    solve = _command(commands, "solve", "find the lighting that comes closest to a painting")
    solve.add_argument(
        "source",
        metavar="SCENE|BASIS|LIGHTS",
        help="scene XML, a *.basis.exr, or light groups of another "
        "renderer: an EXR or a folder of them",
    )
    solve.add_argument(
        "targets", metavar="TARGET", nargs="*", help="painting: EXR, PNG, TIFF, JPEG, ..."
    )
    solve.add_argument(
        "--target",
        dest="views",
        type=_sensor_target,
        action="append",
        default=[],
        metavar="SENSOR=TARGET",
        help="instead of TARGET: painting of the view through that sensor; give it once for each "
        "view, and one lighting answers all of them",
    )
    _add_output(solve, "DIR", "result folder (default: named after the target)")
    solve.add_argument(
        "--mask",
        dest="masks",
        action="append",
        metavar="MASK",
        help="picture of what counts, instead of the alpha or what differs from the template; once "
        "for all targets, or once for each in order",
    )
    solve.add_argument("--layer", metavar="NAME", help="layer, part or view of an EXR to read")
    said = "what the template or the picture says, else"
    _add_view_transform(solve, f"{said} srgb", f"{said} 0")
    solve.add_argument(
        "--template",
        metavar="DIR",
        help="what was painted on, so that only what differs from it counts (default: the template "
        "beside the painting, or ./template)",
    )
    solve.add_argument(
        "--no-template",
        dest="find_template",
        action="store_false",
        help="do not look for a template",
    )
    solve.add_argument(
        "--paint",
        choices=("look", "light"),
        default="look",
        help="what the brush puts down: the look of a surface, or the light that falls on it, "
        "which is multiplied by what the surface reflects (default: %(default)s)",
    )
    solve.add_argument(
        "--unpainted",
        type=_number(may_be_zero=True),
        default=0.0,
        metavar="W",
        help="weight of unpainted pixels against the current look (default: %(default)s)",
    )
    solve.add_argument(
        "--resize", action="store_true", help="resample a target of another size (default: refuse)"
    )
    _add_unit(solve)
    solve.add_argument(
        "--correct-noise",
        dest="noise_correction",
        action="store_true",
        help="take half of the noise's power, as the halves of the samples show it, out of the "
        "equations: closer to the answer of many samples at low --spp, and costs next to nothing",
    )
    solve.add_argument(
        "--refine",
        type=_at_least(0, most=100),
        default=0,
        metavar="K",
        help="times to render the scene as solved, with as many samples as the basis, and improve "
        "the answer by what that shows (default: %(default)s)",
    )
    solve.add_argument(
        "--space",
        choices=("linear", "display"),
        default="linear",
        help="linear: come closest in light; display: in what the eye sees of it through --view, "
        "where dark parts count for more (default: %(default)s)",
    )
    solve.add_argument(
        "--method",
        choices=("polished", "gauss-seidel"),
        default="polished",
        help="gauss-seidel: the paper's iteration alone, which comes late to the optimum or runs "
        "out of sweeps, and says so (default: %(default)s)",
    )
    solve.add_argument(
        "--suggest",
        type=_at_least(1),
        nargs="?",
        const=3,
        default=0,
        metavar="N",
        help="look for up to N (3) further point lights that would help most, with XML to paste; "
        "takes some ten seconds",
    )
    _add_lights(solve)
    solve.add_argument(
        "--pattern",
        metavar="'Light_{name}'",
        help="how the layers, parts or files of light groups are named, where no renderer that "
        "is known names them so",
    )
    _add_constraints(solve)
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


def _add_constraints(parser: argparse.ArgumentParser) -> None:
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

    add("--lock", "NAME[=LEVEL]", _lock, "keep it as it is, or at a level, or '3200K 40%%'")
    add("--limit", "NAME=MIN:MAX", _limits, "emit between these levels; one may be left out")
    add("--tie", "A,B,...", _names, "put these on one dimmer, their colours as they are")
    add("--color", "NAME=COLOR", _named, "this colour, and only a dimmer")
    group.add_argument(
        "--kelvin",
        type=_kelvin,
        action=_Kelvin,
        default=[],
        metavar="NAME=2700:6500[,duv=D]",
        help="white between these, or of one temperature; so far from Planck's locus, like "
        "duv=0.003, positive towards green (default: on it)",
    )
    parser.set_defaults(duv=[])
    add("--primaries", "NAME=COLOR,...", _primaries, "what a fixture with these LEDs can mix")
    add("--off", "NAME", str, "off")
    group.add_argument(
        "--prefer-current",
        type=_number(may_be_zero=True),
        default=0.0,
        metavar="STRENGTH",
        help="pull to the present lighting, like 0.01: where the painting leaves it open, "
        "lights stay (default: %(default)s)",
    )
    group.add_argument(
        "--sparse",
        type=_at_least(1),
        metavar="K",
        help="use the K lights that serve best, besides locked ones; the others are off",
    )


def _add_view_transform(parser: argparse.ArgumentParser, name: str, stops: str) -> None:
    """name, stops: what they are where nobody says."""
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
        type=_number(" of seconds"),
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


def _add_unit(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--unit",
        dest="cd_per_unit",
        type=_number(" of cd/m²"),
        metavar="CD/M2",
        help="cd/m² that a radiance of 1 in the scene stands for, to have lumen, candela and lux "
        "(default: numbers in proportion, without a unit)",
    )


def _add_output(parser: argparse.ArgumentParser, metavar: str, about: str) -> None:
    parser.add_argument("-o", "--output", metavar=metavar, help=about)


def _key_value(text: str) -> tuple[str, str]:
    key, equals, value = text.partition("=")
    if not key or not equals:
        raise argparse.ArgumentTypeError(f"{text!r} is not key=value")
    return key, value


def _sensor_target(text: str) -> tuple[str, str]:
    sensor, _, target = text.partition("=")
    if not sensor or not target:
        raise argparse.ArgumentTypeError(f"{text!r} is not SENSOR=TARGET")
    return sensor, target


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


def _named(text: str) -> tuple[str, Any]:
    name, equals, value = text.rpartition("=")
    if not name.strip() or not equals or not value.strip():
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=VALUE")
    return name.strip(), _value(value)


def _value(text: str) -> Any:
    """Three numbers with commas; anything else as it is."""
    parts = text.strip().split(",")
    try:
        return [float(part) for part in parts] if len(parts) > 1 else text.strip()
    except ValueError:
        return text.strip()


def _lock(text: str) -> tuple[str, Any]:
    return _named(text) if "=" in text else (text.strip(), True)


def _limits(text: str) -> tuple[str, dict[str, Any]]:
    if "=" not in text:
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=MIN:MAX")
    name, value = _named(text)
    least, colon, most = str(text.rpartition("=")[2]).partition(":")
    if not colon:
        raise argparse.ArgumentTypeError(f"{value!r} is not MIN:MAX; one of them may be left out")
    return name, {k: _value(v) for k, v in (("min", least), ("max", most)) if v.strip()}


def _kelvin(text: str) -> tuple[str, list[float], float | None]:
    """Name, temperatures, and Duv if that was given."""
    try:
        told, comma, away = text.partition(",")
        key, _, duv = away.partition("=")
        name, value = _named(told)
        ends = [float(end.strip().upper().removesuffix("K")) for end in value.split(":")]
        if comma and key.strip() != "duv":
            raise ValueError(key)
        return name, ends, float(duv) if comma else None
    except (ValueError, AttributeError):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not NAME=2700:6500 or NAME=3200, with or without ,duv=0.003 behind"
        ) from None


class _Kelvin(argparse.Action):
    """Puts temperatures to `kelvin` and what they are away from Planck's locus to `duv`."""

    def __call__(self, _parser: Any, options: argparse.Namespace, given: Any, *_: Any) -> None:
        name, ends, duv = given
        options.kelvin = [*options.kelvin, (name, ends)]
        # What is said last of a light holds: also that it is on the locus.
        options.duv = [entry for entry in options.duv if entry[0] != name]
        options.duv += [] if duv is None else [(name, duv)]


def _primaries(text: str) -> tuple[str, list[str]]:
    name, _ = _named(text)
    return name, _names(text.rpartition("=")[2])


class _at_least:  # noqa: N801 (used as a function)
    """An integer no smaller than a bound, and maybe no larger than another."""

    def __init__(self, bound: int, *, most: int | None = None) -> None:
        self.bound, self.most = bound, most

    def __call__(self, text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = self.bound - 1
        if value < self.bound:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number >= {self.bound}")
        if self.most is not None and value > self.most:
            raise argparse.ArgumentTypeError(f"{text!r} is too much: at most {self.most}")
        return value


class _number:  # noqa: N801 (used as a function)
    """A finite number > 0, or >= 0. about: what it is a number of, with a space before."""

    def __init__(self, about: str = "", *, may_be_zero: bool = False) -> None:
        self.about, self.may_be_zero = about, may_be_zero

    def __call__(self, text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = -1.0
        if not (0 < value < float("inf") or (self.may_be_zero and value == 0)):
            bound = ">= 0" if self.may_be_zero else "> 0"
            raise argparse.ArgumentTypeError(f"{text!r} is not a number{self.about} {bound}")
        return value
