"""Text for users: short reprs, truncated lists, visible control characters, notebook pages."""

import difflib
import re
from collections.abc import Iterable, Sequence
from dataclasses import fields, is_dataclass
from importlib import import_module
from typing import Any, TypeVar, cast

#: Longest list in a repr, and in a message, in characters.
MAX_LIST_LENGTH, MAX_LENGTH_IN_MESSAGE = 800, 300

#: Invisible characters that control a terminal, end the line, or reverse the order of what follows.
#: (Joiners, as in Persian names or emoji, are allowed.)
_INVISIBLE = re.compile(
    "[\x00-\x1f\x7f-\x9f\xad\u061c\u180e\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f"
    "\ufeff\ufff9-\ufffb\U000e0000-\U000e007f\ud800-\udfff]"
)

_Item = TypeVar("_Item")


def visible(text: str) -> str:
    r"""Return `text` in one line, with invisible characters as Python writes them, like `\\x1b`."""
    return _INVISIBLE.sub(lambda match: ascii(match[0])[1:-1], text)


def some_names(names: Iterable[str], joint: str = ", ") -> str:
    """Return names for a message: as many as fit, and the number of others."""
    return some_of([_shortened(visible(name)) for name in names], joint, MAX_LENGTH_IN_MESSAGE)


def _shortened(name: str) -> str:
    return (
        name
        if len(name) <= MAX_LENGTH_IN_MESSAGE // 2
        else f"{name[: MAX_LENGTH_IN_MESSAGE // 2]}…"
    )


def some_of(texts: Sequence[str], joint: str = ", ", room: int = MAX_LIST_LENGTH) -> str:
    """Return as many of the texts as fit into `room` characters, joined, and how many are left."""
    text_so_far = ""
    for k, text in enumerate(texts):
        extended = f"{text_so_far}{joint if k else ''}{text}"
        if len(extended) > room:
            rest_note = f"… and {len(texts) - k} more"
            return f"{text_so_far}{joint}{rest_note}" if k else rest_note
        text_so_far = extended
    return text_so_far


def known_keys(key: str, known: Iterable[str]) -> str:
    """Return `known are lock, limits; did you mean 'limits'?` for a key that is not known.

    Without the question if none resembles it.
    """
    names = list(known)
    near = difflib.get_close_matches(key[:MAX_LENGTH_IN_MESSAGE], names, n=1)
    return f"known are {', '.join(names)}" + (f"; did you mean {near[0]!r}?" if near else "")


def with_similar_name(listing: str, name: str, names: Sequence[str]) -> str:
    """Return `did you mean 'beam'? There are beam, bulb` for the listing `there are beam, bulb`.

    The listing alone if none of `names` resembles `name`.
    """
    similar_names = difflib.get_close_matches(name, names, n=1)
    if not similar_names:
        return listing
    return f"did you mean {similar_names[0]!r}? {listing[:1].upper()}{listing[1:]}"


def rounded_text(value: float, digits: int) -> str:
    """Return a number of so many digits, without an exponent where people need none: `10`."""
    return f"{float(f'{value:.{digits}g}'):g}"


class Listed(tuple[_Item, ...]):
    """A tuple whose repr has a line for each item, as many as fit."""

    __slots__ = ()

    def __repr__(self) -> str:
        return f"({some_of([repr(item) for item in self], joint=',' + chr(10) + ' ')})"


def short_repr(value: Any) -> str:
    """Return the repr of a dataclass on one screen: arrays by their shapes, long values cut."""
    names = [field.name for field in fields(value) if field.repr]
    room = MAX_LIST_LENGTH // len(names)
    texts = (f"{name}={brief(getattr(value, name), room - len(name))}" for name in names)
    return f"{type(value).__name__}({', '.join(texts)})"


def brief(value: Any, room: int = 60) -> str:
    """Return the repr of a value in one line of about `room` characters."""
    if hasattr(value, "dtype") and hasattr(value, "shape"):
        return f"{value.dtype} {value.shape}"
    text = f"{value:.4g}" if isinstance(value, float) else " ".join(repr(value).split())
    if len(text) <= room:
        return text
    return f"{type(value).__name__}(…)" if is_dataclass(value) else text[: max(room, 8) - 1] + "…"


class Shown:
    """Base class of values that notebooks show as a page or as a picture.

    The report draws them. It is imported by name only when a notebook asks, so that modules below
    the report need not import it.
    """

    __slots__ = ()

    def _repr_html_(self) -> str | None:
        return cast(str | None, import_module(_DRAWN_BY).html_of(self))

    def _repr_png_(self) -> bytes | None:
        return cast(bytes | None, import_module(_DRAWN_BY).png_of(self))


_DRAWN_BY = "lightpaint.report.page.notebook_html"
