"""The basis: one image per light at unit emission, and its file.

On disk a basis is one multi-part OpenEXR file. Part k is named after light k and holds its
image as R, G, B; other programs can open it as it is. docs/formats.md has the details.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import RGB, Floats
from lightpaint.basis.checksums import CHECKSUMS_KEY, Checksums, check, checksum
from lightpaint.errors import BasisError, ImageError
from lightpaint.files import file_length, one_line, strict_json
from lightpaint.images.estimate import HALF_DIFFERENCE
from lightpaint.images.exr import Part, read_headers, read_parts, rgb_channels, write_parts
from lightpaint.version import __version__

FORMAT = "lightpaint-basis 1"
FORMAT_KEY = "lightpaint.format"
ORIGIN_KEY = "lightpaint.origin"
LIGHT_KEY = "lightpaint.light"
EMITTERS_SEEN = "emitters seen"
LEARNED = "learned"

#: Longest basis file that is read, in bytes; most samples, longest name and the like in it.
MAX_BYTES = 2**36
MAX_SAMPLES = 2**40
MAX_NAME = 10_000

#: What comes of a header that says something else than it should.
_DAMAGES = (AttributeError, LookupError, OverflowError, TypeError, ValueError)


@dataclass(frozen=True)
class BasisLight:
    """What a basis knows of a light.

    parameter, unit: what one unit of weight is (`radiance`, `W/(m² sr)`).
    emission: its present RGB emission in the scene, in that unit.
    form: its place and size, for people.
    is_scalar: whether it can only be scaled as a whole, and has one weight for all channels.
    is_fixed: whether it is what stays as it is: its weight is 1, whatever is painted.
    members: names of the emitters it consists of; itself if none are given.
    unit_flux: watts it radiates per channel at an emission of 1; None where that is not known.
    """

    name: str
    plugin: str
    parameter: str
    unit: str
    emission: RGB
    form: str = ""
    is_scalar: bool = False
    is_fixed: bool = False
    members: tuple[str, ...] = ()
    unit_flux: RGB | None = None

    def __post_init__(self) -> None:
        if not self.members:
            object.__setattr__(self, "members", (self.name,))
        if self.is_fixed and self.emission != (1, 1, 1):
            raise BasisError(f"light {self.name!r} is kept, and its emission is not 1")
        if not all(math.isfinite(v) and v >= 0 for v in self.emission):
            raise BasisError(
                f"light {self.name!r} has the emission {list(self.emission)}: "
                "need three numbers >= 0"
            )
        if self.unit_flux and not all(math.isfinite(v) and v >= 0 for v in self.unit_flux):
            raise BasisError(
                f"light {self.name!r} has a flux of {list(self.unit_flux)} at unit emission: "
                "need three numbers >= 0"
            )


@dataclass(frozen=True)
class Origin:
    """Where a basis comes from: what makes two of them comparable, and one go on.

    halves: samples per pixel of each of the two halves; passes: how many passes made them.
    each_light: where an interrupt left the lights of separate renders unequal, samples of half
    A and B and passes of A and B of each; `halves` and `passes` are then what all have at least.
    """

    scene: str
    scene_identity: str
    sensor: str
    seed: int
    method: str
    halves: tuple[int, int]
    passes: tuple[int, int]
    lightpaint: str = __version__
    each_light: tuple[tuple[int, int, int, int], ...] = ()

    @property
    def spp(self) -> int:
        """Samples per pixel in all."""
        return sum(self.halves)


@dataclass(frozen=True)
class Basis:
    """The images of a scene lit by one light at a time.

    lights: n of them; their order is the order of everything else.
    images: (n, h, w, 3) float32, linear Rec.709 radiance at unit emission.
    half_differences: (n, h, w, 3) float32, half the difference of two independent halves
    of the samples: the noise of `images`. Where an interrupt left the halves unequal, it
    overstates the noise a little. Zeros where nothing is known of it (see `knows_noise`).
    emitters_seen: (h, w) bool, pixels in which the camera sees an emitter directly.
    learned: (2, cells, emitters) float32, what the renderer found out on the way about which
    emitter matters where, or None. Going on needs it, nobody else.
    """

    lights: tuple[BasisLight, ...]
    images: Floats
    half_differences: Floats
    emitters_seen: npt.NDArray[np.bool_]
    origin: Origin
    learned: Floats | None = None

    def __post_init__(self) -> None:
        n = len(self.lights)
        if self.images.ndim != 4 or self.images.shape[0] != n or self.images.shape[3] != 3:
            shape = self.images.shape
            raise BasisError(f"images of shape {shape} for {n} lights: need (n, h, w, 3)")
        if self.half_differences.shape != self.images.shape:
            raise BasisError("half differences and images differ in shape")
        if self.emitters_seen.shape != self.size:
            raise BasisError("the mask of seen emitters has another size than the images")
        if len(set(self.names)) != n:
            raise BasisError(f"light names repeat: {', '.join(self.names)}")
        if len(self.origin.each_light) not in (0, n):
            raise BasisError(f"samples of {len(self.origin.each_light)} lights for {n} lights")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the lights, in the order of the images."""
        return tuple(light.name for light in self.lights)

    def image(self, name: str) -> Floats:
        """The image of the light called `name`, (h, w, 3). Raises BasisError if there is none."""
        if name not in self.names:
            raise BasisError(f"no light {name!r} in the basis: it has {', '.join(self.names)}")
        return np.asarray(self.images[self.names.index(name)])

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self.images.shape[1], self.images.shape[2]

    @property
    def knows_noise(self) -> bool:
        """Whether `half_differences` tell the noise: not where nobody knows of any samples."""
        return min(self.origin.halves) > 0 or bool(self.origin.each_light)

    @property
    def present_weights(self) -> npt.NDArray[np.float64]:
        """(n, 3) weights of the scene as it is."""
        return np.array([light.emission for light in self.lights], dtype=np.float64)

    @property
    def is_fixed(self) -> npt.NDArray[np.bool_]:
        """(n,), which lights stay as they are, with weight 1."""
        return np.array([light.is_fixed for light in self.lights], dtype=bool)

    @cached_property
    def power(self) -> npt.NDArray[np.float64]:
        """‖Φᵢ‖² over the picture, (n, 3) float64; where an emitter is seen, nothing counts."""
        counted = np.flatnonzero(~self.emitters_seen.ravel())
        rows = self.images.reshape(len(self.lights), -1, 3)
        power = np.zeros((len(self.lights), 3))
        for start in range(0, counted.size, 2**13):
            block = rows[:, counted[start : start + 2**13]].astype(np.float64)
            power += np.einsum("npc,npc->nc", block, block)
        return power

    def mix(self, weights: npt.NDArray[np.float64]) -> npt.NDArray[np.float32]:
        """The image Σ w_i Φ_i, (h, w, 3) float32. weights: (n, 3) in the order of the lights."""
        return mix(self.images, weights)


