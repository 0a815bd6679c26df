"""A lighting as a USD layer that overrides lights of a stage and adds new ones, but nothing else.

UsdLux's intensity is a radiance or, for normalized lights, the flux of their whole surface. To be
independent of a prim's radius or size, panels and skies are written unnormalized with their
radiance, and suns and points normalized: a sun with its irradiance, and a sphere, whose surface is
four times its visible disk, with four times its intensity. Places of moved and new lights become
transforms, cones, and prims of new lights.
"""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from lightpaint.arrays import RGB, Doubles, Position, as_rgb
from lightpaint.basis import free_name
from lightpaint.errors import OutputError
from lightpaint.files import one_line
from lightpaint.relit.export.program_axes import (
    axis_conversions,
    conversion_of,
    has_new_cone,
    is_changed,
    map_axes,
    old_position,
)
from lightpaint.scene.properties.site import EmitterPlace

#: Whether a light is normalized, by Mitsuba's parameter.
NORMALIZED = {"radiance": False, "irradiance": True, "intensity": True}

#: The space of all colours here, as USD calls it, and spaces whose numbers are not converted.
REC709 = "lin_rec709_scene"
UNCONVERTED = {REC709, "lin_rec709", "raw", "data", "identity", "unknown"}

#: USD's names of the spaces that OpenColorIO's configurations for ACES call otherwise.
OCIO_NAMES = {
    "ACES - ACEScg": "lin_ap1_scene",
    "ACES2065-1": "lin_ap0_scene",
    "ACES - ACES2065-1": "lin_ap0_scene",
    "acescg": "lin_ap1_scene",
    "lin_ap1": "lin_ap1_scene",
    "Linear Rec.2020": "lin_rec2020_scene",
    "lin_rec2020": "lin_rec2020_scene",
    "Linear P3-D65": "lin_p3d65_scene",
    "Linear Rec.709 (sRGB)": REC709,
    "Utility - Linear - sRGB": REC709,
}

#: Ratio of a prim's surface to its area visible along its axis, or from the side.
SURFACE = {"SphereLight": 4.0, "CylinderLight": 3.141592653589793}

#: What of a light in a stage multiplies its emission by direction or place.
MULTIPLYING = ("inputs:shaping:ies:file", "inputs:shaping:focus", "inputs:texture:file")

#: What of a light in a stage nodes may make, and what is written here instead.
CONNECTED = (
    "inputs:intensity",
    "inputs:exposure",
    "inputs:color",
    "inputs:enableColorTemperature",
    "inputs:colorTemperature",
    "inputs:normalize",
    "inputs:diffuse",
    "inputs:specular",
    *MULTIPLYING,
)

#: Path of lights if there is no stage.
SCOPE = "/lights"

