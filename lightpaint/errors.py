"""Every exception lightpaint raises on purpose.

    LightpaintError
    ├── BackendError     Mitsuba or LLVM cannot run here
    ├── SceneError       the scene XML, a sensor, a light
    ├── ImageError       an image file that cannot be read as what it should be
    │   └── ViewError    … or a view transform, to decode it by, that there is none of
    ├── KeywordError     an argument that a function does not have; a TypeError as well
    ├── ColorError       a colour that means nothing: hexadecimal digits, a temperature
    ├── BasisError       a basis file, or one that does not fit what it is used with
    ├── TargetError      a painting or mask that cannot be solved for
    │   └── SizeError    … because its size differs from the basis
    ├── ConstraintError  what is asked of a light, and cannot be understood or had
    ├── PaintError       what a page says to the painter, and cannot be understood or done
    ├── BatchError       a manifest of looks; it may have several mistakes, a line each
    ├── LightingError    a lighting.json, or weights that are none
    │   └── UnknownLightError … or a name that none of its lights has; a KeyError as well
    └── OutputError      a place that cannot be written

Each message is one line: what came, what was expected, and what to do. The command
line prints it and exits with 2.
"""


class LightpaintError(Exception):
    """Base of all errors that a user of lightpaint can cause and mend.

    Examples:
        >>> try:
        ...     lp.read_basis("evening.exr")
        ... except lp.LightpaintError as error:
        ...     print(error)
        no such image file: evening.exr
    """


class BackendError(LightpaintError):
    """Mitsuba or the LLVM library it compiles with is missing or unusable."""


class SceneError(LightpaintError):
    """A scene that cannot be loaded, or that lacks what was asked of it."""


class ImageError(LightpaintError):
    """An image file that is missing, damaged, or of a kind that is not supported."""


class ViewError(ImageError):
    """A view transform that there is none of, or that cannot be undone."""


class KeywordError(LightpaintError, TypeError):
    """An argument, by name, that a function does not have."""


class ColorError(LightpaintError):
    """A colour, or a colour temperature, that there is none of."""


class BasisError(LightpaintError):
    """A basis that is damaged or belongs to something else."""


class TargetError(LightpaintError):
    """A painting or an importance mask that no lighting can be solved for."""


class SizeError(TargetError):
    """A painting or mask whose size is not that of the basis."""


class ConstraintError(LightpaintError):
    """Something asked of a light that means nothing, contradicts itself, or cannot be had."""


class PaintError(LightpaintError):
    """A message to the painter that means nothing, or a session that cannot be had."""


class NothingToUndoError(PaintError):
    """An undo where nothing was done, or a redo where nothing was undone: nobody's mistake."""


class BatchError(LightpaintError):
    """A manifest of looks that cannot be done as it stands.

    mistakes: one line each; the message is all of them.
    """

    def __init__(self, *mistakes: str) -> None:
        super().__init__("; ".join(mistakes))
        self.mistakes = mistakes


class LightingError(LightpaintError):
    """A lighting file that is damaged or names other lights than the scene has."""


class UnknownLightError(LightingError, KeyError):
    """A name that no light has."""

    # A KeyError would quote the line as if it were the key.
    __str__ = Exception.__str__


class OutputError(LightpaintError):
    """A file or folder that cannot be written."""


#: Mistakes in a painting, or in what lies where its answer goes, are of that look alone.
ALONE = (ImageError, TargetError, OutputError)
