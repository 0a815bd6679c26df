"""The reference of the command line, written from its parsers."""

import argparse
import re
import tomllib
from pathlib import Path

from lightpaint.cli.options.option_groups import by_theme
from lightpaint.cli.options.parser import COMMANDS, EXIT_CODES, command_parser

_SPECIAL = re.compile(r"([\\*`|_])")
_OPTION = re.compile(r"(?<![\w-])(--?[a-z][a-z-]*)(?![\w-])")

#: What `--json` prints, by command, in reStructuredText.
DOCUMENTS: dict[str, str] = tomllib.loads(
    Path(__file__).with_name("json_documents.toml").read_text("utf-8")
)


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
        f"The guide is :doc:`/{COMMANDS[name].guide}`.",
        f".. program:: lightpaint {name}",
    ]
    for title, actions in by_theme(command).items():
        parts.append(_title(title, "-"))
        parts += [_option(action, command) for action in actions]
    parts += [_title("What --json prints", "-"), DOCUMENTS[name]]
    return "\n\n".join(parts) + "\n"


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
