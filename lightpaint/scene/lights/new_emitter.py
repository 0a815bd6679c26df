"""An emitter to add to a scene: a point, a spot or a panel, and its XML element.

The same element is written to files and parsed by Mitsuba in memory, so both give the same scene.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lightpaint.arrays import RGB, Position, as_rgb
from lightpaint.display_text import brief
from lightpaint.errors import SceneError
from lightpaint.keywords import keywords
from lightpaint.scene.checks.tokens import tag
from lightpaint.scene.lights.emitters import Emitter
from lightpaint.scene.properties.emission import PLUGINS
from lightpaint.scene.properties.pose import (
    DEFAULT_BEAM_SHARE,
    DEFAULT_CUTOFF,
    FARTHEST,
    Pose,
    Site,
    pose_of,
)
from lightpaint.scene.properties.site import EmitterPlace, across
from lightpaint.scene.properties.site import NewKind as NewKind
from lightpaint.validation import MAX_NAME, is_amount

#: Mitsuba's plugin of each kind.
PLUGIN_OF: dict[NewKind, str] = {"point": "point", "spot": "spot", "panel": "area"}


@keywords()
@dataclass(frozen=True)
class NewEmitter:
    """An emitter to be added to a scene; see `Scene.with_new_emitters`.

    Attributes:
        name: Its id, which must be new to the scene.
        kind: `point`, `spot`, or `panel`, a rectangle that emits from its front and reflects
            nothing.
        pose: Its position; for a spot or a panel also its target, and for a spot its cone.
        size: Width and height of a panel, in scene units.
        emission: RGB intensity in W/sr; for a panel, radiance in W/(m² sr).

    Raises:
        SceneError: If a value is invalid for such a light.

    Examples:
        >>> lp.NewEmitter("key", "spot", lp.Pose(position=(0, 3, 1), target=(0, 0, 0))).plugin
        'spot'
    """

    name: str
    kind: NewKind
    pose: Pose
    size: tuple[float, float] | None = None
    emission: RGB = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        if not self.name or len(self.name) > MAX_NAME:
            raise SceneError(f"a new light has a name of 1 to {MAX_NAME} characters")
        if self.kind not in PLUGIN_OF:
            raise SceneError(
                f"new light {self.name!r} is of the kind {self.kind!r}: expected point, spot, panel"
            )
        if self.pose.position is None:
            raise SceneError(f"new light {self.name!r} has no position: give its pose one")
        if self.kind == "point":
            # A point light has no direction.
            object.__setattr__(self, "pose", Pose(position=self.pose.position))
        elif self.pose.target is None:
            raise SceneError(f"new light {self.name!r} points nowhere: give its pose a target")
        if self.kind == "panel":
            object.__setattr__(self, "size", _sides(self.name, self.size))
        elif self.size is not None:
            raise SceneError(f"new light {self.name!r} is a {self.kind}: it has no size")
        object.__setattr__(self, "emission", _amounts(self.name, self.emission))

    @property
    def plugin(self) -> str:
        """Mitsuba's name of the plugin."""
        return PLUGIN_OF[self.kind]

    @property
    def site(self) -> Site:
        """Its position, direction and cone."""
        place, target = self.pose.position, self.pose.target
        if target is None:
            return Site(place)
        way = np.subtract(target, np.asarray(place))
        x, y, z = (way / np.linalg.norm(way)).tolist()
        return Site(place, (x, y, z), *(self._cone if self.kind == "spot" else ()))

    @property
    def _cone(self) -> tuple[float, float]:
        cutoff = DEFAULT_CUTOFF if self.pose.cutoff is None else self.pose.cutoff
        beam = cutoff * DEFAULT_BEAM_SHARE if self.pose.beam is None else self.pose.beam
        return cutoff, min(beam, cutoff)

    def lines(self, emission: RGB | None = None, *, is_sampled: bool = True) -> list[str]:
        """Return its XML element, line by line.

        emission: overrides its own. is_sampled: False if renders must not sample it.
        """
        rgb = self.emission if emission is None else emission
        colour = " ".join(f"{np.float32(v):.9g}" for v in rgb)
        shine = [tag("rgb", name=PLUGINS[self.plugin][0], value=colour)]
        if not is_sampled:
            shine.append(tag("float", name="sampling_weight", value="0"))
        position = self.pose.position
        assert position is not None
        if self.kind == "point":
            x, y, z = (f"{v:.9g}" for v in position)
            return self._element([tag("point", name="position", x=x, y=y, z=z), *shine])
        if self.kind == "spot":
            cutoff, beam = (f"{v:.9g}" for v in self._cone)
            angles = [
                tag("float", name="cutoff_angle", value=cutoff),
                tag("float", name="beam_width", value=beam),
            ]
            return self._element([*self._transform(), *angles, *shine])
        black = tag("rgb", name="reflectance", value="0")
        child_elements = [
            *self._transform(),
            f'<bsdf type="diffuse">{black}</bsdf>',
            '<emitter type="area">',
            *(f"    {line}" for line in shine),
            "</emitter>",
        ]
        return self._element(child_elements, "shape", "rectangle")

    def _transform(self) -> list[str]:
        place, target = self.pose.position, self.pose.target
        assert place is not None
        assert target is not None
        up = across(np.subtract(target, np.asarray(place)))[0]
        origin, target_point, up_point = (
            ", ".join(f"{v:.9g}" for v in point) for point in (place, target, up.tolist())
        )
        scale = []
        if self.size is not None:
            x, y = (f"{side / 2:.9g}" for side in self.size)
            scale = [f"    {tag('scale', x=x, y=y)}"]
        lookat = f"    {tag('lookat', origin=origin, target=target_point, up=up_point)}"
        return ['<transform name="to_world">', *scale, lookat, "</transform>"]

    def _element(
        self, child_elements: Sequence[str], element: str = "emitter", plugin: str = ""
    ) -> list[str]:
        start = tag(element, type=plugin or self.plugin, id=self.name).replace("/>", ">")
        return [start, *(f"    {line}" for line in child_elements), f"</{element}>"]


