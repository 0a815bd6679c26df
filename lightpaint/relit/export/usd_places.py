"""Writes places of moved and new lights to a USD layer: transforms, cones, and prims of new
lights.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles, Position
from lightpaint.basis.lights import free_name
from lightpaint.relit.export.export_places import (
    axis_conversions,
    conversion_of,
    has_new_cone,
    is_changed,
    old_position,
)
from lightpaint.scene.properties.site import EmitterPlace

#: Up axes of stages, by token.
UP_AXES = {"Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}

#: Schema for each kind of new light. A spot is a sphere with shaping.
SCHEMAS = {"point": "SphereLight", "spot": "SphereLight", "panel": "RectLight"}

#: Radius of new points in units of the stage, for renderers without point lights.
RADIUS = 0.01

#: Types of lights that shine along their -z axis.
AIMED = ("SphereLight", "RectLight", "DiskLight", "DistantLight")


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
        # The rows of a transform are the axes, here those of the map.
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
    prim.CreateAttribute("inputs:texture:file", asset, custom=False).Set(f"./{file}")


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
