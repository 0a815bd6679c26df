"""Groups of options that several commands share or records declare, and the themes of all."""

import argparse
from collections.abc import Callable
from typing import Any, get_args

from lightpaint.cli.options import arguments
from lightpaint.cli.output.vocabulary import RECORDS
from lightpaint.pipeline import Settings
from lightpaint.validation import SWITCH, Check, FieldOption, Option, Theme, options_of


def add_scene(parser: argparse.ArgumentParser) -> None:
    """Add the scene, and the options for loading it."""
    parser.add_argument("scene", metavar="SCENE", help="Mitsuba scene XML")
    add_view(parser)


def add_view(parser: argparse.ArgumentParser, *, is_repeatable: bool = False) -> None:
    """Add the options for a scene's sensor and for loading it.

    is_repeatable: whether several sensors may be given.
    """
    if is_repeatable:
        parser.add_argument(
            "-s",
            "--sensor",
            dest="sensors",
            action="append",
            default=[],
            metavar="SENSOR",
            help="sensor by index or id; repeat it for several views that share one lighting "
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
        help="set the $parameter of the scene; may be repeated",
    )
    parser.add_argument(
        "--integrator",
        metavar="PLUGIN",
        help="integrator that replaces the scene's own, for example because this Mitsuba lacks "
        "it: path, direct, or with options like path:max_depth=8; it inherits max_depth, "
        "rr_depth and hide_emitters (default: the scene's)",
    )
    add_variant(parser)


def add_lights(parser: argparse.ArgumentParser) -> None:
    """Add the options for lights and groups."""
    parser.add_argument(
        "--lights",
        type=arguments.names_of,
        action="extend",
        metavar="a,b,window_*",
        help="lights to adjust, by name or pattern; all others stay as they are (default: all)",
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
        help="file with lights, groups and constraints (default: <scene>.lights.toml if it "
        "exists). --lights replaces its list; --group adds a group, or replaces one of the "
        "same name. With a saved basis only its constraints apply",
    )
    parser.add_argument(
        "--no-lights-file",
        dest="use_lights_file",
        action="store_false",
        help="ignore the lights file beside the scene",
    )
    parser.add_argument(
        "--no-group-alike",
        dest="group_alike",
        action="store_false",
        help="adjust unnamed emitters one by one, even if more than 24 are similar (default: "
        "similar ones form one light)",
    )


def add_luminaires(parser: argparse.ArgumentParser) -> None:
    """Add the option for the luminaires of a scene."""
    parser.add_argument(
        "--lights-file",
        metavar="F.toml",
        help="file with the scene's luminaires (default: <scene>.lights.toml if it exists); all "
        "else in it is left out",
    )


def add_split(parser: argparse.ArgumentParser) -> None:
    """Add the option for lights that are images in texels."""
    parser.add_argument(
        "--split",
        type=arguments.image_size,
        action="append",
        metavar="sky=16x8",
        help="split a light (envmap, constant, area or projector) into an image of 16 by 8 texels, "
        "each a light sky.xCOLUMN.yROW; window_*=4x4 splits all of them; sky=16x8+x4.y3 splits "
        "a texel of a sky again; --split none for no images (default: as in the lights file)",
    )
    parser.add_argument(
        "--symmetric",
        action="append",
        metavar="sky",
        help="make the image of a split light equal to its mirror image, left and right (default: "
        "as in the lights file)",
    )


def add_map_size(parser: argparse.ArgumentParser) -> None:
    """Add the option for the size of written images of texels."""
    parser.add_argument(
        "--map-size",
        metavar="1024x512",
        help="size of written images of split lights, interpolated as Mitsuba does it (default: a "
        "pixel per texel; for other programs more)",
    )


def add_view_transform(parser: argparse.ArgumentParser, name: str, stops: str) -> None:
    """Add the options for the view transform. name, stops: their defaults in words."""
    parser.add_argument(
        "--view",
        metavar="VIEW",
        help="view transform of pictures of 8 or 16 bits: srgb, linear, filmic, agx, ocio or "
        f"ocio:DISPLAY/VIEW (default: {name})",
    )
    parser.add_argument(
        "--exposure",
        type=arguments.signed_number,
        metavar="STOPS",
        help=f"exposure of that view (default: {stops})",
    )


