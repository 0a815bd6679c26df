"""The files that a pattern of a manifest names, found in bounds.

A pattern may name any folder, and one that names the root would look at every file of the machine.
"""

import os
from collections.abc import Iterator
from fnmatch import translate
from functools import cache
from glob import has_magic
from pathlib import Path
from re import Pattern, compile

from lightpaint.errors import BatchError

#: Files and folders that are looked at for one pattern, and how deep `**` leads.
MOST_LOOKED_AT, DEEPEST = 20_000, 32


def files_matching(pattern: str, base: Path = Path()) -> list[str]:
    """Return the files that a pattern names, relative to a folder, each once, in no order.

    `*`, `?` and `[...]` stand for characters of a name, and `**` for folders; neither for a name
    that begins with a dot, nor `**` for a link; in `base` they are themselves. Raises BatchError
    where there is too much to look at.
    """
    parts = Path(pattern).parts
    fixed = next(k for k, part in enumerate(parts) if has_magic(part))
    # Several in a row say no more than one.
    whole = parts[fixed:]
    rest = [x for k, x in enumerate(whole) if x != "**" or whole[max(k - 1, 0) : k] != ("**",)]
    start = os.path.join("" if base == Path() else base, *parts[:fixed])
    found = dict.fromkeys(_Search(pattern).below(start, tuple(rest), 0))
    return [path for path in found if os.path.isfile(path)]


class _Search:
    """A walk through folders that counts what it looks at."""

    def __init__(self, pattern: str) -> None:
        self._pattern, self._looked_at = pattern, 0
        self._seen: set[tuple[str, int]] = set()

    def below(self, folder: str, parts: tuple[str, ...], depth: int) -> Iterator[str]:
        """Yield what matches the parts in a folder."""
        if (folder, len(parts)) in self._seen:
            return
        self._seen.add((folder, len(parts)))
        first, *others = parts
        rest = tuple(others)
        if first == "**":
            if rest:
                yield from self.below(folder, rest, depth)
            for name, is_folder in self._listed(folder):
                path = os.path.join(folder, name)
                if name.startswith("."):
                    continue
                if not rest:
                    yield path
                if is_folder and depth < DEEPEST:
                    yield from self.below(path, parts, depth + 1)
        elif not has_magic(first):
            path = os.path.join(folder, first)
            if not rest:
                yield path
            elif os.path.isdir(path):
                yield from self.below(path, rest, depth)
        else:
            for name, _ in self._listed(folder):
                if not _regex(first).match(name):
                    continue
                if name.startswith(".") and not first.startswith("."):
                    continue
                path = os.path.join(folder, name)
                if not rest:
                    yield path
                elif os.path.isdir(path):
                    yield from self.below(path, rest, depth)

    def _listed(self, folder: str) -> list[tuple[str, bool]]:
        """Names in a folder, and which are folders themselves; none where it cannot be read."""
        found = []
        try:
            with os.scandir(folder or ".") as entries:
                for entry in entries:
                    self._looked_at += 1
                    if self._looked_at > MOST_LOOKED_AT:
                        raise BatchError(
                            f"the pattern {self._pattern!r} has more than {MOST_LOOKED_AT} files "
                            "to look at: name a folder nearer to them"
                        )
                    found.append((entry.name, entry.is_dir(follow_symlinks=False)))
        except OSError:
            return []
        return found


@cache
def _regex(part: str) -> Pattern[str]:
    return compile(translate(part))
