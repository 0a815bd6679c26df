"""Themes of options, by which `--help` and the reference of the commands show them."""

import argparse
from typing import get_args

from lightpaint.cli.output.vocabulary import RECORDS
from lightpaint.field_options import Theme, options_of

#: Options that no field of a record declares, by theme; those of further groups of a parser keep
#: their group.
OTHER_OPTIONS: dict[Theme, str] = {
    "Painting": "--target --mask --layer --template --no-template --paint --view --exposure "
    "--layers",
    "Lights": "--lights --group --lights-file --no-lights-file --no-group-alike --split "
    "--symmetric --pattern",
    "Scene and camera": "--scene --stage --sensor -D --integrator --variant",
    "Verification": "--max-miss --min-fit",
    "Shots, looks and advice": "--frames --variations --keep-going",
    "Looks": "--init --only --dry-run",
    "Machines": "--export --log",
    "Page": "--host --port --no-browser --new",
    "Results": "--to --output --table --map-size --no-sheet --json --quiet --verbose "
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
