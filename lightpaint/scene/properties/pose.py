"""Position, direction and cone of a light, and changing them.

Moves are rigid: the light goes to its new position, and turns by the smallest rotation that aims it
at its target, so a texture in its beam keeps its roll.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles, Position
from lightpaint.display_text import brief
from lightpaint.errors import SceneError
from lightpaint.keywords import keywords
from lightpaint.luminaires import POINT_PLUGIN
from lightpaint.scene.checks.tokens import tag
from lightpaint.scene.properties.emission import ENVIRONMENTS
from lightpaint.scene.properties.site import Site as Site
from lightpaint.scene.properties.site import rotation_between, unit

#: Mitsuba's default cutoff angle of a spot in degrees, and default ratio of beam width to cutoff.
DEFAULT_CUTOFF, DEFAULT_BEAM_SHARE = 20.0, 0.75

#: Maximum absolute coordinate of a position, in scene units.
FARTHEST = 1e7


#: Component below which a direction counts as level; component above which it counts as along an
#: axis; and difference between the light along a camera's view and that down its picture above
#: which the camera counts as looking down.
LEVEL, STRAIGHT, FARTHER = 0.02, 0.999, 0.3


@keywords()
@dataclass(frozen=True)
class Pose:
    """A change of a light's position, direction and cone; None keeps a value unchanged.

    Attributes:
        position: Its position in scene units; for an area light the centre of its shape.
        target: A point that it aims at. A light at infinity shines in the direction from the origin
            to this point.
        cutoff: Degrees from the axis of a spot to the edge of its cone.
        beam: Degrees from the axis to where its light begins to fall off, at most `cutoff`.

    Raises:
        SceneError: If a value is invalid.

    Examples:
        >>> lp.Pose(position=(0, 2.5, 1), target=(0, 0, 0))
        Pose(position=(0.0, 2.5, 1.0), target=(0.0, 0.0, 0.0))
    """

    position: Position | None = None
    target: Position | None = None
    cutoff: float | None = None
    beam: float | None = None

    def __post_init__(self) -> None:
        for name in ("position", "target"):
            if (value := getattr(self, name)) is not None:
                object.__setattr__(self, name, _point(name, value))
        for name in ("cutoff", "beam"):
            if (value := getattr(self, name)) is not None:
                object.__setattr__(self, name, _angle(name, value))
        if self.position is not None and self.position == self.target:
            raise SceneError(f"position and target are both {self.position}: give it another")
        if self.cutoff is not None and self.beam is not None and self.beam > self.cutoff:
            raise SceneError(
                f"beam is {self.beam:g} and cutoff {self.cutoff:g}: the beam is at most as wide"
            )

    def __repr__(self) -> str:
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        values_text = (f"{name}={value!r}" for name, value in values.items() if value is not None)
        return f"Pose({', '.join(values_text)})"


def pose_of(site: Site) -> Pose:
    """Return the pose that moves a light to `site`."""
    return Pose(position=site.position, target=site.target, cutoff=site.cutoff, beam=site.beam)


#: Plugins that have a direction.
_AIMED = ("spot", "directional", "projector", POINT_PLUGIN)

#: Shapes that give a direction to an area light.
FLAT_SHAPES = ("rectangle", "disk")


def site_of(emitter: Any, plugin: str, shape_plugin: str) -> Site:
    """Return the site of a loaded emitter. shape_plugin: plugin of its shape, or ""."""
    import mitsuba as mi

    if plugin in ENVIRONMENTS:
        return Site()
    shape = emitter.get_shape()
    if shape is not None:
        middle = _three(shape.bbox().center())
        if shape_plugin not in FLAT_SHAPES:
            return Site(middle)
        # Normals transform by the inverse transpose; the matrix includes any flip.
        return Site(middle, unit(np.linalg.inv(_matrix(mi.traverse(shape)))[2, :3]))
    parameters = mi.traverse(emitter)
    if "position" in parameters:
        return Site(_three(parameters["position"]))
    if "to_world" not in parameters:
        return Site()
    matrix = _matrix(parameters)
    direction = unit(matrix[:3, 2]) if plugin in _AIMED else None
    if plugin == "directional":
        return Site(None, direction)
    cutoff, beam = (
        float(np.array(parameters[key]).ravel()[0]) if key in parameters else None
        for key in ("cutoff_angle", "beam_width")
    )
    return Site(_three(matrix[:3, 3]), direction, cutoff, beam)


def upward_axis(props: Any, light: Sequence[Position] = ()) -> Position:
    """Return the up axis of the scene, as seen by a sensor with these properties.

    This is the sensor's up axis, or the axis behind it if it looks straight down. light: directions
    in which lights shine, which distinguish these two cases, since most light comes from above.
    """
    if "to_world" not in props:
        return (0.0, 1.0, 0.0)
    left, up, ahead = _matrix(props)[:3, :3].T
    axis = np.zeros(3)
    # With a level horizon, up is perpendicular to the sensor's left axis.
    level = np.where(np.abs(left) < LEVEL, up, -np.inf)
    k, behind = int(np.argmax(level)), int(np.argmax(-ahead))
    looks_down = -ahead[behind] > STRAIGHT
    if looks_down and (level[k] < LEVEL or _shines(light, ahead + up) > FARTHER):
        axis[behind] = 1.0
    elif level[k] >= LEVEL:
        axis[k] = 1.0
    else:
        k = int(np.argmax(np.abs(up)))
        axis[k] = 1.0 if up[k] >= 0 else -1.0
    return _three(axis)


def _shines(light: Sequence[Position], way: Doubles) -> float:
    """Return the mean component of light directions along `way`, -1 to 1."""
    return float(np.mean(np.array(light) @ way)) if len(light) else 0.0


def _matrix(parameters: Any) -> Doubles:
    return np.array(parameters["to_world"].matrix, dtype=float).reshape(4, 4)


@dataclass(frozen=True)
class Motion:
    """The motion that gives a light a pose: a rigid transform, and the new cone.

    matrix: (4, 4), maps current points of the light to new ones. site: the new site. target: the
    point it aims at, if one was given. changes_cone: whether the cone changes.
    """

    matrix: Doubles
    site: Site
    target: Position | None
    changes_cone: bool


def motion_of(name: str, plugin: str, site: Site, pose: Pose) -> Motion:
    """Return the motion that gives the light `name` at `site` a pose.

    Raises SceneError for changes that are impossible for this light.
    """
    if site.position is None and site.direction is None:
        raise SceneError(f"light {name!r} ({plugin}) has no place: it cannot be moved")
    if pose.position is not None and site.position is None:
        raise SceneError(
            f"light {name!r} ({plugin}) is infinitely far away: turn it by a target, and leave out "
            "the position"
        )
    changes_cone = pose.cutoff is not None or pose.beam is not None
    if changes_cone and site.cutoff is None:
        raise SceneError(f"light {name!r} ({plugin}) has no cone: leave out cutoff and beam")
    if pose.target is not None and site.direction is None:
        raise SceneError(f"light {name!r} ({plugin}) points nowhere: leave out the target")
    position = site.position if pose.position is None else pose.position
    direction, turn = site.direction, np.eye(3)
    if pose.target is not None:
        assert direction is not None
        way = np.array(pose.target) - np.array(position or (0.0, 0.0, 0.0))
        if not np.linalg.norm(way) > 0:
            raise SceneError(f"light {name!r} cannot point at its own place, {pose.target}")
        turn = rotation_between(direction, way)
        direction = unit(way)
    matrix = np.eye(4)
    matrix[:3, :3] = turn
    if site.position is not None and position is not None:
        matrix[:3, 3] = np.array(position) - turn @ np.array(site.position)
    cutoff, beam = _cone(name, site, pose)
    return Motion(matrix, Site(position, direction, cutoff, beam), pose.target, changes_cone)


def _cone(name: str, site: Site, pose: Pose) -> tuple[float | None, float | None]:
    """Return cutoff and beam with this pose; without a given beam, the ratio of the two is kept."""
    if site.cutoff is None or (pose.cutoff is None and pose.beam is None):
        return site.cutoff, site.beam
    share = site.cutoff * DEFAULT_BEAM_SHARE if site.beam is None else site.beam
    cutoff = site.cutoff if pose.cutoff is None else pose.cutoff
    beam = share * cutoff / site.cutoff if pose.beam is None else pose.beam
    if beam > cutoff:
        raise SceneError(
            f"light {name!r} has a cutoff of {cutoff:g} degrees, and a beam of {beam:g} is wider: "
            "give both"
        )
    return cutoff, beam


@dataclass(frozen=True)
class MovedParameter:
    """A parameter of an element that a motion changes: its value for Mitsuba and its XML."""

    name: str
    value: Any
    xml: str


def moved_parameters(props: Any, motion: Motion) -> list[MovedParameter]:
    """Return the parameters of an element that `motion` changes, equal in memory and in a file.

    props: Mitsuba's properties of the emitter, or of its shape if it has one.
    """
    moved_elements, site = [], motion.site
    if "position" in props and "to_world" not in props:
        moved_elements.append(_vector("point", "position", site.position))
    elif "direction" in props:
        moved_elements.append(_vector("vector", "direction", site.direction))
    elif not np.array_equal(motion.matrix, np.eye(4)):
        old_matrix = np.eye(4) if "to_world" not in props else _matrix(props)
        is_spot = props.plugin_name() == "spot"
        moved_elements.append(
            _transform(motion.matrix @ old_matrix, is_spot=is_spot, target=motion.target)
        )
    if motion.changes_cone:
        for name, angle in (("cutoff_angle", site.cutoff), ("beam_width", site.beam)):
            assert angle is not None
            text = f"{angle:.9g}"
            moved_elements.append(
                MovedParameter(name, float(text), tag("float", name=name, value=text))
            )
    return moved_elements


def _vector(element: str, name: str, value: Position | None) -> MovedParameter:
    import mitsuba as mi

    x, y, z = _texts(np.array(value, dtype=float))
    numbers = mi.ScalarVector3d(float(x), float(y), float(z))
    return MovedParameter(name, numbers, tag(element, name=name, x=x, y=y, z=z))


def _transform(matrix: Doubles, *, is_spot: bool, target: Position | None) -> MovedParameter:
    """Return a transform as `lookat` if it is rigid and for a spot, else as a matrix."""
    import mitsuba as mi

    left, up, ahead, origin = matrix[:3].T
    squares = matrix[:3, :3].T @ matrix[:3, :3]
    is_rigid = np.allclose(squares, np.eye(3), atol=1e-6) and np.cross(up, ahead) @ left > 0
    if is_spot and is_rigid:
        target_point = origin + ahead if target is None else np.array(target)
        texts = {
            key: _texts(v) for key, v in (("origin", origin), ("target", target_point), ("up", up))
        }
        value = mi.ScalarAffineTransform4d().look_at(
            **{key: [float(v) for v in values_text] for key, values_text in texts.items()}
        )
        text = tag("lookat", **{key: ", ".join(values_text) for key, values_text in texts.items()})
    else:
        values_text = _texts(matrix.ravel())
        value = mi.ScalarAffineTransform4d(np.array([float(v) for v in values_text]).reshape(4, 4))
        text = tag("matrix", value=" ".join(values_text))
    element = f'<transform name="to_world">{text}</transform>'
    return MovedParameter("to_world", value, element)


def _texts(values: Doubles) -> list[str]:
    """Return numbers as text, with values that are only rounding errors set to 0."""
    tolerance = 1e-9 * float(np.abs(values).max(initial=1e-300))
    return [f"{v if abs(v) > tolerance else 0.0:.9g}" for v in values]


def _point(name: str, value: Any) -> Position:
    try:
        x, y, z = (float(v) for v in value)
    except (OverflowError, TypeError, ValueError):
        raise SceneError(f"{name} is {brief(value)}: expected three numbers, x, y and z") from None
    if not max(abs(x), abs(y), abs(z)) <= FARTHEST:
        raise SceneError(f"{name} is {(x, y, z)}: expected numbers of at most {FARTHEST:g}")
    return x, y, z


def _angle(name: str, value: Any) -> float:
    try:
        angle = float(value)
    except (OverflowError, TypeError, ValueError):
        angle = math.nan
    if not 0 < angle < 90:
        raise SceneError(f"{name} is {brief(value)}: expected degrees between 0 and 90")
    return angle


def _three(values: Any) -> Position:
    """Return three numbers without the noise of single precision."""
    x, y, z = (float(f"{v:.7g}") for v in np.array(values, dtype=float).ravel()[:3])
    return x, y, z
