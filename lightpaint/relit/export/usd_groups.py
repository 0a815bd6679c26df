"""Multipliers of light groups as a USD layer over the stage that they were rendered from.

A multiplier scales the intensity and colour that a light has in the stage, whatever its unit.
"""

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.arrays import RGB
from lightpaint.basis import multipliers_in
from lightpaint.colour import to_rec709
from lightpaint.relit.export import usd

#: End of the attributes in which renderers keep the tag of a light, such as
#: `inputs:karma:light:lpetag`.
TAG = "light:lpetag"


def usd_multipliers(
    multipliers: Mapping[str, RGB],
    stage: Path,
    folder: Path,
    *,
    about: str = "",
    by_frame: Mapping[int, Mapping[str, RGB]] | None = None,
    primaries: tuple[float, ...] = (),
) -> usd.Overrides:
    """Return a layer that multiplies lights of a stage.

    A group belongs to the lights with its name as path (also with underscores for slashes) or as
    tag, or to the one light that has it as name.

    Args:
        multipliers: Of red, green and blue, by group.
        stage: The USD file, which becomes a sublayer.
        folder: The folder of the layer.
        about: Text for the layer's comment.
        by_frame: The multipliers at each frame, of lights that change over a shot: they become time
            samples instead.
        primaries: In which the renderer multiplies lights, as in `Origin`.

    Returns:
        The layer; its `left` has the groups without a light, and those whose lights are animated,
        which it leaves as they are.

    Raises OutputError if the library is not installed, or cannot read the stage.
    """
    usd.check_usd()
    from pxr import Sdf

    opened_stage = usd.open_stage(stage)
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.comment = about
    # The layer's own stage is closed before it has sublayers, for which it would look.
    left = _write_multiples(layer, opened_stage, multipliers, by_frame or {}, primaries)
    layer.subLayerPaths.append(Path(os.path.relpath(stage, folder)).as_posix())
    usd.like_stage(layer, stage)
    spaces = usd.unknown_spaces(opened_stage)
    return usd.Overrides(layer.ExportToString(), left, unknown_spaces=spaces)


def _write_multiples(
    layer: Any,
    opened_stage: Any,
    multipliers: Mapping[str, RGB],
    by_frame: Mapping[int, Mapping[str, RGB]],
    primaries: tuple[float, ...],
) -> tuple[str, ...]:
    """Write multiples of a stage's lights into the layer; return the groups that it lacks."""
    from pxr import Usd

    layer_stage, left = Usd.Stage.Open(layer), []
    lights = [prim for prim in opened_stage.Traverse() if _is_light(prim)]
    for group, multiplier in multipliers.items():
        members = lights_of_group(lights, group)
        if not members or any(map(_is_animated, members)):
            left.append(group)
            continue
        times = {Usd.TimeCode(frame): lit[group] for frame, lit in by_frame.items()}
        for prim in members:
            override = layer_stage.OverridePrim(prim.GetPath())
            for time, factor in (times or {Usd.TimeCode.Default(): multiplier}).items():
                _multiply(override, prim, factor, time, primaries)
    return tuple(left)


def lights_of_group(lights: Sequence[Any], group: str) -> list[Any]:
    """Return the prims that a group of this name was rendered from."""
    by_path = [x for x in lights if group in _path_names(str(x.GetPath()))]
    if by_path:
        return by_path
    if tagged := [x for x in lights if group in _tags(x)]:
        return tagged
    named = [x for x in lights if group in (x.GetName(), x.GetDisplayName())]
    return named if len(named) == 1 else []


def _path_names(path: str) -> tuple[str, ...]:
    """Return the names that a renderer may give to the group of a light by its path."""
    return path, path[1:], path.replace("/", "_"), path[1:].replace("/", "_")


def _tags(prim: Any) -> Iterable[str]:
    """Return the tags that a light has."""
    for attribute in prim.GetAuthoredAttributes():
        if attribute.GetName().casefold().endswith(TAG):
            yield str(attribute.Get())


def _is_light(prim: Any) -> bool:
    from pxr import UsdLux

    return bool(prim.HasAPI(UsdLux.LightAPI))


def _is_animated(prim: Any) -> bool:
    """Return whether time samples or nodes make the brightness or colour of a light."""
    from pxr import UsdLux

    light = UsdLux.LightAPI(prim)
    attributes = light.GetIntensityAttr(), light.GetColorAttr()
    return any(x.ValueMightBeTimeVarying() or x.HasAuthoredConnections() for x in attributes)


def _multiply(
    override: Any, prim: Any, multiplier: RGB, time: Any, primaries: tuple[float, ...]
) -> None:
    """Scale intensity and colour at a time. The greatest multiplier goes to the intensity, so that
    the colour stays between 0 and 1 where it was.

    multiplier: in Rec.709. primaries: in which the renderer multiplies, where it also multiplies
    the colour by temperature and texture, which stay.
    """
    from pxr import Gf, UsdLux

    present, light = UsdLux.LightAPI(prim), UsdLux.LightAPI(override)
    own = multipliers_in(primaries, np.array(multiplier))
    greatest = float(own.max())
    intensity = present.GetIntensityAttr().Get() * max(greatest, 0.0)
    light.CreateIntensityAttr().Set(intensity, time)
    if greatest <= 0:
        return
    color = np.array(present.GetColorAttr().Get(), np.float64)
    space = _space_of(prim, primaries)
    if space is not None:  # the colour is in another space than the one in which light multiplies
        color = multipliers_in(primaries, np.array(usd.to_rec709(color.tolist(), space)))
    color = color * own / greatest
    if space is not None:
        rec709 = color @ to_rec709(primaries).T if primaries else color
        color = np.array(usd.from_rec709(rec709.tolist(), space))
    light.CreateColorAttr().Set(Gf.Vec3f(*color.tolist()), time)


def _space_of(prim: Any, primaries: tuple[float, ...]) -> Any:
    """Return the space of a light's colour, as of `usd.color_space_of`; None where the renderer
    multiplies it as it is: a colour without a declared space is in the rendering space.
    """
    from pxr import Gf

    declared = usd.declared_space(prim)
    if not declared:
        return None
    space = usd.space_named(declared)
    if space is None:
        return Gf.ColorSpace(usd.REC709) if primaries else None
    corners = [x for xy in space.GetPrimariesAndWhitePoint()[:3] for x in xy]
    is_own = bool(primaries) and np.allclose(corners, primaries[:6], rtol=0, atol=0.01)
    return None if is_own else space
