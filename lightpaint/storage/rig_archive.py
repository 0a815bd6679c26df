"""Archives of MVR and GDTF, opened within limits, and the XML in them.

Both are zip files that come from strangers. Their libraries read whatever they are given; these
functions read the same members first, and report what must not be read as a RigError.
"""

import io
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ParseError, TreeBuilder
from xml.parsers import expat

from lightpaint.errors import RigError
from lightpaint.files import file_length, first_line, one_line
from lightpaint.storage.staging import is_below

#: Largest sum of all members in bytes, unpacked, and largest number of them.
MAX_UNPACKED, MAX_MEMBERS = 2**31, 20_000
#: Largest XML in bytes, and its largest nesting and number of elements.
MAX_XML, MAX_NESTING, MAX_ELEMENTS = 2**26, 100, 1_000_000

#: Errors of Python's modules for damaged archives.
_DAMAGES = (
    zipfile.BadZipFile,
    zlib.error,
    EOFError,
    NotImplementedError,
    RuntimeError,
    ValueError,
    OSError,
)

#: Errors of the libraries for values of another form than the standards say.
_ODD_VALUES = (ValueError, TypeError, AttributeError, LookupError, RecursionError, ArithmeticError)


def library(name: str) -> Any:
    """Return pygdtf or pymvr. Raises RigError if it is not installed."""
    try:
        return import_module(name)
    except ImportError:
        raise RigError(
            f"rigs need the library {name}, which is not installed: pip install 'lightpaint[stage]'"
        ) from None


@contextmanager
def reading(name: str) -> Iterator[None]:
    """Report values that a library cannot read as a RigError about the file `name`."""
    try:
        yield
    except _ODD_VALUES as error:
        raise RigError(f"{name} has a value that cannot be read: {first_line(error)}") from None


class RigArchive:
    """A zip file, checked but not unpacked.

    name: for errors. Raises RigError for a file that is not a zip file, is encrypted, is too large
    once unpacked, has too many members, or one with a path out of it.
    """

    def __init__(self, source: Path | bytes, name: str, kind: str) -> None:
        self.name = name
        if isinstance(source, Path):
            file_length(source, kind, RigError, limit=MAX_UNPACKED)
        try:
            self._zip = zipfile.ZipFile(source if isinstance(source, Path) else io.BytesIO(source))
            members = self._zip.infolist()
        except _DAMAGES as error:
            raise RigError(f"{name} is not {_with_article(kind)}: {first_line(error)}") from None
        if len(members) > MAX_MEMBERS:
            raise RigError(f"{name} has {len(members)} files in it: expected at most {MAX_MEMBERS}")
        if (size := sum(member.file_size for member in members)) > MAX_UNPACKED:
            raise RigError(
                f"{name} has {size} bytes once unpacked: expected at most {MAX_UNPACKED}"
            )
        for member in members:
            path = member.filename.replace("\\", "/")
            if not is_below(path) or ":" in path.partition("/")[0]:
                raise RigError(f"{name} has a path out of it, {one_line(path)}: it is not read")
            if member.flag_bits & 1:
                raise RigError(f"{name} is encrypted: save it without a password")

    def __enter__(self) -> "RigArchive":
        return self

    def __exit__(self, *_: object) -> None:
        self._zip.close()

    @property
    def members(self) -> list[zipfile.ZipInfo]:
        """All members, in their order."""
        return self._zip.infolist()

    def name_of(self, member: zipfile.ZipInfo) -> str:
        """Return the name of a member as people write it, also where it is not marked as UTF-8."""
        is_marked = member.flag_bits & 0x800
        return member.filename if is_marked else as_utf_8(member.filename)

    @cached_property
    def _by_name(self) -> dict[str, str]:
        """The name of each member, by the ways in which files refer to it."""
        proper = {self.name_of(x): x.filename for x in self._zip.infolist()}
        folded = {name.casefold(): own for name, own in proper.items()}
        return folded | proper | {name: name for name in proper.values()}

    def find(self, name: str) -> str | None:
        """Return the member that a file in the archive refers to; None if there is none."""
        proper = as_utf_8(name)
        ways = (name, proper, proper.casefold(), name.casefold())
        return next((self._by_name[way] for way in ways if way in self._by_name), None)

    def read(self, member: str) -> bytes:
        """Return a member. Raises RigError if it is damaged or missing."""
        try:
            return self._zip.read(member)
        except KeyError:
            raise RigError(f"{self.name} has no {member}") from None
        except _DAMAGES as error:
            raise RigError(
                f"{self.name}: {one_line(member)} is damaged: {first_line(error)}"
            ) from None

    def xml(self, member: str) -> Element:
        """Return the root of an XML file. Raises RigError for one beyond the limits, or damaged."""
        try:
            size = self._zip.getinfo(member).file_size
        except KeyError:
            raise RigError(f"{self.name} has no {member}") from None
        if size > MAX_XML:
            raise RigError(f"{self.name}: {member} has {size} bytes: expected at most {MAX_XML}")
        # Some programs end it with a NUL.
        return parse_xml(self.read(member).rstrip(b"\0"), f"{self.name}: {member}")


def parse_xml(data: bytes, name: str) -> Element:
    """Return the root of an XML text. Raises RigError if it is damaged or beyond the limits.

    Entities, which may multiply without end, are refused with the document type declaration that
    they need.
    """
    parser, builder = expat.ParserCreate(), TreeBuilder()
    parser.buffer_text = True
    depth = count = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth > MAX_NESTING or count > MAX_ELEMENTS:
            raise RigError(
                f"{name} has more than {MAX_ELEMENTS} elements, or is nested more than "
                f"{MAX_NESTING} deep"
            )
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = builder.data

    def refuse(*_: object) -> None:
        raise RigError(f"{name} has a document type declaration: it is not read")

    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(data, True)
        return builder.close()
    except (expat.ExpatError, ParseError, ValueError, LookupError, AssertionError) as error:
        raise RigError(f"{name} is not XML: {first_line(error)}") from None


def as_utf_8(name: str) -> str:
    """Return a name in UTF-8 that a library has read as one in code page 437."""
    try:
        return name.encode("cp437").decode("utf-8")
    except UnicodeError:
        return name


def _with_article(kind: str) -> str:
    return f"{'an' if kind[0] in 'aeiouM' else 'a'} {kind}"
