"""Reads the photometric web of a luminaire from a file of its maker."""

from functools import lru_cache
from pathlib import Path

from lightpaint.errors import SceneError
from lightpaint.file_reading import read_bytes
from lightpaint.luminaires.eulumdat import parse_eulumdat
from lightpaint.luminaires.lm63 import parse_lm63
from lightpaint.luminaires.web import PhotometricWeb
from lightpaint.validation import BRIGHTEST

#: Longest file in bytes.
MAX_BYTES = 2**24

#: Difference between the integral of a web and the lumens that its file states, relative to these,
#: from which on it is worth a remark.
FLUX_TOLERANCE = 0.05

#: Readers by the ending of a file.
READERS = {".ies": parse_lm63, ".ldt": parse_eulumdat}


def read_web(path: Path) -> PhotometricWeb:
    """Read a photometric web from an IES (LM-63, type C) or EULUMDAT file.

    Raises SceneError, in one line that names the file, if it is damaged or of another kind.
    """
    data = read_bytes(path, "photometric file", SceneError, limit=MAX_BYTES)
    return _parsed(path, data)


@lru_cache(64)
def _parsed(path: Path, data: bytes) -> PhotometricWeb:
    parse = READERS.get(path.suffix.lower())
    if parse is None:
        raise SceneError(path, " is neither .ies nor .ldt: expected the file of a luminaire")
    try:
        # EULUMDAT is in ISO 8859-1; LM-63 is in ASCII, and names in it often are not.
        web = parse(data.decode("latin-1"))
        if not web.peak <= BRIGHTEST:
            raise SceneError(f"its intensities are up to {web.peak:.3g} cd: that is no light")
        if not web.flux > 0:
            raise SceneError("it is dark: all its intensities are 0")
    except SceneError as error:
        raise SceneError(path, ": ", error) from None
    return web


def unread_remark(web: PhotometricWeb, where: str) -> str | None:
    """Return a remark if a file goes on after its end; None if not. where: name of the file."""
    if not web.unread:
        return None
    count = "1 number" if web.unread == 1 else f"{web.unread} numbers"
    return (
        f"{where}: {count} after the last intensity that it announces, which count for nothing: "
        "check its numbers of angles"
    )


def flux_remark(web: PhotometricWeb, where: str) -> str | None:
    """Return a remark if the flux of a web is not what its file states; None if it is, or if the
    file states none.

    where: name of the file.
    """
    stated = web.stated_lumens
    if stated is None or abs(web.flux / stated - 1) <= FLUX_TOLERANCE:
        return None
    whose = "for its lamps" if web.of_lamps else "for the luminaire"
    return (
        f"{where}: its intensities add up to {web.flux:,.0f} lm, {web.flux / stated:.0%} of the "
        f"{stated:,.0f} lm that it states {whose}"
    )
