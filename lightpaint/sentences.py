"""Sentences for users that carry their arguments as data.

    raise SizeError(f"{name} is {size}: export it at that size, or pass ", Hint("resize", True))

reads `pass resize=True` in Python. A terminal spells the same argument `--resize`, a manifest
`settings.resize = true`: each face gives `Sentence.spelled` its own spelling, and no code searches
the words of a sentence.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any, TypeAlias


class Word(str):
    """A value that is one of a few words, such as a mode: a shell needs no quotes around it."""

    __slots__ = ()


@dataclass(frozen=True)
class Hint:
    """An argument that a sentence names, as in `pass resize=True`.

    value: `...` for any. A mapping stands for one of its entries, as in `split={'sky': '16x8'}`.
    """

    name: str
    value: Any = field(default=...)

    def __str__(self) -> str:
        return f"{self.name}={_in_python(self.value)}"


def _in_python(value: Any) -> str:
    if value is ...:
        return "..."
    if isinstance(value, Word):
        return f'"{value}"'
    if isinstance(value, Mapping):
        entries = (f"{key!r}: {_in_python(entry)}" for key, entry in value.items())
        return f"{{{', '.join(entries)}}}"
    return repr(value)


class SourceKey(str):
    """A key of a lights file or of the options, as errors name it: `room.toml: light.key.limits`.

    source: the file, or what else has the key; "" for Python's arguments. keys: the names that lead
    to it; a number counts tables of the same name: `new 2.count`.
    """

    source: str
    keys: tuple[str | int, ...]

    def __new__(cls, source: str = "", *keys: str | int) -> "SourceKey":
        """Return the key. A source alone names itself."""
        path = "".join(f" {key}" if isinstance(key, int) else f".{key}" for key in keys)[1:]
        self = super().__new__(cls, ": ".join(filter(None, (source, path))))
        self.source, self.keys = source, keys
        return self

    @classmethod
    def of(cls, where: str) -> "SourceKey":
        """Return `where`, or a plain text as a key without a source."""
        return where if isinstance(where, cls) else cls("", where)

    def __truediv__(self, key: str | int) -> "SourceKey":
        """Return the key below this one."""
        return SourceKey(self.source, *self.keys, key)

    def __reduce__(self) -> tuple[Any, ...]:
        return SourceKey, (self.source, *self.keys)

    @property
    def path(self) -> str:
        """The key without its source."""
        return SourceKey("", *self.keys)


@dataclass(frozen=True)
class Lead:
    """A key with a colon, before a sentence that is clear without it."""

    key: SourceKey

    def __str__(self) -> str:
        return f"{self.key}: "


#: The data in a sentence, and all its parts. A path is data, since a file may have another name
#: for its user.
Datum: TypeAlias = "Hint | SourceKey | Lead | Remedy | Path"
Part: TypeAlias = "str | Hint | SourceKey | Lead | Remedy | Path"

#: How a face spells a datum; None for what it has no words of its own for.
Spelling: TypeAlias = "Callable[[Datum], str | None]"


class Sentence(str):
    """A text in Python's spelling that knows its parts.

    parts: plain text and data, in order. Joining by `+` keeps them; an f-string does not.
    """

    parts: tuple[Part, ...]

    def __new__(cls, *parts: object) -> "Sentence":
        """Join texts, data, and other sentences and errors with all their parts."""
        flat = [x for part in parts for x in _parts_of(part)]
        self = super().__new__(cls, "".join(map(str, flat)))
        runs = groupby(flat, key=lambda x: type(x) is str)
        self.parts = tuple(x for is_text, run in runs for x in (["".join(run)] if is_text else run))  # type: ignore[arg-type]
        return self

    @classmethod
    def joined(cls, parts: Iterable[object], joint: str = ", ") -> "Sentence":
        """Join parts with `joint` between them."""
        return cls(*(x for k, part in enumerate(parts) for x in ([joint] * (k > 0) + [part])))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self.parts

    def __add__(self, other: str) -> "Sentence":
        return Sentence(self, other)

    def __radd__(self, other: str) -> "Sentence":
        return Sentence(other, self)

    @property
    def record(self) -> list[Any]:
        """Its text and arguments for JSON; `of_record` reads them. Other data become text."""
        return [_record_of(x) if isinstance(x, Hint) else str(x) for x in self.parts]

    @classmethod
    def of_record(cls, record: Iterable[Any]) -> "Sentence":
        """Return the sentence of a `record`. Raises TypeError for anything else."""
        return cls(*(part if isinstance(part, str) else _hint_of(**part) for part in record))

    def spelled(self, spelling: Spelling) -> "Sentence":
        """Return the sentence with all data in words of `spelling` where it has some."""
        return type(self)(*(_spelled(part, spelling) for part in self.parts))

    def mapped(self, change: Callable[[str], str]) -> "Sentence":
        """Return the sentence with the text of each part changed; a changed datum becomes text."""
        changed = ((part, change(str(part))) for part in self.parts)
        return Sentence(*(part if text == str(part) else text for part, text in changed))

    def shortened(self, limit: int) -> "Sentence":
        """Return its first `limit` characters; data that do not fit become text."""
        kept, room = list[object](), limit
        for part in self.parts:
            text = str(part)
            kept.append(part if len(text) <= room else text[:room])
            room -= min(len(text), room)
        return Sentence(*kept)


class Remedy(Sentence):
    """Advice that a face may replace as a whole, where its users would do something else."""


def _parts_of(part: object) -> tuple[Part, ...]:
    """Return what a part adds to a sentence: all parts of another sentence or of an error."""
    part = getattr(part, "sentence", part)
    if isinstance(part, Sentence) and not isinstance(part, Remedy):
        return part.parts
    return (part,) if isinstance(part, Hint | SourceKey | Lead | Remedy | Path) else (str(part),)


def _record_of(hint: Hint) -> dict[str, Any]:
    """Return an argument as JSON has it. Python's `...` is None there, or nothing."""
    if isinstance(hint.value, Word):
        return {"name": hint.name, "word": hint.value}
    if isinstance(hint.value, Mapping):
        entries = {key: None if value is ... else value for key, value in hint.value.items()}
        return {"name": hint.name, "entries": entries}
    return {"name": hint.name} if hint.value is ... else {"name": hint.name, "value": hint.value}


def _hint_of(
    name: str, *, word: str = "", entries: Mapping[str, Any] | None = None, value: Any = ...
) -> Hint:
    if entries is not None:
        value = {key: ... if entry is None else entry for key, entry in entries.items()}
    return Hint(name, Word(word) if word else value)


def _spelled(part: Part, spelling: Spelling) -> object:
    if type(part) is str:
        return part
    assert isinstance(part, Hint | SourceKey | Lead | Remedy | Path)
    spelt = spelling(part)
    if spelt is None:
        return part.spelled(spelling) if isinstance(part, Remedy) else part
    return spelt
