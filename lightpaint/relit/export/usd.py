"""A lighting as a layer of USD that overrides lights of a stage, and nothing else.

UsdLux's intensity is radiance; for lights that normalize it, the flux of their whole surface. So
that neither radius nor size of a prim matter, panels and skies are written unnormalized, at their
radiance, and suns and points normalized: a sun at its irradiance, a sphere, whose surface is four
times its visible disk, at four times its intensity.
"""

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lightpaint.arrays import RGB
from lightpaint.errors import OutputError
from lightpaint.files import one_line

#: Whether the light is normalized, by Mitsuba's parameter.
NORMALIZED = {"radiance": False, "irradiance": True, "intensity": True}

#: Ratio of a prim's surface to its visible area along its axis, or from the side.
SURFACE = {"SphereLight": 4.0, "CylinderLight": 3.141592653589793}

#: The assumed place of lights without a stage.
SCOPE = "/lights"


@dataclass(frozen=True)
class Overrides:
    """The layer as text, and the names of lights that are not in it."""

    text: str
    left: tuple[str, ...]


def check_usd() -> None:
    """Raise OutputError if the library is not installed."""
    try:
        import pxr.UsdLux  # noqa: F401
    except ImportError:
        raise OutputError(
            "USD needs a library that is not installed: pip install 'lightpaint[usd]'"
        ) from None


def usd_overrides(
    emitters: Iterable[tuple[str, str, RGB]], stage: Path | None, folder: Path, *, about: str = ""
) -> Overrides:
    """Return the layer.

    Args:
        emitters: Name, Mitsuba's parameter and emission of each adjusted one; "" for a multiple of
            the present emission, which is left to the user.
        stage: Any USD file with lights of these names: the layer lies over it. Without one they
            are prims below /lights.
        folder: The folder of the layer.
        about: A description for its comment.

    Raises OutputError if the library is not installed, or cannot read the stage.
    """
    check_usd()
    from pxr import Sdf, Tf, Usd

    stage_lights = None if stage is None else _lights_of(stage)
    layer = Sdf.Layer.CreateAnonymous(".usda")
    override_stage = Usd.Stage.Open(layer)
    layer.comment = about
    left = []
    for name, parameter, emission in emitters:
        identifier = Tf.MakeValidIdentifier(name)
        places = {f"{SCOPE}/{identifier}": "SphereLight"}
        if stage_lights is not None:
            places = stage_lights.get(name) or stage_lights.get(identifier) or {}
        if parameter not in NORMALIZED or len(places) != 1:
            left.append(name)
            continue
        [(path, kind)] = places.items()
        _override(override_stage.OverridePrim(path), kind, parameter, emission)
    if stage is not None:
        # As soon as it is there, an open stage would look for it, from a layer that is nowhere yet.
        del override_stage
        layer.subLayerPaths.append(Path(os.path.relpath(stage, folder)).as_posix())
        _like(layer, stage)
    return Overrides(layer.ExportToString(), tuple(left))


def _override(prim: Any, kind: str, parameter: str, emission: RGB) -> None:
    """Set all properties of a light that its brightness and colour depend on."""
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


def _lights_of(stage: Path) -> Mapping[str, dict[str, str]]:
    """Return the path and the type of each light of a stage, by name."""
    from pxr import Tf, Usd, UsdLux

    if not stage.is_file():
        raise OutputError(f"no such stage: {stage}")
    try:
        opened = Usd.Stage.Open(str(stage))
    except Tf.ErrorException as error:
        message = one_line(str(error), limit=200)
        raise OutputError(f"{stage} is no stage of USD: {message}") from None
    by_path: dict[str, dict[str, str]] = {}
    for prim in opened.Traverse():
        if prim.HasAPI(UsdLux.LightAPI):
            for name in dict.fromkeys((prim.GetName(), prim.GetDisplayName())):
                if name:
                    by_path.setdefault(name, {})[str(prim.GetPath())] = str(prim.GetTypeName())
    return by_path


def _like(layer: Any, stage: Path) -> None:
    """Copy axes, units and the default prim of the stage to the layer."""
    from pxr import Sdf

    root = Sdf.Layer.FindOrOpen(str(stage))
    if root.HasDefaultPrim():
        layer.defaultPrim = root.defaultPrim
    for key in ("upAxis", "metersPerUnit"):
        if root.pseudoRoot.HasInfo(key):
            layer.pseudoRoot.SetInfo(key, root.pseudoRoot.GetInfo(key))
