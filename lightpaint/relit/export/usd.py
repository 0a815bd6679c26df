"""A lighting as a USD layer that overrides lights of a stage and adds new ones, but nothing else.

UsdLux's intensity is a radiance or, for normalized lights, the flux of their whole surface. To be
independent of a prim's radius or size, panels and skies are written unnormalized with their
radiance, and suns and points normalized: a sun with its irradiance, and a sphere, whose surface is
four times its visible disk, with four times its intensity.
"""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from lightpaint.arrays import RGB, Position
from lightpaint.errors import OutputError
from lightpaint.files import one_line
from lightpaint.relit.export.sky_maps import map_axes
from lightpaint.relit.export.usd_places import UsdPlaces, set_image
from lightpaint.scene.properties.site import EmitterPlace

#: Whether a light is normalized, by Mitsuba's parameter.
NORMALIZED = {"radiance": False, "irradiance": True, "intensity": True}

#: Ratio of a prim's surface to its area visible along its axis, or from the side.
SURFACE = {"SphereLight": 4.0, "CylinderLight": 3.141592653589793}

#: What of a light in a stage multiplies its emission by direction or place.
MULTIPLYING = ("inputs:shaping:ies:file", "inputs:shaping:focus", "inputs:texture:file")

#: Path of lights if there is no stage.
SCOPE = "/lights"


@dataclass(frozen=True)
class Overrides:
    """The layer as text, and the names of lights that it lacks.

    left: names of lights that are not in it. unplaced: names of lights whose brightness is in it,
    but not their new place.
    """

    text: str
    left: tuple[str, ...]
    unplaced: tuple[str, ...] = ()


def check_usd() -> None:
    """Raise OutputError if the USD library is not installed."""
    try:
        import pxr.UsdLux  # noqa: F401
    except ImportError:
        raise OutputError(
            "USD needs a library that is not installed: pip install 'lightpaint[usd]'"
        ) from None


def usd_overrides(
    emitters: Iterable[tuple[str, str, RGB]],
    stage: Path | None,
    folder: Path,
    *,
    places: Sequence[EmitterPlace] = (),
    up: Position = (0.0, 1.0, 0.0),
    skies: Mapping[str, str] = MappingProxyType({}),
    panels: Mapping[str, str] = MappingProxyType({}),
    about: str = "",
) -> Overrides:
    """Return the layer.

    Args:
        emitters: Name, Mitsuba's parameter and emission of each adjusted emitter; the parameter is
            "" for a multiple of the current emission, which is left to the user.
        stage: A USD file with lights of these names, which becomes a sublayer. Without it, lights
            are prims below /lights.
        folder: The folder of the layer.
        places: Places of all emitters in the answer. Those that moved or are new are written to the
            layer, in the stage's axes and the scene's units.
        up: The scene's up axis.
        skies: File of each sky's map beside the layer, by its name.
        panels: File of the image of each rectangle, as it is seen from the front, by its name.
        about: Text for the layer's comment.

    Raises OutputError if the library is not installed, or cannot read the stage.
    """
    check_usd()
    from pxr import Sdf

    opened_stage = None if stage is None else open_stage(stage)
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.comment = about
    # The layer's own stage is closed when this call returns: while open, it would look for
    # sublayers as soon as there are any, starting from a layer without a path.
    written = list(emitters), places, up, skies, panels
    unset_names, unplaced = _write_lights(layer, opened_stage, *written)
    if stage is not None:
        layer.subLayerPaths.append(Path(os.path.relpath(stage, folder)).as_posix())
        like_stage(layer, stage)
    return Overrides(layer.ExportToString(), unset_names, unplaced)


