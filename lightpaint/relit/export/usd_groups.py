"""Multipliers of light groups as a USD layer over the stage that they were rendered from.

A multiplier scales the intensity and colour that a light has in the stage, whatever its unit.
"""

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from lightpaint.arrays import RGB
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

    Returns:
        The layer; its `left` has the groups without a light, and those whose lights are animated,
        which it leaves as they are.

    Raises OutputError if the library is not installed, or cannot read the stage.
    """
    usd.check_usd()
    from pxr import Sdf, Usd

    opened_stage = usd.open_stage(stage)
    lights = [prim for prim in opened_stage.Traverse() if _is_light(prim)]
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.comment = about
    layer_stage = Usd.Stage.Open(layer)
    left = []
    for group, multiplier in multipliers.items():
        members = lights_of_group(lights, group)
        if not members or any(map(_is_animated, members)):
            left.append(group)
            continue
        for prim in members:
            override = layer_stage.OverridePrim(prim.GetPath())
            if not by_frame:
                _multiply(override, prim, multiplier, Usd.TimeCode.Default())
            for frame, at_frame in (by_frame or {}).items():
                _multiply(override, prim, at_frame[group], Usd.TimeCode(frame))
    layer.subLayerPaths.append(Path(os.path.relpath(stage, folder)).as_posix())
    usd.like_stage(layer, stage)
    return usd.Overrides(layer.ExportToString(), tuple(left))


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
    from pxr import UsdLux

    light = UsdLux.LightAPI(prim)
    attributes = light.GetIntensityAttr(), light.GetColorAttr()
    return any(attribute.ValueMightBeTimeVarying() for attribute in attributes)


def _multiply(override: Any, prim: Any, multiplier: RGB, time: Any) -> None:
    """Scale intensity and colour at a time. The greatest multiplier goes to the intensity, so that
    the colour stays between 0 and 1 where it was.
    """
    from pxr import Gf, UsdLux

    present, light = UsdLux.LightAPI(prim), UsdLux.LightAPI(override)
    greatest = max(multiplier)
    intensity = present.GetIntensityAttr().Get() * max(greatest, 0.0)
    light.CreateIntensityAttr().Set(intensity, time)
    if greatest <= 0:
        return
    space = usd.color_space_of(prim)
    color = usd.to_rec709(present.GetColorAttr().Get(), space)
    scaled = [c * m / greatest for c, m in zip(color, multiplier, strict=True)]
    light.CreateColorAttr().Set(Gf.Vec3f(*usd.from_rec709(scaled, space)), time)