def mix(images: Floats, weights: npt.NDArray[np.float64]) -> npt.NDArray[np.float32]:
    """Σ w_i Φ_i in float32, without a copy of the images.

    images: (n, h, w, 3) float32; weights: (n, 3), one per light and channel. Returns (h, w, 3).
    """
    n, height, width, _ = images.shape
    # With a weight for every value of a row the innermost sums run along whole rows, not
    # over three channels at a time.
    along_row = np.tile(np.asarray(weights, np.float32), (1, width))
    rows = images.reshape(n, height, width * 3)
    mixed = np.einsum("nhk,nk->hk", rows, along_row)
    return np.asarray(mixed.reshape(height, width, 3), np.float32)


def write_basis(path: Path, basis: Basis) -> None:
    """Write `basis` as a multi-part EXR, whole or not at all."""
    parts, sums = [], {}
    for light, image, half in zip(basis.lights, basis.images, basis.half_differences, strict=True):
        about = json.dumps(_light_fields(light), ensure_ascii=False)
        channels = rgb_channels(image) | rgb_channels(half, HALF_DIFFERENCE)
        parts.append(Part(light.name, channels, {LIGHT_KEY: about}))
        sums[light.name] = checksum(about, channels)
    seen = {"Y": basis.emitters_seen.astype(np.float16)}
    # The format's rule: a part name never repeats, so a light may not take this one.
    parts.append(Part(_free_name(EMITTERS_SEEN, basis.names), seen))
    learned = {}
    if basis.learned is not None:
        learned = dict(zip(("received", "asked"), basis.learned, strict=True))
        # A table and no picture; the format wants one display window for all parts.
        parts.append(Part(_free_name(LEARNED, basis.names), learned, display=basis.size))
    origin = asdict(basis.origin)
    if not basis.origin.each_light:
        del origin["each_light"]  # as in files from before there was any
    of_origin = json.dumps(origin, ensure_ascii=False)
    checksums = Checksums(
        sums, checksum(of_origin, {}), checksum("", seen), checksum("", learned) if learned else ""
    )
    head = {FORMAT_KEY: FORMAT, ORIGIN_KEY: of_origin, CHECKSUMS_KEY: checksums.text()}
    parts[0] = Part(parts[0].name, parts[0].channels, {**head, **parts[0].attributes})
    write_parts(path, parts)


