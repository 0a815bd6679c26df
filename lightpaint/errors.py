"""Every exception lightpaint raises on purpose.

    LightpaintError
    ├── BackendError     Mitsuba or LLVM cannot run here
    ├── SceneError       the scene XML, a sensor, a light
    │   └── NoPlaceError … or a light for which no place is free
    ├── ImageError       an image file that cannot be read as what it should be
    │   └── ViewError    … or an unknown view transform to decode it with
    ├── KeywordError     an argument name that a function does not have; also a TypeError
    ├── ArgumentError    an argument of another kind than a function takes; also a TypeError
    ├── ColorError       an invalid colour: hexadecimal digits, a temperature
    ├── BasisError       a basis file that is damaged, or does not fit the scene or target
    ├── TargetError      a painting or mask that cannot be solved for
    │   └── SizeError    … because its size differs from the basis
    ├── ConstraintError  a constraint on a light that is invalid or impossible
    ├── PaintError       a message of a page that the painter cannot understand or obey
    │   └── NothingToUndoError  … or an undo with nothing to undo
    ├── BatchError       a manifest of looks; it may list several mistakes, one per line
    ├── LightingError    a lighting.json, or weights that are invalid
    │   └── UnknownLightError  … or a name that none of its lights has; also a KeyError
    ├── RigError         a rig of fixtures: its MVR, its GDTF types, its addresses
    ├── ConsoleError     a console's network: an address, a universe, a port that is taken
    ├── AccessError      a file or folder that the system refuses to open; also an OSError
    └── OutputError      a file or folder that cannot be written

Each message is one line: what came, what was expected, and what to do. The command
line prints it and exits with 2. An argument that it names is a `Hint` in it, which
the command line and manifests spell in their own way.
"""

import errno
import os
import re
from collections.abc import Sequence
from typing import cast

from lightpaint.sentences import Sentence

#: The end of a line of text, and spaces around it.
_LINE_END = re.compile(r"\s*[\n\r]\s*")


class LightpaintError(Exception):
    """Base class of all errors that a user of lightpaint can cause and fix.

    Examples:
        >>> try:
        ...     lp.read_basis("evening.exr")
        ... except lp.LightpaintError as error:
        ...     print(error)
        no such image file: evening.exr
    """

    def __init__(self, *parts: object) -> None:
        """Make an error of texts, of data like `Hint("resize", True)`, and of other errors.

        Texts are put into one line: the repr of an array has several.
        """
        texts = (_LINE_END.sub(" ", x) if type(x) is str else x for x in parts)
        super().__init__(Sentence(*texts))

    @property
    def sentence(self) -> Sentence:
        """The message with its arguments as data."""
        return cast(Sentence, self.args[0])


class BackendError(LightpaintError):
    """Mitsuba or the LLVM library it compiles with is missing or unusable."""


class SceneError(LightpaintError):
    """A scene that cannot be loaded, or that lacks something it was asked for."""


class NoPlaceError(SceneError):
    """A light for which no place is free and sees anything of the picture."""


class ImageError(LightpaintError):
    """An image file that is missing, damaged, or of a kind that is not supported."""


class ViewError(ImageError):
    """A view transform that does not exist or cannot be inverted."""


class KeywordError(LightpaintError, TypeError):
    """A keyword argument that a function does not have."""


class ArgumentError(LightpaintError, TypeError):
    """An argument of another kind than a function takes."""


class ColorError(LightpaintError):
    """A colour, or a colour temperature, that is invalid."""


class BasisError(LightpaintError):
    """A basis that is damaged, or belongs to another scene."""


class TargetError(LightpaintError):
    """A painting or an importance mask that cannot be solved for."""


class SizeError(TargetError):
    """A painting or mask whose size is not the size of the basis."""


class ConstraintError(LightpaintError):
    """A constraint that is invalid, contradicts itself, or cannot be satisfied."""


class PaintError(LightpaintError):
    """A message that the painter cannot understand, or a session that it cannot open."""


class NothingToUndoError(PaintError):
    """An undo with nothing to undo, or a redo with nothing to redo; it is nobody's mistake."""


class BatchError(LightpaintError):
    """A manifest of looks with mistakes.

    mistakes: one line each; the message joins them.
    """

    mistakes: tuple[str, ...]

    def __init__(self, *parts: object) -> None:
        super().__init__(*parts)
        self.mistakes = (self.sentence,)

    @classmethod
    def of(cls, mistakes: Sequence[str]) -> "BatchError":
        """Return the error of several mistakes."""
        error = cls(Sentence.joined(mistakes, "; "))
        error.mistakes = tuple(mistakes)
        return error


class LightingError(LightpaintError):
    """A lighting file that is damaged or names other lights than the scene has."""


class UnknownLightError(LightingError, KeyError):
    """A name that no light has."""

    # KeyError would show the repr of the message, in quotes.
    __str__ = Exception.__str__


class OutputError(LightpaintError):
    """A file or folder that cannot be written."""


class RigError(LightpaintError):
    """A rig of fixtures that cannot be read, or that contradicts itself."""


class ConsoleError(LightpaintError):
    """A console's network: a target that does not exist, or a port that is taken."""


class AccessError(LightpaintError, OSError):
    """A file or folder that the system refuses: its name is too long, or the disk is full."""

    # OSError has none of a single argument.
    __str__ = Exception.__str__


#: Error numbers of refusals that a user can mend; others, like the error for a file of ours which
#: is missing, are faults of a program.
REFUSALS = {
    *(errno.ENAMETOOLONG, errno.ELOOP, errno.ENOTDIR, errno.EISDIR, errno.EINVAL),
    *(errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOSPC, errno.EDQUOT, errno.EFBIG),
    *(errno.EIO, errno.ESTALE, errno.EMFILE, errno.ENFILE, errno.ETIMEDOUT, errno.ENODEV),
}

#: Longest name in the text of an AccessError, in characters.
_MAX_NAME = 200


def refusal_of(error: OSError) -> AccessError | None:
    """Return the system's refusal in one line; None for an error that is not a refusal."""
    if error.errno not in REFUSALS:
        return None
    name = "" if error.filename is None else ascii(os.fsdecode(error.filename))[1:-1]
    shortened = name if len(name) <= _MAX_NAME else f"{name[:_MAX_NAME]}…"
    prefix = f"cannot use {shortened}" if name else "the system refuses"
    return AccessError(f"{prefix}: {error.strerror or error}")


#: Errors that concern one look alone: its painting, or the place of its answer.
LOOK_ERRORS = (ImageError, TargetError, OutputError)
