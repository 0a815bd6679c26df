"""Scripts and style sheets without what only their readers need: space and comments.

Pages that are sent by mail have theirs compacted when they are written. Names stay, so that errors
of a page name the source, and nothing is evaluated.
"""

import re

#: Parts of a style sheet that stay, or marks with space around them that has no meaning.
_STYLE = re.compile(
    r"""(?P<text>"[^"]*"|'[^']*')|/\*(?!!).*?\*/|\s*(?P<mark>[{};,>])\s*|(?<=[\w-])(?P<colon>:)\s+"""
    r"""|(?<![\w.])0(?P<fraction>\.\d)""",
    re.DOTALL,
)

#: Tokens of a script. A pattern follows what no value ends with; the last alternative is one mark.
_TOKEN = re.compile(
    r"""(?P<space>(?:\s|//[^\n]*|/\*(?!!).*?\*/)+)|"(?:[^"\\]|\\.)*"|'(?:[^'\\]|\\.)*'|/\*!.*?\*/"""
    r"""|(?P<template>`(?:[^`\\]|\\.)*`)|[\w$]+|(?P<slash>/)|.""",
    re.DOTALL,
)
_PATTERN = re.compile(r"/(?:[^/\\\[\n]|\\.|\[(?:[^\]\\\n]|\\.)*\])+/\w*")

#: What a line ends or begins with that goes on in the next, and words that a pattern may follow.
_OPEN_END, _OPEN_START = set(";{,([=:?&|<>*%^~!"), set("})];,.:?&|<>=*%^")
_BEFORE_PATTERN = {"return", "typeof", "case", "in", "of"}


def compact_styles(text: str) -> str:
    """Return a style sheet without comments and space that has no meaning. Quoted texts stay."""

    def compacted(match: re.Match[str]) -> str:
        return next((x for x in match.groups() if x), "")

    return _STYLE.sub(compacted, text).replace(";}", "}").strip()


def compact_script(text: str) -> str:
    """Return a script without comments and space that has no meaning; licences, `/*!`, stay.

    Lines end where a statement may end. Templates stay, so none may be inside another.
    """
    parts: list[str] = []
    position, space = 0, ""
    while position < len(text):
        match = _TOKEN.match(text, position)
        assert match is not None  # the last alternative takes any character
        token = match[0]
        if match["slash"] and _begins_pattern(parts):
            token = (_PATTERN.match(text, position) or match)[0]
        position += len(token)
        if match["space"]:
            space = token
            continue
        if parts and space:
            parts.append(_joint(parts[-1], token, space))
        parts.append(token)
        space = ""
    return "".join(parts)


def _begins_pattern(parts: list[str]) -> bool:
    """Return whether a slash after these tokens begins a pattern, and divides nothing."""
    last = next((part for part in reversed(parts) if part.strip()), "(")
    is_value = last[-1] in ")]}`\"'" or re.fullmatch(r"[\w$]+", last) is not None
    return not is_value or last in _BEFORE_PATTERN


def _joint(before: str, after: str, space: str) -> str:
    """Return what has to stay of the space between two tokens: a line's end, a space or nothing."""
    end, start = before[-1], after[0]
    if "\n" in space and end not in _OPEN_END and start not in _OPEN_START:
        return "\n"
    are_words = all(x.isalnum() or x in "_$" for x in (end, start))
    return " " if are_words or (end == start and end in "+-/") else ""


def unindented(text: str) -> str:
    """Return code without indentation and empty lines, which would be a tenth of a report.

    Neither has a meaning, not even in the templates of these scripts.
    """
    return "\n".join(line.strip() for line in text.splitlines() if line.strip())
