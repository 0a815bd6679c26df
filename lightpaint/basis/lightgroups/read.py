"""A basis from another renderer's light groups: layers of an EXR file that add up to the picture.

A weight multiplies what was rendered, so that 1, 1, 1 is the light as it is. What the groups
lack of the beauty becomes one more light, `rest`, that stays as it is.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis, BasisLight, Origin, free_name
from lightpaint.basis.file import FORMAT_KEY
from lightpaint.basis.lightgroups.beauty import (
    LayerSum,
    beauty_among,
    beauty_by_sum,
    shares,
    spoken_sum,
)
from lightpaint.basis.lightgroups.conventions import is_known
from lightpaint.basis.lightgroups.layers import RenderLayer, read_layers
from lightpaint.basis.lightgroups.naming import Choice, choose_files, choose_layers
from lightpaint.errors import BasisError, ImageError
from lightpaint.images.exr import read_headers
from lightpaint.screen import shortly

#: What one unit of weight is.
AS_RENDERED = "× as rendered"

#: Files that a folder of light groups may have: more are the frames of a film.
MAX_FILES = 1000

#: Name of what the groups lack of the beauty, with underscores added should a light have it.
REST = "rest"


@dataclass(frozen=True)
class LightGroups:
    """What `read_light_groups` found.

    Attributes:
        basis: A light for each group, and `rest` last if something is missing.
        path: The file or folder.
        renderer: Whose names its layers have.
        layers: Those of the groups, in the order of the lights, without `rest` and without their
            pixels, which the basis has.
        beauty: None if the file has none.
        missing: Luminance that the groups lack of the beauty, as a share of it, pixel by pixel;
            None without a beauty.
        exceeding: Luminance that they have too much, likewise.
        holes: (h, w) bool, pixels where a layer is not finite. They are 0 in all images of the
            basis, so that they count nothing in any sum.
        remarks: What is worth knowing, one sentence each.

    Examples:
        >>> groups = lp.read_light_groups("groups.exr")
        >>> lp.solve(groups.basis, lp.Target.of(groups.basis.image("key")))
        Solution(closest there is ...)
    """

    basis: Basis
    path: Path
    renderer: str
    layers: tuple[RenderLayer, ...]
    beauty: RenderLayer | None
    missing: float | None
    exceeding: float | None
    holes: npt.NDArray[np.bool_]
    remarks: tuple[str, ...]

    __repr__ = shortly

    @property
    def has_rest(self) -> bool:
        """Whether the last light of the basis is what the groups lack."""
        return len(self.basis.lights) > len(self.layers)

    @property
    def files(self) -> list[Path]:
        """That they were read from."""
        return _files(self.path) if self.path.is_dir() else [self.path]

    @property
    def is_half(self) -> bool:
        """Whether the file holds no more than float16."""
        return all(layer.is_half for layer in self.layers)


def is_light_groups(path: Path) -> bool:
    """Whether `path` is a folder with an EXR, or an EXR that is no basis of lightpaint's own."""
    path = Path(path)
    if path.is_dir():
        return bool(_files(path))
    if path.suffix.lower() != ".exr" or not path.is_file():
        return False
    try:
        headers, _ = read_headers(path)
    except ImageError:
        return False
    return not any(FORMAT_KEY in header for header in headers)


def read_light_groups(path: str | Path, *, pattern: str | None = None) -> LightGroups:
    """Read the light groups of an EXR file, or of a folder with a file for each.

    Args:
        path: EXR file, or folder.
        pattern: `Light_{name}`, which layers, parts or files are lights; by default the names that
            known renderers give them (naming.py).

    Raises:
        ImageError: For a file that cannot be read or is not linear Rec.709.
        BasisError: Where the lights cannot be told from other layers, or differ in size.

    Examples:
        >>> groups = lp.read_light_groups("groups.exr")
        >>> groups.renderer, groups.basis.names
        ('Arnold', ('fill', 'key', 'rim'))
    """
    path = Path(path)
    if path.is_dir() and len(files := _files(path)) > MAX_FILES:
        raise BasisError(
            f"{path} holds {len(files)} EXR files, more than {MAX_FILES}: is it a sequence of "
            "frames? give a folder with the light groups of one"
        )
    layers = {layer.name: layer for layer in read_layers(path)}
    choice = _choose(path, layers, pattern)
    beauty = layers[choice.beauty] if choice.beauty is not None else None
    names, lights = list(choice.lights), [layers[name] for name in choice.lights.values()]
    used = {id(layer) for layer in lights}
    others = [layer for layer in layers.values() if id(layer) not in used]
    if beauty is None:
        beauty = beauty_by_sum(others, lights)
    if beauty is None and choice.renderer == "one file per light" and len(lights) > 2:
        # One of them may be the picture under a name of its own.
        beauty = beauty_among(lights)
        kept = [(n, x) for n, x in zip(names, lights, strict=True) if x is not beauty]
        names, lights = [n for n, _ in kept], [x for _, x in kept]
    for name, layer in choice.beside.items():
        here = layers[layer]
        # Whether a renderer counts these among its groups depends on version and settings.
        if beauty is None or not lights or _helps(here, lights, beauty):
            names.append(name)
            lights.append(here)
    return _light_groups(path, choice, names, lights, beauty)


