"""The planes of the lights as a page has them: reduced, where it could not hold them whole."""

import numpy as np

from lightpaint.arrays import Bools, Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.cache.denoised_planes import scale_of
from lightpaint.images.pixel_blocks import block_mean, blocks_in, fitting_factor
from lightpaint.report.basis_memo import make_once

#: Maximum number of values, lights times pixels, that a page has: 400 MB as half floats.
MAX_PAGE_VALUES = 2**26

#: Number of values beyond which a session opens without smoothed or kept planes: these take a walk
#: over all planes, and the page can be used meanwhile.
MAX_OPENING_VALUES = 2**25


def page_factor(basis: Basis) -> int:
    """Return the side in pixels of the blocks whose means a page has; 1 for whole planes.

    basis: of the view, with every light at its place in the scene.
    """
    count, (height, width), factor = len(basis.lights), basis.size, 1
    while count * (height // factor) * (width // factor) > MAX_PAGE_VALUES:
        factor += 1
    return fitting_factor(basis.size, factor)


def opens_plain(basis: Basis) -> bool:
    """Return whether planes come as they are until denoised ones are there.

    basis: as in `page_factor`.
    """
    return len(basis.lights) * basis.size[0] * basis.size[1] > MAX_OPENING_VALUES


def plane_size(basis: Basis) -> tuple[int, int]:
    """Return the height and width of the planes that a page has. basis: as in `page_factor`."""
    return blocks_in(basis.size, page_factor(basis))


def page_plane(plane: Floats, basis: Basis) -> Floats:
    """Return a plane (h, w, 3) as a page has it. basis: as in `page_factor`."""
    return block_mean(plane, page_factor(basis))


def page_emitters(basis: Basis) -> Bools:
    """Return where emitters are seen in what a page has of a plane. basis: as in `page_factor`."""
    shares = block_mean(basis.emitters_seen.astype(np.float32), page_factor(basis))
    return np.asarray(shares > 0.5)


def plane_scale(basis: Basis, k: int) -> float:
    """Return the divisor of light k's plane for sending; 1 for lights that were added.

    basis: as in `page_factor`. The scales of all its lights take a walk over the planes, once.
    """
    if k >= len(basis.lights):
        return 1.0
    return make_once(basis, "page scales", lambda: [scale_of(plane) for plane in basis.planes])[k]