def add_variant(parser: argparse.ArgumentParser) -> None:
    """Add the option for the Mitsuba variant."""
    parser.add_argument(
        "-m",
        "--variant",
        metavar="VARIANT",
        help="Mitsuba variant (default: llvm_ad_rgb, or scalar_rgb without LLVM)",
    )


def add_sampling(parser: argparse.ArgumentParser, *, default: str = "") -> None:
    """Add the options for the samples of one picture. default: in words, if it is another."""
    add_fields(parser, Settings, "spp", default=default)
    add_fields(parser, Settings, "seed")


def add_budget(parser: argparse.ArgumentParser) -> None:
    """Add the options for the samples of a basis."""
    add_fields(parser.add_mutually_exclusive_group(), Settings, "spp", "time_s")
    add_fields(parser, Settings, "quality", "resolution", "seed")


def add_cache(parser: argparse.ArgumentParser) -> None:
    """Add the options for the cache of bases."""
    add_fields(parser, Settings, "use_cache", "exact_spp")


def add_output(parser: "argparse._ActionsContainer", metavar: str, description: str) -> None:
    """Add the option for the output."""
    parser.add_argument("-o", "--output", metavar=metavar, help=description)


def add_rig_reading(parser: argparse.ArgumentParser, *, has_zoom: bool) -> None:
    """Add the options for how a show's fixtures are read. has_zoom: whether beams matter."""
    parser.add_argument(
        "--gdtf",
        metavar="FOLDER",
        help="folder with GDTF files, which come before files of the show with the same names",
    )
    if has_zoom:
        parser.add_argument(
            "--zoom",
            type=arguments.number(" of degrees"),
            metavar="DEGREES",
            help="beam angle of all fixtures that have a zoom (default: as their files say they "
            "rest)",
        )
    parser.add_argument(
        "--pixels",
        action="store_true",
        help="make a light of each beam that has channels of its own (default: of each fixture)",
    )


def add_server(parser: argparse.ArgumentParser) -> None:
    """Add the options for the painter's address and session."""
    parser.add_argument(
        "--new",
        action="store_true",
        help="start a new session, and keep the current one under another name (default: continue"
        " the current one)",
    )
    parser.add_argument(
        "--layers",
        metavar="FILE",
        help="replace the layers by this file: layers.exr of an export, or an .ora of any "
        "program (a step that can be undone)",
    )
    parser.add_argument(
        "--port",
        type=arguments.at_least(0, maximum=65535),
        metavar="N",
        help="port of the page; 0 for any free one (default: 8421, or any free one if that is "
        "taken)",
    )
    parser.add_argument(
        "--host",
        metavar="ADDRESS",
        help="listen at this address of the machine, or at all of them (0.0.0.0), so that other "
        "machines can reach the page; anyone with its token can then paint (default: this "
        "machine only)",
    )
    parser.add_argument(
        "--no-browser",
        dest="with_browser",
        action="store_false",
        help="print the address of the page, and open no browser",
    )


def add_output_mode(parser: argparse.ArgumentParser) -> None:
    """Add the options for the output mode."""
    parser.add_argument(
        "--json",
        dest="as_json",
        action="store_true",
        help="print the results on stdout as one JSON document, for other programs",
    )
    group = parser.add_mutually_exclusive_group()
    group.add_argument(
        "-q",
        "--quiet",
        dest="is_quiet",
        action="store_true",
        help="print only results and errors, without progress and remarks",
    )
    group.add_argument(
        "-v",
        "--verbose",
        dest="is_verbose",
        action="store_true",
        help="also print settings, and the time of each stage",
    )
    group.add_argument(
        "--json-progress",
        action="store_true",
        help="print progress, remarks and errors on stderr as one JSON object a line",
    )


def add_fields(
    parser: "argparse._ActionsContainer", record: type, *names: str, default: str = ""
) -> None:
    """Add the options of fields of `record`; their values go by the names of the fields.

    default: the default in words, if this command has another.
    """
    for name in names:
        declared = options_of(record)[name]
        option, words = declared.option, default or declared.option.default
        parser.add_argument(
            option.name,
            dest=name,
            default=declared.default,
            help=option.help + (f" (default: {words})" if words else ""),
            **_value(declared),
        )