def read_basis(path: Path) -> Basis:
    """Read what `write_basis` wrote, also where another program has put its parts in another order.

    Raises ImageError if the file is damaged, BasisError if it is not a basis or not as it was
    written.
    """
    path = Path(path)
    file_length(path, "image file", ImageError, limit=MAX_BYTES)
    try:
        parts = read_parts(path)
        head = next((p.attributes for p in parts if FORMAT_KEY in p.attributes), {})
        if head.get(FORMAT_KEY) != FORMAT:
            found = one_line(repr(head.get(FORMAT_KEY, "no such mark")))
            raise BasisError(
                f"is not a basis this version can read: expected {FORMAT!r}, found {found}; "
                "make one with lightpaint basis"
            )
        return _of_parts(parts, head)
    except BasisError as error:
        raise BasisError(f"{path} {error}") from error
    except _DAMAGES as error:
        raise BasisError(f"{path} is damaged as a basis: {one_line(str(error))}") from error
    except MemoryError:
        raise ImageError(f"{path} takes more memory than there is") from None


def _of_parts(parts: Sequence[Part], head: Mapping[str, str]) -> Basis:
    """Raises BasisError, without naming the file, or one of _DAMAGES."""
    lit = [p.in_display_window() for p in parts if LIGHT_KEY in p.attributes]
    others = [p for p in parts if LIGHT_KEY not in p.attributes]
    seen = [p.in_display_window().channels["Y"] for p in others if "Y" in p.channels]
    if not lit or not seen:
        raise BasisError("has lost parts of its basis: make it again with lightpaint basis")
    try:
        lights = [_light(strict_json(p.attributes[LIGHT_KEY])) for p in lit]
        origin = _origin(strict_json(head[ORIGIN_KEY]))
        checksums = None
        if CHECKSUMS_KEY in head:
            checksums = Checksums.of_text(head[CHECKSUMS_KEY])
    except (BasisError, ImageError) as error:
        raise BasisError(f"is damaged as a basis: {one_line(str(error))}") from error
    order = list(range(len(lit)))
    if checksums is not None:
        order = checksums.in_order([light.name for light in lights])
        check(checksums.origin, "origin", head[ORIGIN_KEY], {})
    try:
        basis = Basis(
            lights=tuple(lights[k] for k in order),
            images=_stacked([lit[k] for k in order]),
            half_differences=_stacked([lit[k] for k in order], HALF_DIFFERENCE),
            emitters_seen=seen[0] > 0,
            origin=origin,
            learned=_learned(others, checksums),
        )
    except (BasisError, ImageError) as error:
        raise BasisError(f"is damaged as a basis: {one_line(str(error))}") from error
    if not (np.isfinite(basis.images).all() and np.isfinite(basis.half_differences).all()):
        raise BasisError("holds values that are not finite: make it again")
    if checksums is not None:
        for k, light in enumerate(lights):
            about, channels = lit[k].attributes[LIGHT_KEY], lit[k].channels
            check(checksums.lights[light.name], f"light {light.name!r}", about, channels)
        check(checksums.seen, "mask of seen emitters", "", {"Y": seen[0]})
    return basis


