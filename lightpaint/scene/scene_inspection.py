"""Facts about a scene that require loading it in Mitsuba: film, emitters, surfaces, shapes."""

import gc
from collections.abc import Iterator
from pathlib import PurePath
from typing import Any

from lightpaint.scene.lights.emitters import find_emitters
from lightpaint.scene.plane_identity import SceneHasher
from lightpaint.scene.properties.emission import ENVIRONMENTS
from lightpaint.scene.properties.film import Film, camera_named
from lightpaint.scene.scene_tree import ParsedScene

#: A shape that is only visible through instances.
GROUP = "shapegroup"


def inspect_scene(parsed: ParsedScene, sensor: int) -> dict[str, Any]:
    """Return the fields of a `Scene` that require loading it."""
    loaded, hasher = parsed.instantiate({}), SceneHasher(parsed)
    camera = camera_named(loaded, parsed.sensor_names[sensor])
    emitters, film = find_emitters(parsed, loaded, hasher), Film.of(camera, sensor)
    facts = {
        "emitters": emitters,
        "film": film,
        "spp": int(camera.sampler().sample_count()),
        "has_null": (has_null := _has_null_surfaces(loaded)),
    }
    del loaded, camera
    gc.collect()
    has_environment = any(emitter.plugin in ENVIRONMENTS for emitter in emitters)
    return {
        **facts,
        "sensor_names": parsed.sensor_names,
        "integrator": parsed.integrator(),
        "integrator_choice": parsed.integrator_choice,
        "has_media": parsed.has_media(),
        "files": parsed.files,
        "content": parsed.content(sensor),
        "unlit_content": hasher.unlit_content(
            film, has_environment=has_environment, has_null=has_null
        ),
    }


def _has_null_surfaces(loaded: Any) -> bool:
    import mitsuba as mi

    bsdfs = (shape.bsdf() for shape in loaded.shapes())
    return any(b is not None and mi.has_flag(b.flags(), mi.BSDFFlags.Null) for b in bsdfs)


def shape_names(parsed: ParsedScene) -> tuple[str, ...]:
    """Return names of a loaded scene's shapes, in order: id, or else mesh file, material or
    kind.
    """
    import mitsuba as mi

    shapes = parsed.children_of(0, mi.ObjectType.Shape)
    kinds = (parsed.state.nodes[k].props.plugin_name() for k in shapes)
    return tuple(
        next(filter(None, _names_of(parsed, k)))
        for k, kind in zip(shapes, kinds, strict=True)
        if kind != GROUP
    )


def _names_of(parsed: ParsedScene, node: int) -> Iterator[str]:
    """Yield possible names of a shape, best first."""
    import mitsuba as mi

    def ids(kind: Any) -> Iterator[str]:
        return (str(parsed.state.nodes[k].props.id()) for k in parsed.children_of(node, kind))

    props = parsed.state.nodes[node].props
    yield str(props.id())
    if "filename" in props:
        yield PurePath(str(props["filename"])).stem
    # An instance is named after its shape group.
    yield from ids(mi.ObjectType.Shape)
    yield from ids(mi.ObjectType.BSDF)
    yield str(props.plugin_name())
