"""Options anywhere on the line: what was typed, in the order in which argparse reads it.

argparse gives all that its positional arguments can take to the first run of words, and an option
whose value may be left out whatever stands next. Here options come first, each with its value, and
then the paths; `--` ends the options, as everywhere.
"""

import argparse
import re
import shlex
from collections.abc import Iterator, Sequence
from typing import Any, NoReturn

from lightpaint.cli.output import lines

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


class Parser(argparse.ArgumentParser):
    """Says what is wrong in one line."""

    def error(self, message: str) -> NoReturn:
        lines.err(f"{self.prog}: {message} (see {self.prog} --help)")
        self.exit(2)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As argparse does it; an option that stands before its command is told where to stand."""
        first = args[0] if args else ""
        if first.startswith("--") and _option(self, first.partition("=")[0]) is None:
            self.error(f"the command comes first: {self.prog} COMMAND {first}")
        return super().parse_known_args(args, namespace)


class CommandParser(Parser):
    """Of one command: takes options before, between and behind its paths."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As argparse does it, but that nothing is left over: only this command knows its help."""
        ordered = in_order(self, args or ())
        found, unknown = argparse.ArgumentParser.parse_known_args(self, ordered, namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return found, unknown


def in_order(parser: argparse.ArgumentParser, given: Sequence[str]) -> list[str]:
    """`given`, with the options in front, each with its value.

    An option that lacks its value comes last, so that it takes nothing else (and so that
    completion, which sees only what is typed so far, knows that it is open).
    """
    plain: list[str] = []
    options: list[str] = []
    lacking: list[str] = []
    for _, words, is_open in _told_apart(parser, given, plain):
        (lacking if is_open else options).extend(words)
    if any(word.startswith("-") for word in plain):
        return [*options, *lacking, "--", *plain]
    return [*options, *plain, *lacking]


def options_but(
    parser: argparse.ArgumentParser, given: Sequence[str], *dropped: str
) -> tuple[str, ...]:
    """The words of all options in `given` but of those that go to `dropped`, as for a shell."""
    found = _told_apart(parser, given, [])
    kept = [words for option, words, _ in found if option and option.dest not in dropped]
    return tuple(shlex.quote(word) for words in kept for word in words)


def _told_apart(
    parser: argparse.ArgumentParser, given: Sequence[str], plain: list[str]
) -> Iterator[tuple[argparse.Action | None, list[str], bool]]:
    """Each option, its words, and whether it lacks its value; other words are put to `plain`."""
    left = [*given]
    while left:
        word = left.pop(0)
        if word == "--":
            plain += left
            return
        if _is_plain(word):
            plain.append(word)
            continue
        option = _option(parser, word)
        words = _with_value(option, word, left)
        yield option, words, option is not None and option.nargs is None and words == [word]


def _is_plain(word: str) -> bool:
    """Whether it is no option; a negative number is none."""
    return not word.startswith("-") or word == "-" or _NUMBER.fullmatch(word) is not None


def _option(parser: argparse.ArgumentParser, word: str) -> argparse.Action | None:
    """The option that `word` names, alone and whole or its beginning; None if it is no such."""
    known = parser._option_string_actions
    if word in known or not word.startswith("--"):
        return known.get(word)
    meant = {id(action): action for name, action in known.items() if name.startswith(word)}
    return next(iter(meant.values())) if len(meant) == 1 else None


def _with_value(action: argparse.Action | None, word: str, left: list[str]) -> list[str]:
    """The words of an option: itself, and its value if it takes one, out of what is `left`."""
    if action is None or action.nargs not in (None, "?"):
        return [word]
    if action.nargs == "?":
        # What may have a value takes a number and no path.
        is_given = bool(left) and _NUMBER.fullmatch(left[0]) is not None
        value = left.pop(0) if is_given else str(action.const)
    elif left and _is_plain(left[0]):
        value = left.pop(0)
    else:
        return [word]
    if word.startswith("--"):
        return [f"{word}={value}"]
    # Joined, a value like -1 is not taken for an option.
    return [word + value] if value.startswith("-") else [word, value]
