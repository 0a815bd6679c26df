"""The parser of the command line: its sub-commands and their options."""

import argparse
from collections.abc import Callable
from dataclasses import dataclass

from lightpaint.cli.options import answer_options, arguments, console_options, option_groups
from lightpaint.cli.options.argument_order import CommandParser, Parser
from lightpaint.pipeline import Settings
from lightpaint.validation import parse_share
from lightpaint.version import __version__

#: Exit codes, for scripts.
EXIT_CODES = (
    "Exit codes: 0 done; 1 done, but a check failed (verify, --max-miss, --min-fit), wishes for "
    "planes are missed (plan, solve) or a look of a batch failed; 2 an error that you can fix, in "
    "one line; 70 a bug in lightpaint; 130 Ctrl-C, 143 SIGTERM, 129 the terminal closed."
)


@dataclass(frozen=True)
class Command:
    """A command of the command line.

    summary: what it does, as `lightpaint --help` prints it. module: the one in `cli/commands/` with
    its function, which has the name of the command. guide: the page of `docs/` on what it is for.
    """

    summary: str
    add_options: Callable[[argparse.ArgumentParser], None]
    module: str
    guide: str


def command_parser() -> argparse.ArgumentParser:
    """Return the parser of all commands."""
    parser = Parser(
        prog="lightpaint",
        description="Paint how a scene should look; get the lighting that comes closest.",
    )
    parser.add_argument("--version", action="version", version=f"lightpaint {__version__}")
    commands = parser.add_subparsers(
        dest="command", metavar="COMMAND", required=True, parser_class=CommandParser
    )
    for name, command in COMMANDS.items():
        summary = command.summary
        description = summary[0].upper() + summary[1:] + "."
        options = commands.add_parser(
            name, help=summary, description=description, epilog=EXIT_CODES
        )
        command.add_options(options)
        option_groups.add_output_mode(options)
    return parser


def _lights(parser: argparse.ArgumentParser) -> None:
    option_groups.add_scene(parser)
    option_groups.add_lights(parser)
    option_groups.add_split(parser)
    option_groups.add_fields(parser, Settings, "cd_per_unit")
    output_group = parser.add_mutually_exclusive_group()
    option_groups.add_output(
        output_group, "F.png", "picture of each light alone (default: lights.png)"
    )
    output_group.add_argument(
        "--no-sheet",
        action="store_true",
        help="list the lights without drawing them, as --json without -o does",
    )
    parser.add_argument(
        "--force",
        action="store_true",
        help="replace a picture that is not a light sheet (default: refuse)",
    )


def _basis(parser: argparse.ArgumentParser) -> None:
    option_groups.add_scene(parser)
    option_groups.add_lights(parser)
    option_groups.add_split(parser)
    option_groups.add_budget(parser)
    option_groups.add_cache(parser)
    option_groups.add_output(parser, "F.basis.exr", "file to write (default: <scene>.basis.exr)")


def _measure(parser: argparse.ArgumentParser) -> None:
    option_groups.add_scene(parser)
    parser.add_argument(
        "--planes",
        metavar="F.toml",
        help="file with the planes to measure on (default: <scene>.planes.toml)",
    )
    parser.add_argument(
        "--lighting",
        metavar="lighting.json",
        help="file that solve wrote: measure with its lights (default: as the scene has them)",
    )
    option_groups.add_lights(parser)
    option_groups.add_split(parser)
    option_groups.add_fields(parser, Settings, "cd_per_unit", default="as in the lights file")
    option_groups.add_fields(parser, Settings, "spp", default="as many as --error needs")
    _add_measuring_error(parser)
    option_groups.add_fields(parser, Settings, "seed", "use_cache")
    option_groups.add_output(parser, "DIR", "folder for tables and pictures (default: measured/)")
    option_groups.add_fields(parser, Settings, "force")