def _stacked(parts: Sequence[Part], layer: str = "") -> Floats:
    """(n, h, w, 3), without the copies that np.stack of np.stack would make."""
    stacked = np.empty((len(parts), *parts[0].size, 3), np.float32)
    for image, part in zip(stacked, parts, strict=True):
        if part.size != parts[0].size:
            raise BasisError(f"parts {parts[0].name!r} and {part.name!r} differ in size")
        prefix = f"{layer}." if layer else ""
        for k, c in enumerate("RGB"):
            if prefix + c not in part.channels:
                raise BasisError(f"no channel {prefix}{c} in part {part.name!r}")
            image[..., k] = part.channels[prefix + c]
    return stacked


def _learned(others: Sequence[Part], checksums: Checksums | None) -> Floats | None:
    """The table of what was learned; None for one that is not as it was, which nothing needs."""
    for channels in (p.channels for p in others if {"received", "asked"} <= p.channels.keys()):
        if checksums is not None and checksum("", channels) != checksums.learned:
            return None
        return np.stack([channels["received"], channels["asked"]])
    return None


def read_origin(path: Path) -> tuple[Origin, tuple[int, int], int]:
    """Origin, (height, width) and number of lights of the basis at `path`, without its pixels."""
    file_length(path, "basis", BasisError, limit=MAX_BYTES)
    try:
        headers, size = read_headers(path)
        lights = sum(LIGHT_KEY in header for header in headers)
        text = next(header[ORIGIN_KEY] for header in headers if ORIGIN_KEY in header)
        return _origin(strict_json(text)), size, lights
    except (*_DAMAGES, StopIteration) as error:
        said = one_line(str(error)) or "it does not say where it comes from"
        raise BasisError(f"{path} is no basis this version can read: {said}") from error


def is_basis_file(path: Path) -> bool:
    """Whether the name says so: a basis is an EXR, a scene is XML."""
    return path.suffix.lower() == ".exr"


def _origin(data: dict[str, Any]) -> Origin:
    halves, passes = (_counts(data.pop(key), 2) for key in ("halves", "passes"))
    each = tuple(_counts(counts, 4) for counts in data.pop("each_light", []))
    for name, value in data.items():
        if not isinstance(value, int if name == "seed" else str) or isinstance(value, bool):
            raise TypeError(f"{name} of the origin is {value!r}")
    return Origin(
        halves=(halves[0], halves[1]),
        passes=(passes[0], passes[1]),
        each_light=tuple((a, b, p, q) for a, b, p, q in each),
        **data,
    )


def _counts(values: Any, number: int) -> tuple[int, ...]:
    if not (
        isinstance(values, list)
        and len(values) == number
        and all(type(v) is int and 0 <= v <= MAX_SAMPLES for v in values)
    ):
        raise ValueError(f"{values!r} are not {number} numbers of samples or passes")
    return tuple(values)


def _light_fields(light: BasisLight) -> dict[str, Any]:
    """What the file says of a light; what goes without saying for one emitter is left out."""
    data = asdict(light)
    if light.members == (light.name,):
        del data["members"]
    if not light.is_fixed:
        del data["is_fixed"]
    if light.unit_flux is None:
        del data["unit_flux"]
    return data


def _light(data: dict[str, Any]) -> BasisLight:
    emission = _three(data.pop("emission"))
    members = data.pop("members", [])
    flux = data.pop("unit_flux", None)
    if not isinstance(members, list):
        raise TypeError(f"members is a list of names, not {members!r}")
    about = {key: data.pop(key, False) for key in ("is_scalar", "is_fixed")}
    if not all(isinstance(value, bool) for value in about.values()):
        raise TypeError(f"{about} are true or false")
    texts = (*members, *data.values())
    if not all(isinstance(text, str) and len(text) <= MAX_NAME for text in texts):
        raise TypeError(f"{texts} are texts of up to {MAX_NAME} characters")
    return BasisLight(
        emission=emission,
        members=tuple(members),
        unit_flux=None if flux is None else _three(flux),
        **about,
        **data,
    )


def _three(values: Any) -> RGB:
    if not isinstance(values, list) or not all(type(v) in (int, float) for v in values):
        raise TypeError(f"{values!r} is not a list of three numbers")
    r, g, b = map(float, values)
    return r, g, b


def _free_name(name: str, taken: tuple[str, ...]) -> str:
    while name in taken:
        name += "_"
    return name
