"""The pictures that a page fetches: planes of the lights, previews, and aids for painting.

Planes are reduced where a page could not hold them whole.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.basis import Basis, array_once, scale_of
from lightpaint.colour import ViewTransform
from lightpaint.errors import PaintError
from lightpaint.images import block_mean, blocks_in, fitting_factor, resampled
from lightpaint.lighting import LiveView
from lightpaint.paint.protocol import PictureUpdate
from lightpaint.report import resized, thumbnail

#: Approximate pixels of a thumbnail's longer side.
THUMBNAIL_SIDE = 192

#: Points along each side of a lookup table, and the light at its ends, in stops.
LUT_SIDE, LUT_LOW, LUT_HIGH = 64, -13.0, 7.0

#: Built-in transforms for the display of a page.
TRANSFORMS = ("srgb", "filmic", "agx", "linear")

Picture = npt.NDArray[Any]

#: Maximum number of values, lights times pixels, that a page has: 400 MB as half floats.
MAX_PAGE_VALUES = 2**26

#: Number of lights from which the session mixes pictures for pages, if their planes have very many
#: values: then they hold no planes.
MIN_MIXED_LIGHTS = 160

#: Maximum number of pixels of pictures that the session mixes.
MAX_MIXED_PIXELS = 2**20

#: Number of values beyond which a session opens without smoothed or kept planes: these take a walk
#: over all planes, and the page can be used meanwhile.
MAX_OPENING_VALUES = 2**25


#: Light that is added to both pictures of a ratio, relative to the mean of the current look: where
#: that is black its ratio is of noise.
FLOOR = 1e-3

#: Largest ratio of a pixel to its surroundings, as of a lamp in view.
MAX_DETAIL = 16.0


class PictureTable:
    """Pictures by name, each with a generation number, made when they are first fetched.

    Updated in place. Names are as in the protocol: `plane/3`, `lut/agx`, `painting`, and of a
    view that is not the first `painting@1`.
    """

    def __init__(self) -> None:
        self.generations: dict[str, int] = {}
        self._counts: dict[str, int] = {}  # includes withdrawn ones, so that no generation repeats
        self._made: dict[str, Picture] = {}
        self._makers: dict[str, Callable[[], Picture]] = {}
        self._unkept = set[str]()
        self._families: dict[str, Callable[[str], Picture]] = {}

    def offer_family(self, prefix: str, make: Callable[[str], Picture]) -> None:
        """Add pictures that change under the brush and have no generation numbers.

        prefix: of their names, up to a slash. make: makes a picture from the rest of its name.
        """
        self._families[prefix] = make

    def offer(self, name: str, make: Callable[[], Picture], *, is_kept: bool = True) -> None:
        """Add a picture that `make` makes, replacing an earlier one of that name.

        is_kept: whether it is kept once it is made, for whoever fetches it again.
        """
        (self._unkept.discard if is_kept else self._unkept.add)(name)
        self.generations[name] = self._counts[name] = self._counts.get(name, 0) + 1
        self._makers[name] = make
        self._made.pop(name, None)

    def put(self, name: str, picture: Picture) -> None:
        """Add a picture that is already made."""
        self.offer(name, lambda: picture)

    def put_all(self, pictures: Mapping[str, Picture]) -> PictureUpdate:
        """Add pictures that are already made, by name; return the message that announces them."""
        for name, picture in pictures.items():
            self.put(name, picture)
        return self.announcement(pictures)

    def announcement(self, names: Iterable[str]) -> PictureUpdate:
        """Return the message that announces these pictures."""
        return PictureUpdate(resources={name: self.generations[name] for name in names})

    def keep(self, name: str, picture: Picture) -> None:
        """Keep a picture that its maker would make."""
        self._made[name] = picture

    def withdraw(self, name: str) -> None:
        """Remove a picture."""
        self.generations.pop(name, None)
        self._makers.pop(name, None)
        self._made.pop(name, None)

    def __getitem__(self, name: str) -> Picture:
        """Return a picture by name. Raises PaintError if there is none."""
        prefix, _, rest = name.partition("/")
        if prefix in self._families:
            return self._families[prefix](rest)
        make = self._makers.get(name)
        if make is None:
            raise PaintError(f"there is no picture {name[:40]!r}")
        if changes_under_brush(name) or name in self._unkept:
            return make()
        if name not in self._made:
            self._made[name] = make()
        return self._made[name]

    def stable_generations(self) -> dict[str, int]:
        """Return the generations by name, without pictures that change under the brush."""
        return {name: k for name, k in self.generations.items() if not changes_under_brush(name)}


def changes_under_brush(name: str) -> bool:
    """Return whether a picture changes under the brush."""
    return name.partition("@")[0] in ("painting", "importance")


def plane_thumbnail(plane: Floats, emitters_seen: Bools) -> Picture:
    """Return a thumbnail of a plane (h, w, 3), in display values."""
    picture, _ = thumbnail(plane, emitters_seen)
    return np.round(picture * 255).astype(np.uint8)


def display_thumbnail(
    light: Floats, transform: ViewTransform, side: int = THUMBNAIL_SIDE
) -> Picture:
    """Return a thumbnail of a linear picture (h, w, 3), in display values.

    side: approximate pixels of its longer side.
    """
    factor = min(1, side / max(light.shape[:2]))
    encoded = transform.encode(resized(light, factor) if factor < 1 else light)
    return np.round(encoded * 255).astype(np.uint8)


def lookup_table(transform: ViewTransform) -> Picture:
    """Return display values over the logarithm of light, (LUT_SIDE, LUT_SIDE, LUT_SIDE, 3).

    The first point of each axis is black; the others span LUT_LOW to LUT_HIGH stops, whose step is
    (LUT_HIGH - LUT_LOW) / (LUT_SIDE - 1).
    """
    axis = 2.0 ** np.linspace(LUT_LOW, LUT_HIGH, LUT_SIDE)
    axis[0] = 0.0
    r, g, b = np.meshgrid(axis, axis, axis, indexing="ij")
    light = np.stack([r, g, b], axis=-1).reshape(1, -1, 3)
    encoded = transform.encode(light).reshape(LUT_SIDE, LUT_SIDE, LUT_SIDE, 3)
    return np.asarray(encoded, np.float16)


def page_factor(basis: Basis) -> int:
    """Return the side in pixels of the blocks whose means a page has; 1 for whole planes.

    basis: of the view, with every light at its place in the scene.
    """
    count, (height, width), factor = len(basis.lights), basis.size, 1
    count, most = (1, MAX_MIXED_PIXELS) if has_mixes(basis) else (count, MAX_PAGE_VALUES)
    while count * (height // factor) * (width // factor) > most:
        factor += 1
    return fitting_factor(basis.size, factor)


def opens_plain(basis: Basis) -> bool:
    """Return whether planes come as they are until denoised ones are there.

    basis: as in `page_factor`.
    """
    return len(basis.lights) * basis.size[0] * basis.size[1] > MAX_OPENING_VALUES


def has_mixes(basis: Basis) -> bool:
    """Return whether the session mixes the pictures of a page, which has no planes: of many lights,
    and where a renderer multiplies them in its own primaries.

    basis: as in `page_factor`.
    """
    is_many = opens_plain(basis) and len(basis.lights) >= MIN_MIXED_LIGHTS
    return is_many or bool(basis.origin.primaries)


def plane_size(basis: Basis) -> tuple[int, int]:
    """Return the height and width of the planes or mixes that a page has.

    basis: as in `page_factor`.
    """
    return blocks_in(basis.size, page_factor(basis))


def page_plane(plane: Floats, basis: Basis) -> Floats:
    """Return a plane (h, w, 3) as a page has it. basis: as in `page_factor`."""
    return block_mean(plane, page_factor(basis))


def look_detail(live: LiveView, look: Floats, basis: Basis) -> Floats:
    """Return the current look (h, w, 3) over its own average over the blocks of pixels that follow
    the brush, as large as a page has it, float32.

    Any picture of these blocks, stretched over the look, gets its edges and textures by this factor
    (joint upsampling; Kopf et al. 2007). basis: as in `page_factor`.
    """
    average = live.averaged(look)
    floor = np.float32(FLOOR * look.mean() + np.finfo(np.float32).tiny)
    whole = (look + floor) / (resampled(average, look.shape[:2]) + floor)
    return block_mean(np.minimum(whole, np.float32(MAX_DETAIL)), page_factor(basis))


def page_emitters(basis: Basis) -> Bools:
    """Return where emitters are seen in what a page has of a plane. basis: as in `page_factor`."""
    shares = block_mean(basis.emitters_seen.astype(np.float32), page_factor(basis))
    return np.asarray(shares > 0.5)


def plane_scale(basis: Basis, k: int) -> float:
    """Return the divisor of light k's plane for sending; 1 for lights that were added, and while
    none has a plane.

    basis: as in `page_factor`. The scales of all its lights take a walk over the planes, once.
    """
    if k >= len(basis.lights) or basis.origin.is_plain_look:
        return 1.0
    return float(array_once(basis.planes, "scales", lambda: _scales(basis))[k])


def _scales(basis: Basis) -> Doubles:
    return np.array([scale_of(plane) for plane in basis.planes])
