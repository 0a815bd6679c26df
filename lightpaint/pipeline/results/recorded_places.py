"""Places of the lights of a relit scene, with the changes that the lighting beside it records."""

from dataclasses import replace

from lightpaint.errors import LightpaintError
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.pipeline.results.answer_folder import LIGHTING
from lightpaint.scene.properties.site import EmitterPlace
from lightpaint.scene.scene import Scene


def recorded_places(scene: Scene) -> tuple[EmitterPlace, ...]:
    """Return the places of a scene's emitters; those that moved or are new say so.

    A relit scene is a plain scene: only the lighting in its folder knows the earlier places. It
    counts for each light that hangs, points and opens as it says. A folder without a readable
    lighting changes nothing.
    """
    file = scene.path.parent / LIGHTING
    if not file.is_file():
        return scene.emitter_places
    try:
        recorded = {place.name: place for place in read_lighting(file).places}
    except LightpaintError:
        return scene.emitter_places
    return tuple(_with_change(place, recorded.get(place.name)) for place in scene.emitter_places)


def _with_change(place: EmitterPlace, recorded: EmitterPlace | None) -> EmitterPlace:
    is_the_same = recorded is not None and place.site.is_near(recorded.site)
    if recorded is None or not is_the_same or place.new or place.moved_from is not None:
        return place
    return replace(
        place, moved_from=recorded.moved_from, new=recorded.new, size=place.size or recorded.size
    )