def _add_measuring_error(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--error",
        type=arguments.parsed_by(parse_share),
        metavar="SHARE",
        help="measure until the mean of each plane is known this well, at 95%%, and its points "
        "with this standard error (default: 2%%)",
    )


def _template(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "scene",
        metavar="SCENE|BASIS|LIGHTS",
        nargs="?",
        help="scene XML, a *.basis.exr, or light groups of another renderer: an EXR or a folder "
        "of them (--lights may name light groups, too)",
    )
    option_groups.add_view(parser)
    option_groups.add_lights(parser)
    option_groups.add_split(parser)
    answer_options.add_pattern(parser)
    option_groups.add_budget(parser)
    option_groups.add_fields(parser, Settings, "spectral", "observer")
    option_groups.add_cache(parser)
    option_groups.add_view_transform(parser, "srgb", "metered like a camera; 0 with --view")
    option_groups.add_output(
        parser, "DIR|F.exr", "folder to write, or a single EXR with its PNG (default: template/)"
    )
    parser.add_argument(
        "--force", action="store_true", help="replace an existing file (default: refuse)"
    )


def _demo(parser: argparse.ArgumentParser) -> None:
    option_groups.add_output(
        parser, "DIR", "folder for scene, painting and result (default: lightpaint-demo/)"
    )
    option_groups.add_fields(parser, Settings, "spp")
    option_groups.add_variant(parser)


def _solve(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "source",
        metavar="SCENE|BASIS|LIGHTS",
        help="scene XML, a *.basis.exr, or light groups of another renderer: an EXR, a folder of "
        "them, or the frames of a shot, 'shot.####.exr'",
    )
    answer_options.add_paintings(parser)
    option_groups.add_output(parser, "DIR", "result folder (default: named after the target)")
    option_groups.add_fields(parser, Settings, "force")
    parser.add_argument(
        "--table",
        choices=("short", "full"),
        default="short",
        help="short: stops and colours, of many lights only the important ones; full: all lights, "
        "with radiometric units and uncertainties (default: %(default)s)",
    )
    answer_options.add_several(parser)
    answer_options.add_variations(parser)
    answer_options.add_frames(parser)
    answer_options.add_method(parser)
    answer_options.add_verification(parser)
    option_groups.add_fields(parser, Settings, "error_bars", "report")
    answer_options.add_tolerances(parser)
    option_groups.add_fields(parser, Settings, "cd_per_unit", "planes", "watts", "ignore_wishes")
    option_groups.add_lights(parser)
    option_groups.add_split(parser)
    option_groups.add_map_size(parser)
    answer_options.add_pattern(parser)
    answer_options.add_constraints(parser)
    answer_options.add_rigging(parser)
    option_groups.add_budget(parser)
    option_groups.add_fields(parser, Settings, "error")
    option_groups.add_cache(parser)
    option_groups.add_view(parser)


def _paint(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "sources",
        metavar="SCENE|BASIS|LIGHTS",
        nargs="*",
        help="scene XML, a *.basis.exr (or several, one per view of a scene), or light groups of "
        "another renderer (--lights may name light groups, too)",
    )
    option_groups.add_output(
        parser,
        "DIR",
        "folder for session and exports (default: named after the scene)",
    )
    option_groups.add_server(parser)
    console_options.add_console(parser)
    answer_options.add_fit(parser)
    option_groups.add_view_transform(parser, "srgb", "metered like a camera; 0 with --view")
    option_groups.add_lights(parser)
    option_groups.add_split(parser)
    answer_options.add_pattern(parser)
    answer_options.add_constraints(parser)
    option_groups.add_budget(parser)
    option_groups.add_fields(
        parser, Settings, "error", "cd_per_unit", "planes", "watts", "spectral", "observer"
    )
    option_groups.add_cache(parser)
    option_groups.add_view(parser, is_repeatable=True)
    # The parser is kept for the command that answers exported paintings.
    parser.set_defaults(targets=[], masks=None, views=[], parser=parser)