def _write_lights(
    layer: Any,
    opened_stage: Any,
    emitters: Sequence[tuple[str, str, RGB]],
    places: Sequence[EmitterPlace],
    up: Position,
    skies: Mapping[str, str],
    panels: Mapping[str, str],
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Write all lights into the layer; return `left` and `unplaced`, as in `Overrides`."""
    from pxr import Usd

    layer_stage = Usd.Stage.Open(layer)
    names = dict.fromkeys(
        [*(name for name, _, _ in emitters), *(x.name for x in places), *skies, *panels]
    )
    if opened_stage is None:
        new = {place.name for place in places if place.new}
        prims = _assumed_prims(name for name in names if name not in new)
    else:
        prims = _prims_of(opened_stage, names)
    writer = UsdPlaces(layer_stage, opened_stage, prims, places, up)
    light_prims = {**prims, **writer.add_new(_scope(opened_stage))}
    unset_names, unturned = [], []

    def override(path: str, kind: str, parameter: str, emission: RGB) -> Any:
        prim = layer_stage.OverridePrim(path)
        present = None if opened_stage is None else opened_stage.GetPrimAtPath(path)
        _override(prim, present or None, kind, parameter, emission)
        return prim

    for name, file in skies.items():
        path, kind = light_prims.get(name, ("", ""))
        if opened_stage is not None and not kind.startswith("DomeLight"):
            unset_names.append(name)
            continue
        override(path, kind, "radiance", (1.0, 1.0, 1.0))
        if not writer.place_sky(path, map_axes(up), file):
            unturned.append(name)
    for name, file in panels.items():
        path, kind = light_prims.get(name, ("", ""))
        if opened_stage is not None and kind != "RectLight":
            unset_names.append(name)
            continue
        set_image(override(path, kind, "radiance", (1.0, 1.0, 1.0)), file)
    for name, parameter, emission in emitters:
        if parameter not in NORMALIZED or name not in light_prims:
            unset_names.append(name)
            continue
        path, kind = light_prims[name]
        override(path, kind, parameter, emission)
    return tuple(unset_names), (*unturned, *writer.move())


def _assumed_prims(names: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Return path and type of lights if there is no stage."""
    from pxr import Tf

    return {name: (f"{SCOPE}/{Tf.MakeValidIdentifier(name)}", "SphereLight") for name in names}


def _prims_of(opened_stage: Any, names: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Return path and type of the lights that occur exactly once in the stage."""
    from pxr import Tf

    stage_lights, prims = _lights_of(opened_stage), {}
    for name in names:
        types = stage_lights.get(name) or stage_lights.get(Tf.MakeValidIdentifier(name)) or {}
        if len(types) == 1:
            [prims[name]] = types.items()
    return prims


def _scope(opened_stage: Any) -> str:
    """Return the path of the parent of new lights."""
    if opened_stage is None or not (root := opened_stage.GetDefaultPrim()):
        return SCOPE
    return f"{root.GetPath()}{SCOPE}"


def _override(prim: Any, present: Any, kind: str, parameter: str, emission: RGB) -> None:
    """Set all properties of a light that affect its brightness and colour.

    present: the light in the stage; None without one. A profile or a picture that it has there
    would multiply the light, and is left out.
    """
    from pxr import Gf, UsdLux

    brightest = max(emission)
    color = [channel / brightest for channel in emission] if brightest > 0 else [1.0] * 3
    surface = SURFACE.get(kind, 1.0) if parameter == "intensity" else 1.0
    light = UsdLux.LightAPI(prim)
    light.CreateIntensityAttr(surface * max(brightest, 0.0))
    light.CreateExposureAttr(0.0)
    light.CreateColorAttr(Gf.Vec3f(*color))
    light.CreateEnableColorTemperatureAttr(False)
    light.CreateNormalizeAttr(NORMALIZED[parameter])
    light.CreateDiffuseAttr(1.0)
    light.CreateSpecularAttr(1.0)
    for name in MULTIPLYING:
        if present is not None and (attribute := present.GetAttribute(name)).IsAuthored():
            kind_of_value = attribute.GetTypeName()
            prim.CreateAttribute(name, kind_of_value, custom=False).Block()


def open_stage(stage: Path) -> Any:
    """Open a stage. Raises OutputError if it is invalid."""
    from pxr import Tf, Usd

    if not stage.is_file():
        raise OutputError(f"no such stage: {stage}")
    try:
        return Usd.Stage.Open(str(stage))
    except Tf.ErrorException as error:
        message = one_line(str(error), limit=200)
        raise OutputError(f"{stage} is not a USD stage: {message}") from None


def _lights_of(opened_stage: Any) -> Mapping[str, dict[str, str]]:
    """Return path and type of each light of a stage, by name."""
    from pxr import UsdLux

    by_path: dict[str, dict[str, str]] = {}
    for prim in opened_stage.Traverse():
        if prim.HasAPI(UsdLux.LightAPI):
            for name in dict.fromkeys((prim.GetName(), prim.GetDisplayName())):
                if name:
                    by_path.setdefault(name, {})[str(prim.GetPath())] = str(prim.GetTypeName())
    return by_path


def like_stage(layer: Any, stage: Path) -> None:
    """Copy the axes, units and default prim of the stage to the layer."""
    from pxr import Sdf

    root = Sdf.Layer.FindOrOpen(str(stage))
    if root.HasDefaultPrim():
        layer.defaultPrim = root.defaultPrim
    for key in ("upAxis", "metersPerUnit"):
        if root.pseudoRoot.HasInfo(key):
            layer.pseudoRoot.SetInfo(key, root.pseudoRoot.GetInfo(key))
