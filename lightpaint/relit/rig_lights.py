"""The lights of an answer with a place and one colour, for programs with lights of their own."""

import math

from lightpaint.arrays import RGB
from lightpaint.basis.light_images import joined_texels
from lightpaint.colour.photometry import photometry
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.relit.export.nuke_lights import RigKind, RigLight
from lightpaint.relit.relight import scene_of
from lightpaint.scene.lights.emitters import Emitter
from lightpaint.scene.properties.emission import Scaling
from lightpaint.scene.scene import Scene

#: Kind of light for each plugin; area lights are panels if they are flat.
KINDS: dict[str, RigKind] = {
    "point": "point",
    "spot": "spot",
    "directional": "sun",
    "area": "panel",
}


def rig_lights(scene: Scene, lighting: Lighting) -> tuple[list[RigLight], list[str]]:
    """Return points, spots, suns and panels as in `lighting`, and the names of other emitters.

    Lights that stay as they are belong to them; skies, meshes, projectors, and lights that are
    multiples of a picture are the others. Raises LightingError if the lighting is of another scene.
    """
    regrouped_scene = scene_of(scene, lighting)
    places = {place.name: place for place in lighting.places}
    rig, left = [], []
    for light in regrouped_scene.lights:
        is_known = light.is_fixed or not lighting[light.name].is_partly_reached
        for emitter in light.members:
            if not _has_point(emitter):
                left.append(emitter.name)
                continue
            assert emitter.kind is not None
            rgb = emitter.emission
            if not light.is_fixed:
                rgb = light.emission_of(emitter, lighting.emission[light.name])
            kelvin = photometry(rgb, unit=emitter.kind.unit).kelvin if is_known else None
            place = places.get(emitter.name)
            rig.append(
                RigLight(
                    emitter.name,
                    KINDS[emitter.plugin],
                    _intensity(emitter, rgb),
                    emitter.site,
                    kelvin=kelvin,
                    is_moved=place is not None and place.moved_from is not None,
                    is_new=place is not None and bool(place.new),
                )
            )
    return rig, joined_texels(left)


def _has_point(emitter: Emitter) -> bool:
    """Return whether an emitter is of one colour, and shines from a point or in one direction."""
    is_plain = emitter.kind is not None and emitter.kind.scaling is Scaling.COLOUR
    if emitter.texel is not None or emitter.obstacle or not is_plain:
        return False
    if emitter.plugin == "area":
        return emitter.site.direction is not None and bool(emitter.unit_flux)
    return emitter.plugin in KINDS


def _intensity(emitter: Emitter, rgb: RGB) -> RGB:
    """Return the emission, of a panel its intensity along its axis: its radiance times its area."""
    if emitter.plugin != "area":
        return rgb
    assert emitter.unit_flux is not None
    r, g, b = (emitter.unit_flux / math.pi * channel for channel in rgb)
    return r, g, b