def _files(folder: Path) -> list[Path]:
    """What may be EXR files in a folder. Raises BasisError if it cannot be looked into."""
    try:
        return [file for file in folder.iterdir() if file.suffix.lower() == ".exr"]
    except OSError as error:
        raise BasisError(f"cannot read {folder}: {error.strerror or error}") from None


def _helps(layer: RenderLayer, lights: Sequence[RenderLayer], beauty: RenderLayer) -> bool:
    """Whether the lights come closer to the beauty with that layer."""
    added = LayerSum.of(lights)
    return added.and_also(layer).lacks(beauty) < added.lacks(beauty)


def _choose(path: Path, layers: dict[str, RenderLayer], pattern: str | None) -> Choice:
    by_file: dict[Path, int] = {}
    for layer in layers.values():
        by_file[layer.file] = by_file.get(layer.file, 0) + 1
    if pattern is None and len(by_file) == len(layers) > 1 and not any(map(is_known, layers)):
        return choose_files(layers)
    others = {name: layer.others for name, layer in layers.items()}
    return choose_layers(others, pattern=pattern, where=str(path))


def _light_groups(
    path: Path,
    choice: Choice,
    names: list[str],
    lights: list[RenderLayer],
    beauty: RenderLayer | None,
) -> LightGroups:
    if not lights:
        raise BasisError(f"{path} has no light group beside its beauty {beauty and beauty.name!r}")
    read = [*lights, beauty] if beauty is not None else lights
    holes = ~np.logical_and.reduce([np.isfinite(x.image).all(axis=-1) for x in read])
    if holes.all():
        raise BasisError(f"{path} holds NaN or Inf in every pixel: render it again")
    rest, missing, exceeding, told = _what_is_missing(lights, beauty, holes)
    remarks = [f"light groups as of {choice.renderer}: {', '.join(names)}", *choice.remarks, told]
    if lights[0].primaries is not None:
        remarks.append(
            "the file has other primaries than Rec.709: multipliers are of its channels in linear "
            "Rec.709, which a renderer that works in other primaries meets nearly, not quite"
        )
    if holes.any():
        remarks.append(f"{int(holes.sum())} pixels hold NaN or Inf in a layer and count nothing")
    basis = _basis(path, choice, dict(zip(names, lights, strict=True)), rest, holes)
    without_pixels = np.empty((0, 0, 3))
    layers = [replace(x, image=without_pixels.astype(x.image.dtype)) for x in lights]
    return LightGroups(
        basis,
        path,
        choice.renderer,
        tuple(layers),
        beauty,
        missing,
        exceeding,
        holes,
        tuple(remarks),
    )


def _what_is_missing(
    lights: list[RenderLayer], beauty: RenderLayer | None, holes: npt.NDArray[np.bool_]
) -> tuple[Floats | None, float | None, float | None, str]:
    """What the groups lack of the beauty, if that is more than rounding; its shares, in words."""
    if beauty is None:
        told = "no beauty among the layers, so that nothing tells whether the groups are all of it"
        return None, None, None, told
    whole = _filled(beauty.image, holes).astype(np.float64)
    rest = whole - sum(_filled(layer.image, holes).astype(np.float64) for layer in lights)
    missing, exceeding = shares(rest, whole)
    told, is_missing = spoken_sum(rest, whole, [*lights, beauty], missing, exceeding)
    return rest if is_missing else None, missing, exceeding, told


def _basis(
    path: Path,
    choice: Choice,
    lights: dict[str, RenderLayer],
    rest: Floats | None,
    holes: npt.NDArray[np.bool_],
) -> Basis:
    """In linear Rec.709; `rest`, if there is one, as a light that stays as it is."""
    made = [_light(name, layer.name, "light group") for name, layer in lights.items()]
    height, width = holes.shape
    images = np.empty((len(lights) + (rest is not None), height, width, 3), np.float32)
    first = next(iter(lights.values()))
    for image, layer in zip(images, lights.values(), strict=False):
        image[:] = layer.in_rec709(_filled(layer.image, holes))
    if rest is not None:
        made.append(
            _light(free_name(REST, lights), "beauty less the groups", "rest", is_fixed=True)
        )
        images[-1] = first.in_rec709(rest)
    return Basis(
        lights=tuple(made),
        images=images,
        half_differences=np.zeros_like(images),
        emitters_seen=np.zeros(holes.shape, dtype=bool),
        origin=_origin(path, choice, images, [*lights]),
    )


def _light(name: str, layer: str, plugin: str, *, is_fixed: bool = False) -> BasisLight:
    form = layer if layer != name else ""
    return BasisLight(name, plugin, "", AS_RENDERED, (1.0, 1.0, 1.0), form, is_fixed=is_fixed)


def _origin(path: Path, choice: Choice, images: Floats, names: Sequence[str]) -> Origin:
    """Of samples nothing is known: no half has any, and so there are no error bars."""
    digest = hashlib.sha256(repr((names, images.shape)).encode())
    for image in images:
        digest.update(np.ascontiguousarray(image).data)
    return Origin(
        scene=path.name,
        scene_identity=digest.hexdigest()[:32],
        sensor=choice.view or "as rendered",
        seed=0,
        method=f"light groups of {choice.renderer}",
        halves=(0, 0),
        passes=(0, 0),
    )


def _filled(image: Floats, holes: npt.NDArray[np.bool_]) -> npt.NDArray[np.float32]:
    return np.where(holes[..., None], np.float32(0), image.astype(np.float32))