def _export(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "lightings",
        metavar="lighting.json",
        nargs="+",
        help="file that solve wrote; several, in their order, for cues, or the session.db of a "
        "painter, whose looks become cues",
    )
    parser.add_argument(
        "--to",
        type=arguments.names_of,
        action="extend",
        required=True,
        metavar="csv,json,spectra,mitsuba,usd,blender,nuke,mvr,cues",
        help="one format or several. csv, json: fixtures with colour, kelvin, lumen and DMX; "
        "spectra: a table of the spectra of lamps whose emitters have some; "
        "mitsuba: a patch for the XML of the scene; usd: a layer that overrides the lights "
        "of a stage; blender: a Python script that sets lights by name; nuke: a script with the "
        "lights of --scene in Nuke's 3-D system, or one that scales the light groups of --lights; "
        "mvr: a copy of the show --rig with the colours and places of the lights; "
        "cues: a list of cues for consoles, each lighting one, for the fixtures of --rig",
    )
    source_group = parser.add_mutually_exclusive_group()
    source_group.add_argument(
        "--scene", metavar="SCENE.xml", help="scene that the lighting was solved for"
    )
    option_groups.add_luminaires(parser)
    source_group.add_argument(
        "--lights",
        dest="groups",
        metavar="FILE.exr",
        help="light groups of another renderer that the lighting was solved from: an EXR, a folder "
        "of them, or the frames of a shot",
    )
    answer_options.add_pattern(parser)
    parser.add_argument(
        "--stage",
        metavar="FILE.usd",
        help="for usd: stage whose lights the layer overrides, found by their names in the scene "
        "(default: new prims below /lights)",
    )
    console_options.add_rig(parser, required=False, purpose="for mvr and cues: ")
    console_options.add_fade(parser, "for cues: the time of each (default: none)")
    console_options.add_positions(parser, purpose="for cues: ")
    option_groups.add_map_size(parser)
    option_groups.add_view(parser)
    option_groups.add_output(
        parser, "DIR", "folder for the files (default: the folder of lighting.json)"
    )
    option_groups.add_fields(parser, Settings, "force")


