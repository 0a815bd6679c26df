"""The reference of the command line, written from its parsers."""

import argparse
import re
from pathlib import Path

from lightpaint.cli.options.parser import EXIT_CODES, command_parser

#: Pages on what a command is for.
GUIDES = {
    "demo": "first-look",
    "lights": "lights",
    "basis": "solving",
    "template": "targets",
    "solve": "solving",
    "paint": "painter",
    "batch": "batch",
    "export": "formats",
    "blender": "blender",
    "relight": "solving",
    "verify": "solving",
    "cache": "solving",
    "doctor": "install",
}

#: What options are for, in this order; constraints and places have groups of the parser.
THEMES = {
    "Painting": "--target --mask --layer --template --no-template --paint --view --exposure "
    "--resize --layers",
    "What the painting means": "--literal --hold --unpainted --space --colors --emitters "
    "--no-correct-noise --method --refine",
    "Lights": "--lights --group --lights-file --no-lights-file --no-group-alike --split "
    "--symmetric --sun --pattern --unit",
    "Scene and camera": "--scene --stage --sensor -D --integrator --variant",
    "How much to render": "--spp --time --error --quality --resolution --seed --exact-spp "
    "--no-cache",
    "Verification": "--verify-spp --no-verify --max-miss --min-fit",
    "Shots, looks and advice": "--frames --animate --variations --keep-going --suggest",
    "Looks": "--init --only --dry-run --retry --stop-early",
    "Machines": "--workers --cluster --shared-fs --apart --task-limit --export --log",
    "Page": "--host --port --no-browser --new",
    "Results": "--to --output --force --table --map-size --no-sheet --json --quiet --verbose "
    "--help",
}
_PLACE = {option: title for title, options in THEMES.items() for option in options.split()}

_SPECIAL = re.compile(r"([\\*`|_])")
_OPTION = re.compile(r"(?<![\w-])(--?[a-z][a-z-]*)(?![\w-])")


def write_commands(folder: Path) -> None:
    """Write a page for each command into a new folder, and one that lists them."""
    folder.mkdir(parents=True)
    parser = command_parser()
    [commands] = (x for x in parser._actions if isinstance(x, argparse._SubParsersAction))
    summaries = {x.dest: x.help or "" for x in commands._choices_actions}
    for name, command in commands.choices.items():
        (folder / f"{name}.rst").write_text(_page(name, command), encoding="utf-8")
    rows = [
        f"   * - :doc:`lightpaint {name} <{name}>`\n     - {_prose(summaries[name])}"
        for name in commands.choices
    ]
    index = [
        _title("Command line", "="),
        _prose(parser.description or ""),
        "These pages come from the parser itself. ``lightpaint COMMAND --help`` shows the same.",
        ".. list-table::\n   :widths: 35 65\n\n" + "\n".join(rows),
        _prose(EXIT_CODES),
        ".. toctree::\n   :hidden:\n\n   " + "\n   ".join(commands.choices),
    ]
    (folder / "index.rst").write_text("\n\n".join(index) + "\n", encoding="utf-8")


def _page(name: str, command: argparse.ArgumentParser) -> str:
    parts = [
        _title(f"lightpaint {name}", "="),
        _prose(command.description or ""),
        f"The guide is :doc:`/{GUIDES[name]}`.",
        f".. program:: lightpaint {name}",
    ]
    for title, actions in _themes(command).items():
        parts.append(_title(title, "-"))
        parts += [_option(action, command) for action in actions]
    return "\n\n".join(parts) + "\n"


def _themes(command: argparse.ArgumentParser) -> dict[str, list[argparse.Action]]:
    """Return the arguments of a command by what they are for."""
    titles = ["Arguments", *THEMES, *(x.title or "" for x in command._action_groups)]
    themes: dict[str, list[argparse.Action]] = {title: [] for title in titles}
    for group in command._action_groups:
        for action in group._group_actions:
            title = group.title or ""
            if not action.option_strings:
                title = "Arguments"
            elif title == "options":
                title = _PLACE[action.option_strings[-1]]
            themes[title].append(action)
    return {title.capitalize(): actions for title, actions in themes.items() if actions}


def _option(action: argparse.Action, command: argparse.ArgumentParser) -> str:
    """Return an argument or option with its values and its help."""
    value = command._get_formatter()._format_args(action, action.dest.upper())
    value = re.sub(r"\[(.*?)(?: \[.*)?\]", r"\1", value) if action.nargs != 0 else ""
    names = [f"{x} {value}".rstrip() for x in action.option_strings] or [value]
    help_text = _prose(command._get_formatter()._expand_help(action)) if action.help else ""
    choices = ""
    if action.choices and action.metavar:
        choices = "\n\n   One of " + ", ".join(f"``{x}``" for x in action.choices) + "."
    return f".. option:: {', '.join(names)}\n\n   {help_text}{choices}"


def _prose(text: str) -> str:
    """Return a sentence of the help in reStructuredText, its options as code."""
    text = _SPECIAL.sub(r"\\\1", " ".join(text.split()))
    text = _OPTION.sub(r"``\1``", text)
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", ":")) else ".")


def _title(text: str, line: str) -> str:
    return f"{text}\n{line * len(text)}"