#: Up axes of stages, by token.
UP_AXES = {"Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}

#: Schema for each kind of new light. A spot is a sphere with shaping.
SCHEMAS = {"point": "SphereLight", "spot": "SphereLight", "panel": "RectLight"}

#: Radius of new points in units of the stage, for renderers without point lights.
RADIUS = 0.01

#: Types of lights that shine along their -z axis.
AIMED = ("SphereLight", "RectLight", "DiskLight", "DistantLight")


@dataclass(frozen=True)
class Overrides:
    """The layer as text, and the names of lights that it lacks.

    left: names of lights that are not in it. unplaced: names of lights whose brightness is in it,
    but not their new place. in_part: names of lights that the stage hides, or lets shine on some
    prims alone. unknown_spaces: colour spaces of the stage that are unknown, whose colours are
    written as linear Rec.709.
    """

    text: str
    left: tuple[str, ...]
    unplaced: tuple[str, ...] = ()
    in_part: tuple[str, ...] = ()
    unknown_spaces: tuple[str, ...] = ()


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
    unset_names, unplaced, in_part = _write_lights(layer, opened_stage, *written)
    if stage is not None:
        layer.subLayerPaths.append(Path(os.path.relpath(stage, folder)).as_posix())
        like_stage(layer, stage)
    spaces = () if opened_stage is None else unknown_spaces(opened_stage)
    return Overrides(layer.ExportToString(), unset_names, unplaced, in_part, spaces)


def _write_lights(
    layer: Any,
    opened_stage: Any,
    emitters: Sequence[tuple[str, str, RGB]],
    places: Sequence[EmitterPlace],
    up: Position,
    skies: Mapping[str, str],
    panels: Mapping[str, str],
) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Write all lights into the layer; return `left`, `unplaced` and `in_part` of `Overrides`."""
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
    changed = [name for name in light_prims if name not in unset_names]
    in_part = [x for x in changed if _shines_in_part(opened_stage, light_prims[x][0])]
    return tuple(unset_names), (*unturned, *writer.move()), tuple(in_part)


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

    present: the light in the stage; None without one. A profile, a picture or filters that it has
    there would multiply the light, and are left out.
    """
    from pxr import Gf, UsdLux

    emission = from_rec709(emission, color_space_of(present))
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
    if present is None:
        return
    for name in MULTIPLYING:
        if (attribute := present.GetAttribute(name)).IsAuthored():
            prim.CreateAttribute(name, attribute.GetTypeName(), custom=False).Block()
    for name in CONNECTED:
        if (attribute := present.GetAttribute(name)).HasAuthoredConnections():
            override = prim.CreateAttribute(name, attribute.GetTypeName(), custom=False)
            override.SetConnections([])
    stage_light = UsdLux.LightAPI(present)
    if stage_light.GetFiltersRel().GetTargets():
        light.CreateFiltersRel().SetTargets([])
    # The light of a mesh is multiplied by what its material emits, unless it has no material.
    if stage_light.GetMaterialSyncModeAttr().Get() == UsdLux.Tokens.materialGlowTintsLight:
        light.CreateMaterialSyncModeAttr(UsdLux.Tokens.noMaterialResponse)


def _shines_in_part(opened_stage: Any, path: str) -> bool:
    """Return whether a stage hides a light, or links it to some prims alone."""
    from pxr import UsdGeom, UsdLux

    prim = None if opened_stage is None else opened_stage.GetPrimAtPath(path)
    if not prim:
        return False
    if UsdGeom.Imageable(prim).ComputeVisibility() == UsdGeom.Tokens.invisible:
        return True
    linked = UsdLux.LightAPI(prim).GetLightLinkCollectionAPI()
    is_whole = linked.GetIncludeRootAttr().Get() and not linked.GetExcludesRel().GetTargets()
    return not is_whole


def declared_space(prim: Any) -> str:
    """Return the name of the colour space that a stage declares for a light's colour, or "".

    Before USD 24.11 stages declare none.
    """
    from pxr import Usd, UsdLux

    if prim is None or not hasattr(Usd, "ColorSpaceAPI"):
        return ""
    color = UsdLux.LightAPI(prim).GetColorAttr()
    return str(Usd.ColorSpaceAPI.ComputeColorSpaceName(color, None))


def rendering_space(stage: Any) -> str:
    """Return the name of the space that the stage's settings let renderers work in, or ""."""
    from pxr import UsdRender

    settings = UsdRender.Settings.GetStageRenderSettings(stage)
    name = settings.GetRenderingColorSpaceAttr().Get() if settings else None
    return str(name or "")


def color_space_of(prim: Any) -> Any:
    """Return the colour space of a light's colour; None for linear Rec.709, and in old USD.

    A colour without a declared space is in the rendering space (UsdLux).
    """
    if prim is None:
        return None
    return space_named(declared_space(prim) or rendering_space(prim.GetStage()))


def space_named(name: str) -> Any:
    """Return a colour space by name; None for linear Rec.709, for unknown ones, and in old USD."""
    from pxr import Gf

    name = OCIO_NAMES.get(name, name)
    if not name or name in UNCONVERTED or not _is_known(name):
        return None
    return Gf.ColorSpace(name)


def _is_known(name: str) -> bool:
    from pxr import Gf

    return hasattr(Gf, "ColorSpace") and bool(Gf.ColorSpace.IsValid(name))


def unknown_spaces(stage: Any) -> tuple[str, ...]:
    """Return the names of spaces that a stage has colours of lights in, and that are unknown."""
    from pxr import UsdLux

    names = dict.fromkeys(
        declared_space(prim) or rendering_space(stage)
        for prim in stage.Traverse()
        if prim.HasAPI(UsdLux.LightAPI)
    )
    known = {"", *UNCONVERTED, *OCIO_NAMES}
    return tuple(name for name in names if name not in known and not _is_known(name))


def from_rec709(color: Sequence[float], space: Any) -> RGB:
    """Return a colour of linear Rec.709 in a space of `color_space_of`, at least 0."""
    from pxr import Gf

    if space is None:
        return as_rgb(color)
    linear = Gf.Color(Gf.Vec3f(*color), Gf.ColorSpace(REC709))
    return as_rgb([max(float(x), 0.0) for x in Gf.Color(linear, space).GetRGB()])


def to_rec709(color: Sequence[float], space: Any) -> RGB:
    """Return a colour of a space of `color_space_of` in linear Rec.709."""
    from pxr import Gf

    if space is None:
        return as_rgb(color)
    return as_rgb(Gf.Color(Gf.Color(Gf.Vec3f(*color), space), Gf.ColorSpace(REC709)).GetRGB())


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


def axis_token(up: Position) -> str:
    """Return the token of the up axis for a layer without a stage."""
    return "Z" if abs(up[2]) > 0.5 else "Y"


class UsdPlaces:
    """Writes places to an override layer. Without a stage, it uses the scene's axes.

    layer_stage: stage of the override layer. stage: the opened stage below it, or None. prims: path
    and type of the only prim of each light in the stage, by name.
    """

    def __init__(
        self,
        layer_stage: Any,
        stage: Any,
        prims: Mapping[str, tuple[str, str]],
        places: Sequence[EmitterPlace],
        up: Position,
    ) -> None:
        from pxr import UsdGeom

        self._layer_stage, self._stage, self._prims = layer_stage, stage, prims
        self._changed = [place for place in places if is_changed(place)]
        token = axis_token(up) if stage is None else str(UsdGeom.GetStageUpAxis(stage))
        positions = {
            name: self._world(path)[3, :3] for name, (path, _) in prims.items() if stage is not None
        }
        rotations = axis_conversions(up, UP_AXES[token])
        self._conversion, self._up = conversion_of(places, rotations, positions), token
        if stage is None and self._changed:
            UsdGeom.SetStageUpAxis(layer_stage, token)

    def add_new(self, scope: str) -> dict[str, tuple[str, str]]:
        """Define the new lights that the stage lacks; return path and type by name.

        scope: path of their parent prim.
        """
        from pxr import Tf, UsdLux

        added_prims: dict[str, tuple[str, str]] = {}
        used_names = self._children(scope)
        for place in self._changed:
            if not place.new or place.name in self._prims or not self._conversion.is_known:
                continue
            identifier = free_name(Tf.MakeValidIdentifier(place.name), used_names)
            used_names.add(identifier)
            path, schema = f"{scope}/{identifier}", SCHEMAS[place.new]
            prim = self._defined(scope, path, schema)
            if identifier != place.name:
                prim.SetDisplayName(place.name)
            if place.new == "panel":
                assert place.size is not None
                panel = UsdLux.RectLight(prim)
                panel.CreateWidthAttr(place.size[0])
                panel.CreateHeightAttr(place.size[1])
            else:
                UsdLux.SphereLight(prim).CreateTreatAsPointAttr(True)
                UsdLux.SphereLight(prim).CreateRadiusAttr(RADIUS)
            self._place(path, place, None)
            added_prims[place.name] = path, schema
        return added_prims

    def move(self) -> tuple[str, ...]:
        """Set the places of lights that moved; return the names of those that were left unchanged.

        These are lights at other positions in the stage than in the scene, and meshes.
        """
        unmoved = []
        for place in self._changed:
            if place.name not in self._prims:
                continue
            path, kind = self._prims[place.name]
            if self._stage is None:
                self._place(path, place, None)
            elif kind in AIMED and self._is_expected(path, place):
                self._place(path, place, self._world(path))
            else:
                unmoved.append(place.name)
        return tuple(unmoved)

    def place_sky(self, path: str, axes: Doubles, file: str) -> bool:
        """Give a dome its map, and turn it; return whether the stage's axes are known.

        axes: (3, 3), rotation from the scene's axes to the map's. file: beside the layer. Without a
        stage the dome is a new prim.
        """
        from pxr import Sdf, UsdGeom

        prim = self._layer_stage.OverridePrim(path)
        if self._stage is None:
            prim = self._defined(str(Sdf.Path(path).GetParentPath()), path, "DomeLight")
            UsdGeom.SetStageUpAxis(self._layer_stage, self._up)
        elif self._stage.GetPrimAtPath(path).GetTypeName() == "DomeLight_1":
            prim.CreateAttribute("poleAxis", Sdf.ValueTypeNames.Token, custom=False).Set("Y")
        set_image(prim, file)
        token = Sdf.ValueTypeNames.Token
        prim.CreateAttribute("inputs:texture:format", token, custom=False).Set("latlong")
        if not self._conversion.is_known:
            return False
        world = np.eye(4)
        # The rows of a transform are the axes, here the axes of the map.
        world[:3, :3] = axes @ self._conversion.rotation.T
        _write_transform(prim, *self._local(path, world))
        return True

    def _defined(self, scope: str, path: str, schema: str) -> Any:
        """Return a new prim below `scope`, defining the scope too if the stage has none."""
        from pxr import Sdf

        prim, layer = self._layer_stage.OverridePrim(path), self._layer_stage.GetRootLayer()
        types = {path: schema}
        if self._stage is None or not self._stage.GetPrimAtPath(scope):
            types[scope] = "Scope"
        for its_path, name in types.items():
            spec = layer.GetPrimAtPath(its_path)
            spec.specifier, spec.typeName = Sdf.SpecifierDef, name
        return prim

    def _is_expected(self, path: str, place: EmitterPlace) -> bool:
        """Return whether a prim is where the scene has, or will have, the light."""
        if not self._conversion.is_known:
            return False
        point = self._world(path)[3, :3]
        expected = [x for x in (old_position(place), place.position) if x is not None]
        return not expected or any(self._conversion.is_at(x, point) for x in expected)

    def _place(self, path: str, place: EmitterPlace, old: Doubles | None) -> None:
        """Write transform and cone of a prim. old: (4, 4), its current transform to the world."""
        world = np.eye(4)
        world[:3, :3] = self._conversion.frame(place, None if old is None else old[:3, :3])
        if place.position is not None:
            world[3, :3] = self._conversion.point(place.position)
        elif old is not None:
            world[3, :3] = old[3, :3]
        prim = self._layer_stage.OverridePrim(path)
        _write_transform(prim, *self._local(path, world))
        if has_new_cone(place):
            _write_cone(prim, place)

    def _local(self, path: str, world: Doubles) -> tuple[Doubles, bool]:
        """Return the transform relative to the parent, and whether the prim resets the transform
        stack.
        """
        from pxr import Sdf, UsdGeom

        if self._stage is None:
            return world, False
        prim = self._stage.GetPrimAtPath(path)
        if prim and UsdGeom.Xformable(prim).GetResetXformStack():
            return world, True
        parent = str(Sdf.Path(path).GetParentPath())
        return np.asarray(world @ np.linalg.inv(self._world(parent))), False

    def _world(self, path: str) -> Doubles:
        """Return the transform of a stage's prim to the world, for row vectors, (4, 4)."""
        from pxr import Usd, UsdGeom

        prim = self._stage.GetPrimAtPath(path)
        while not prim and path.count("/") > 1:
            # Parents that exist only in the layer have no transform.
            path = path.rpartition("/")[0]
            prim = self._stage.GetPrimAtPath(path)
        if not prim:
            return np.eye(4)
        return np.array(UsdGeom.XformCache(Usd.TimeCode.Default()).GetLocalToWorldTransform(prim))

    def _children(self, scope: str) -> set[str]:
        """Return the names of the prims below `scope` in the stage."""
        prim = None if self._stage is None else self._stage.GetPrimAtPath(scope)
        if not prim:
            return {path.rpartition("/")[2] for path, _ in self._prims.values()}
        return {child.GetName() for child in prim.GetAllChildren()}


def set_image(prim: Any, file: str) -> None:
    """Give a dome or a panel its image. file: beside the layer."""
    from pxr import Sdf

    asset = Sdf.ValueTypeNames.Asset
    attribute = prim.CreateAttribute("inputs:texture:file", asset, custom=False)
    attribute.Set(f"./{file}")
    attribute.SetColorSpace(REC709)


def _write_transform(prim: Any, matrix: Doubles, is_reset: bool) -> None:
    from pxr import Gf, Sdf, Vt

    name = "xformOp:transform"
    attribute = prim.CreateAttribute(name, Sdf.ValueTypeNames.Matrix4d, custom=False)
    attribute.Set(Gf.Matrix4d(matrix.tolist()))
    order = [*(["!resetXformStack!"] if is_reset else []), name]
    prim.CreateAttribute(
        "xformOpOrder",
        Sdf.ValueTypeNames.TokenArray,
        custom=False,
        variability=Sdf.VariabilityUniform,
    ).Set(Vt.TokenArray(order))


def _write_cone(prim: Any, place: EmitterPlace) -> None:
    """Write the cone of a spot, whose light falls off from `beam` to `cutoff`."""
    from pxr import UsdLux

    assert place.cutoff is not None
    shaping = UsdLux.ShapingAPI.Apply(prim)
    shaping.CreateShapingConeAngleAttr(place.cutoff)
    shaping.CreateShapingConeSoftnessAttr(1 - (place.beam or 0.0) / place.cutoff)