def new_emitter_at(place: EmitterPlace) -> NewEmitter:
    """Return the new emitter of an answer, at unit emission. Raises SceneError if it is invalid."""
    assert place.new
    return NewEmitter(place.name, place.new, pose_of(place.site), place.size)


def moved_emitter(emitter: NewEmitter, site: Site, target: Position | None) -> NewEmitter:
    """Return a new emitter at another site. target: the point it aims at, if one was given."""
    assert site.position is not None
    if target is None and site.direction is not None:
        x, y, z = (float(a + b) for a, b in zip(site.position, site.direction, strict=True))
        target = (x, y, z)
    pose = Pose(position=site.position, target=target, cutoff=site.cutoff, beam=site.beam)
    return NewEmitter(emitter.name, emitter.kind, pose, emitter.size, emitter.emission)


def _sides(name: str, size: Any) -> tuple[float, float]:
    try:
        width, height = (float(v) for v in size)
    except (TypeError, ValueError):
        width = height = float("nan")
    if not (0 < width <= FARTHEST and 0 < height <= FARTHEST):
        raise SceneError(f"panel {name!r} has the size {size!r}: expected its width and height")
    return width, height


def _amounts(name: str, emission: Any) -> RGB:
    try:
        rgb = as_rgb(emission)
    except (TypeError, ValueError):
        rgb = (float("nan"),) * 3
    if not all(map(is_amount, rgb)):
        raise SceneError(
            f"new light {name!r} has the emission {brief(emission)}: expected three amounts"
        )
    return rgb


def check_new_names(
    emitters: Sequence[NewEmitter], taken_names: Collection[str], *, scene: str
) -> None:
    """Raise SceneError if two of the emitters, or one and a light of the scene, share a name."""
    names = set(taken_names)
    for emitter in emitters:
        if emitter.name in names:
            raise SceneError(
                f"{scene} has a light {emitter.name!r} already: give the new one another name"
            )
        names.add(emitter.name)


def places_of(
    emitters: Sequence[Emitter], added: Sequence[NewEmitter], old_sites: Mapping[str, Site]
) -> tuple[EmitterPlace, ...]:
    """Return the places of the emitters that have a position or a direction.

    added: the ones among them that are in no file. old_sites: by name, before they were moved.
    """
    new_emitters = {x.name: x for x in added}
    places = []
    for emitter in emitters:
        if emitter.site == Site():
            continue
        place = EmitterPlace.of(emitter.name, emitter.site, old_sites.get(emitter.name))
        if (new := new_emitters.get(emitter.name)) is not None:
            place = replace(place, new=new.kind, size=new.size)
        places.append(place)
    return tuple(places)