def _value(declared: FieldOption) -> dict[str, Any]:
    """Return the arguments of argparse for the value of an option."""
    option, check = declared.option, declared.check
    if check is SWITCH:
        if declared.default is None:
            return {"action": argparse.BooleanOptionalAction}
        return {"action": "store_false" if declared.default else "store_true"}
    if "enum" in check.schema:
        return {"choices": check.schema["enum"]}
    value = {"type": _parser_of(option, check), "metavar": option.metavar}
    return value if option.bare is None else {**value, "nargs": "?", "const": option.bare}


def _parser_of(option: Option, check: Check) -> Callable[[str], Any]:
    """Return the function that makes a value of a text, as the check of its field says."""
    if option.parse is not None:
        return arguments.parsed_by(option.parse)
    schema = check.schema
    if schema.get("type") == "integer":
        least = schema["minimum"] if option.least is None else option.least
        return arguments.at_least(least, maximum=schema.get("maximum"))
    if schema.get("type") == "number":
        quantity = f" of {check.unit}" if check.unit else ""
        return arguments.number(quantity, may_be_zero="minimum" in schema)
    return str


#: Options that no field of a record declares, by theme; the options of further groups of a parser
#: keep their group.
OTHER_OPTIONS: dict[Theme, str] = {
    "Painting": "--target --mask --layer --template --no-template --paint --view --exposure "
    "--layers",
    "Lights": "--least --lights --group --lights-file --no-lights-file --no-group-alike --split "
    "--symmetric --pattern",
    "Scene and camera": "--scene --stage --sensor -D --integrator --variant --room --rig --gdtf "
    "--zoom --pixels --only-lights --usual-colors --open-wheels --planes --lighting",
    "Verification": "--max-miss --min-fit",
    "Shots, looks and advice": "--frames --variations --keep-going",
    "Looks": "--init --only --dry-run",
    "Machines": "--export --log",
    "Console": "--from --universe --priority --fps --fade --until --blackout --interface --seconds "
    "--positions",
    "Page": "--host --port --no-browser --new",
    "Results": "--to --dump --output --table --map-size --no-sheet --json --quiet --verbose "
    "--json-progress --help",
}
_THEME_OF: dict[str, str] = {
    **{name: theme for theme, names in OTHER_OPTIONS.items() for name in names.split()},
    **{x.option.name: x.option.theme for record in RECORDS for x in options_of(record).values()},
}

#: Options up to which a help is one list.
FEW_OPTIONS = 12


def by_theme(command: argparse.ArgumentParser) -> dict[str, list[argparse.Action]]:
    """Return the arguments of a command by what they are for; only themes that it has.

    Constraints, places and other groups of the parser come behind the themes.
    """
    titles = ["Arguments", *get_args(Theme), *(_title(group) for group in command._action_groups)]
    themes: dict[str, list[argparse.Action]] = {title: [] for title in titles}
    for group in command._action_groups:
        for action in group._group_actions:
            title = _title(group)
            if not action.option_strings:
                title = "Arguments"
            elif group is command._optionals:
                [title] = [_THEME_OF[x] for x in action.option_strings if x in _THEME_OF]
            themes[title].append(action)
    return {title: actions for title, actions in themes.items() if actions}


def themed_help(command: argparse.ArgumentParser) -> str:
    """Return the help of a command, its options by theme unless they are few."""
    options = [action for action in command._actions if action.option_strings]
    if len(options) <= FEW_OPTIONS:
        return argparse.ArgumentParser.format_help(command)
    formatter, themes = command._get_formatter(), by_theme(command)
    paths = [formatter._format_args(x, x.dest) for x in themes.get("Arguments", [])]
    formatter.add_usage(" ".join([command.prog, "[OPTION ...]", *paths]), [], [])
    formatter.add_text(command.description)
    descriptions = {_title(group): group.description for group in command._action_groups}
    for title, actions in themes.items():
        formatter.start_section(title)
        formatter.add_text(descriptions.get(title))
        formatter.add_arguments(actions)
        formatter.end_section()
    formatter.add_text(command.epilog)
    return formatter.format_help()


def _title(group: argparse._ArgumentGroup) -> str:
    return (group.title or "").capitalize()