def _rig(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("show", metavar="SHOW.mvr", help="show of MVR 1.4 to 1.6")
    parser.add_argument(
        "--room",
        metavar="SCENE.xml",
        help="Mitsuba scene to hang the lights in, in metres and with z up (default: the models of "
        "the show that are .glb, else a floor)",
    )
    parser.add_argument(
        "--only-lights",
        action="store_true",
        help="write a scene with nothing but the lights, to include in another",
    )
    parser.add_argument(
        "--usual-colors",
        action="store_true",
        help="take usual colours of LEDs and filters where a GDTF has none (default: an error)",
    )
    parser.add_argument(
        "--open-wheels",
        action="store_true",
        help="leave colour wheels open (default: the solve chooses their slots)",
    )
    option_groups.add_rig_reading(parser, has_zoom=True)
    option_groups.add_output(
        parser,
        "F.xml",
        "scene to write, with its lights file and meshes beside it (default: named after the show)",
    )
    parser.add_argument(
        "--force", action="store_true", help="replace existing files (default: refuse)"
    )


def _blender(parser: argparse.ArgumentParser) -> None:
    option_groups.add_output(parser, "F.zip", "file to write (default: lightpaint-blender.zip)")
    parser.add_argument(
        "--force",
        action="store_true",
        help="replace a file that is not an add-on of lightpaint (default: refuse)",
    )


def _relight(parser: argparse.ArgumentParser) -> None:
    option_groups.add_scene(parser)
    parser.add_argument(
        "lightings", metavar="lighting.json", nargs="+", help="files that solve wrote"
    )
    option_groups.add_luminaires(parser)
    option_groups.add_sampling(parser)
    option_groups.add_map_size(parser)
    option_groups.add_output(
        parser, "DIR", "result folder (default: named after the lighting's target)"
    )
    option_groups.add_fields(parser, Settings, "force")


def _plan(parser: argparse.ArgumentParser) -> None:
    option_groups.add_scene(parser)
    parser.add_argument(
        "--planes",
        metavar="FILE",
        help="measuring planes and what is wished for there (default: hall.planes.toml beside "
        "hall.xml)",
    )
    parser.add_argument(
        "--least",
        choices=("watts",),
        default="watts",
        help="what to save where wishes can be met in several ways (default: %(default)s)",
    )
    option_groups.add_lights(parser)
    option_groups.add_split(parser)
    answer_options.add_constraints(parser)
    option_groups.add_fields(parser, Settings, "watts")
    _add_measuring_error(parser)
    option_groups.add_fields(parser, Settings, "seed", "cd_per_unit")
    option_groups.add_cache(parser)
    option_groups.add_output(parser, "DIR", "result folder (default: named after the scene)")
    option_groups.add_fields(parser, Settings, "force")


def _verify(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folders", metavar="DIR", nargs="+", help="result folder of solve")
    option_groups.add_sampling(parser, default="the basis's")
    option_groups.add_variant(parser)


def _cache(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "action",
        nargs="?",
        choices=("list", "drop", "clear"),
        default="list",
        help="list the bases, drop the bases of NAME, or clear them all (default: %(default)s)",
    )
    parser.add_argument(
        "names",
        metavar="NAME",
        nargs="*",
        help="scene or file of the bases to drop, as shown by list; may be a pattern like 'hall*'",
    )


#: All commands by their names, in the order of `lightpaint --help`.
COMMANDS = {
    "demo": Command(
        "solve the example that comes with lightpaint", _demo, "render_commands", "first-look"
    ),
    "lights": Command("list the lights of a scene", _lights, "render_commands", "lights"),
    "basis": Command("render the image of each light alone", _basis, "render_commands", "solving"),
    "measure": Command(
        "measure the illuminance on planes of a scene, in lux",
        _measure,
        "plane_commands",
        "photometry",
    ),
    "template": Command(
        "render the current look as a template to paint over",
        _template,
        "render_commands",
        "targets",
    ),
    "solve": Command(
        "find the lighting that comes closest to a painting", _solve, "render_commands", "solving"
    ),
    "paint": Command(
        "paint in the browser, and see the closest lighting as you paint",
        _paint,
        "paint_command",
        "painter",
    ),
    "plan": Command(
        "find the least power that meets the wishes for measuring planes",
        _plan,
        "plane_commands",
        "photometry",
    ),
    "batch": Command(
        "solve many looks from one manifest; a stopped batch continues",
        answer_options.add_batch,
        "batch_command",
        "batch",
    ),
    "export": Command(
        "write a lighting for other programs, fixtures and consoles",
        _export,
        "program_commands",
        "formats",
    ),
    "rig": Command(
        "make a scene and a lights file of the fixtures of a show", _rig, "console_commands", "rigs"
    ),
    "send": Command(
        "send the levels of a lighting to a console, or print them",
        console_options.add_send,
        "console_commands",
        "stage",
    ),
    "listen": Command(
        "print the levels that arrive from a console or from send",
        console_options.add_listen,
        "console_commands",
        "stage",
    ),
    "blender": Command(
        "write the add-on for Blender, whose lamps follow the painter",
        _blender,
        "program_commands",
        "blender",
    ),
    "relight": Command(
        "write lightings into the scene, and render it", _relight, "render_commands", "solving"
    ),
    "verify": Command(
        "render results again, and compare them with the prediction",
        _verify,
        "render_commands",
        "solving",
    ),
    "cache": Command(
        "list or delete the bases that earlier runs kept", _cache, "program_commands", "solving"
    ),
    "doctor": Command(
        "check what works on this machine and what to install",
        option_groups.add_variant,
        "program_commands",
        "install",
    ),
}
