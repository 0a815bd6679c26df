"""Files of a folder that may hold light groups, excluding hidden files, paintings and results.

Paintings and lightpaint's own output often lie beside a render. Taken for a light, they would be
the ones that match the painting best. A file is left out only if this is certain, and is always
reported.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path

from lightpaint.basis.file.basis_file import FORMAT_KEY
from lightpaint.display_text import some_names
from lightpaint.errors import BasisError, ImageError
from lightpaint.images.estimate import HALF_DIFFERENCE
from lightpaint.images.formats.exr import OWN, read_channels, read_headers
from lightpaint.images.formats.exr_layers import KRITA_LAYERS
from lightpaint.images.formats.file_kinds import head_of, kind_of

#: Maximum number of files in a folder of light groups: more are probably frames of a film.
MAX_FILES = 1000


def is_light_groups(path: Path) -> bool:
    """Return True for a folder with an EXR, or an EXR that is not lightpaint's own basis."""
    path = Path(path)
    if path.is_dir():
        return bool(_named_exr(_visible(path)))
    try:
        return is_exr(path) and not is_own_basis(path)
    except ImageError:
        return False


def is_exr(path: Path) -> bool:
    """Return True if `path` is a file with the signature of OpenEXR, whatever its name.

    May raise ImageError.
    """
    return path.is_file() and kind_of(head_of(path, 16)) == "exr"


def is_own_basis(path: Path) -> bool:
    """Return True if an EXR is lightpaint's own basis. Raises ImageError if it is unreadable."""
    return any(FORMAT_KEY in header for header in read_headers(path)[0])


def candidate_files(
    folder: Path, leave_out: Iterable[str | Path] = ()
) -> tuple[list[Path], list[str]]:
    """Return the files of a folder that may hold light groups, by name, and a sentence on those
    left out.

    leave_out: files that are not lights, such as the painting. Raises BasisError if no file
    remains, if there are too many, or if the folder cannot be read.
    """
    visible = _visible(folder)
    files = _named_exr(visible)
    if len(files) > MAX_FILES:
        raise BasisError(
            f"{folder} holds {len(files)} EXR files, more than {MAX_FILES}: is it a sequence of "
            "frames? give a folder with the light groups of one"
        )
    left_out = [Path(file) for file in leave_out]
    reasons = {file: _reason_against(file, left_out) for file in files}
    candidates = [file for file in files if not reasons[file]]
    reasons |= {
        file: "not named .exr" for file in visible if file not in reasons and _is_readable(file)
    }
    text = _list_with_reasons({file: reason for file, reason in reasons.items() if reason})
    if not candidates:
        empty_message = (
            f"{folder} holds no .exr file" if not text else f"{folder} holds no light: {text}"
        )
        raise BasisError(
            f"{empty_message}; give the EXR with the light groups, or a folder of them"
        )
    return candidates, [f"left out of the lights: {text}"] if text else []


def _visible(folder: Path) -> list[Path]:
    """Return the files that are not hidden; operating systems keep metadata in hidden ones."""
    try:
        return sorted(f for f in folder.iterdir() if not f.name.startswith(".") and f.is_file())
    except OSError as error:
        raise BasisError(f"cannot read {folder}: {error.strerror or error}") from None


def _named_exr(files: Iterable[Path]) -> list[Path]:
    return [file for file in files if file.suffix.lower() == ".exr"]


def _is_readable(file: Path) -> bool:
    """Return True if a file without the suffix `.exr` is an EXR."""
    try:
        return is_exr(file)
    except ImageError:
        return False


def _reason_against(file: Path, others: Sequence[Path]) -> str:
    """Return briefly why a file is not the render of a light; "" if it may be one."""
    if any(_is_same(file, other) for other in others):
        return "painting or mask"
    try:
        headers, _ = read_headers(file)
        channels = read_channels(file)
    except ImageError:
        return ""  # Reading it reports the error.
    if any(key.startswith(OWN) for header in headers for key in header):
        return "made by lightpaint"
    if any(name.startswith(f"{HALF_DIFFERENCE}.") for name in channels):
        return "made by lightpaint"
    if any(KRITA_LAYERS in header for header in headers):
        return "painted in Krita"
    return "a painting, with weights W" if "W" in channels else ""


def _is_same(file: Path, other: Path) -> bool:
    try:
        return file.samefile(other)
    except OSError:
        return False


def _list_with_reasons(reasons: dict[Path, str]) -> str:
    """Return files grouped by reason: `a.exr, b.exr (made by lightpaint); c.exr (painting or
    mask)`.
    """
    texts = []
    for reason in dict.fromkeys(reasons.values()):
        names = [file.name for file, reason_of_file in reasons.items() if reason_of_file == reason]
        texts.append(f"{some_names(names)} ({reason})")
    return "; ".join(texts)
