"""Reordering of arguments, so that options may stand anywhere on the line.

argparse gives all positional arguments to the first run of words, and the next word to an option
with an optional value. Here options come first, each with its value, then the paths; `--` ends the
options, as usual.
"""

import argparse
import difflib
import re
import shlex
from collections.abc import Iterator, Sequence
from typing import Any, NoReturn

from lightpaint.cli.options.option_groups import themed_help
from lightpaint.cli.output import lines

_NUMBER = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?")


class Parser(argparse.ArgumentParser):
    """A parser that reports errors in one line."""

    def error(self, message: str) -> NoReturn:
        lines.err(f"{self.prog}: {message} (see {self.prog} --help)")
        self.exit(2)

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        try:
            super()._check_value(action, value)
        except argparse.ArgumentError as error:
            names = [str(x) for x in action.choices or ()]
            for similar in difflib.get_close_matches(str(value), names, n=1):
                error.message += f"; did you mean {similar!r}?"
            raise

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse arguments as argparse does; explain where an option before the command belongs."""
        first = args[0] if args else ""
        if first.startswith("--") and _option(self, first.partition("=")[0]) is None:
            self.error(f"the command comes first: {self.prog} COMMAND {first}")
        return super().parse_known_args(args, namespace)


class CommandParser(Parser):
    """The parser of one command: options may stand before, between and after its paths."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse arguments as argparse does, but report unknown ones with this command's help."""
        words = in_order(self, args or ())
        options, unknown_words = argparse.ArgumentParser.parse_known_args(self, words, namespace)
        if unknown_words:
            hint = _similar_option(self, unknown_words[0])
            self.error(f"unrecognized arguments: {' '.join(unknown_words)}{hint}")
        return options, unknown_words

    def format_help(self) -> str:
        """Return the help, with many options by what they are for."""
        return themed_help(self)


def _similar_option(parser: argparse.ArgumentParser, word: str) -> str:
    """Return `; did you mean --resolution?` for a misspelled option; "" if none resembles it."""
    if not word.startswith("--"):
        return ""
    # Without the dashes, which all of them have in common.
    names = [name[2:] for name in parser._option_string_actions if name.startswith("--")]
    similar_names = difflib.get_close_matches(word[2:].partition("=")[0], names, n=1)
    return f"; did you mean --{similar_names[0]}?" if similar_names else ""


def in_order(parser: argparse.ArgumentParser, words: Sequence[str]) -> list[str]:
    """Return arguments with the options in front, each with its value.

    An option without its value comes last, so that it takes nothing else, and completion, which
    sees only the words so far, knows that it needs one.
    """
    paths: list[str] = []
    options: list[str] = []
    incomplete_options: list[str] = []
    for _, parts, is_open in _split(parser, words, paths):
        (incomplete_options if is_open else options).extend(parts)
    if any(word.startswith("-") for word in paths):
        return [*options, *incomplete_options, "--", *paths]
    return [*options, *paths, *incomplete_options]


def options_but(
    parser: argparse.ArgumentParser, words: Sequence[str], *excluded: str
) -> tuple[str, ...]:
    """Return the words of all options but those that go to `excluded`, quoted for a shell."""
    options = _split(parser, words, [])
    kept_options = [parts for option, parts, _ in options if option and option.dest not in excluded]
    return tuple(shlex.quote(part) for parts in kept_options for part in parts)


def _split(
    parser: argparse.ArgumentParser, words: Sequence[str], paths: list[str]
) -> Iterator[tuple[argparse.Action | None, list[str], bool]]:
    """Yield each option, its words, and whether it lacks its value; others go to `paths`."""
    remaining = [*words]
    while remaining:
        word = remaining.pop(0)
        if word == "--":
            paths += remaining
            return
        if _is_plain(word):
            paths.append(word)
            continue
        option = _option(parser, word)
        parts = _with_value(option, word, remaining)
        yield option, parts, option is not None and option.nargs is None and parts == [word]


def _is_plain(word: str) -> bool:
    """Return True if a word is not an option; a negative number is not."""
    return not word.startswith("-") or word == "-" or _NUMBER.fullmatch(word) is not None


def _option(parser: argparse.ArgumentParser, word: str) -> argparse.Action | None:
    """Return the option that `word` names, whole or abbreviated; None if it names none."""
    actions = parser._option_string_actions
    if word in actions or not word.startswith("--"):
        return actions.get(word)
    matches = {id(action): action for name, action in actions.items() if name.startswith(word)}
    return next(iter(matches.values())) if len(matches) == 1 else None


def _with_value(action: argparse.Action | None, word: str, next_words: list[str]) -> list[str]:
    """Return the words of an option: itself, and its value from `next_words` if it takes one."""
    if action is None or action.nargs not in (None, "?"):
        return [word]
    if action.nargs == "?":
        # An option with an optional value takes a number, but no path.
        is_given = bool(next_words) and _NUMBER.fullmatch(next_words[0]) is not None
        value = next_words.pop(0) if is_given else str(action.const)
    elif next_words and _is_plain(next_words[0]):
        value = next_words.pop(0)
    else:
        return [word]
    if word.startswith("--"):
        return [f"{word}={value}"]
    # Joined, so that a value like -1 is not taken for an option.
    return [word + value] if value.startswith("-") else [word, value]
