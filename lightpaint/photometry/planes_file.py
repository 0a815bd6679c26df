"""The planes file: a TOML file beside the scene that says where illuminance is measured.

For `hall.xml` it is `hall.planes.toml`; docs/photometry.md has the details.
"""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from lightpaint.arrays import Doubles, Position
from lightpaint.display_text import some_names, with_similar_name
from lightpaint.errors import SceneError
from lightpaint.files import is_name, one_line, read_text
from lightpaint.keywords import keywords
from lightpaint.photometry import illuminance
from lightpaint.photometry.glare import GlareObserver
from lightpaint.photometry.measure import DEFAULT_ERROR, LEAST_ERROR
from lightpaint.photometry.plane_placement import CYLINDRICAL, PlaneRequest, place_plane
from lightpaint.photometry.room_rays import CAMERA, ObserverRequest, RoomRays, place_observers
from lightpaint.scene import FARTHEST, Scene
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.sentences import SourceKey
from lightpaint.storage.json_records import strict_toml
from lightpaint.validation import MAX_NAME, is_number, parse_share

SUFFIX = ".planes.toml"
#: Maximum size of a planes file in bytes, and number of its planes.
MAX_BYTES, MAX_PLANES = 2**20, 1000

#: Keys of a plane's place, each with the keys that go with it.
PLACES = {
    "shape": ("height", "margin", "grid", "n"),
    "walls": ("margin", "grid", "n"),
    "corners": ("grid", "n"),
    "points": ("n",),
}
#: Keys of wishes.
WISHES = ("preset", "mean", "uniformity", "max", "ratio")
#: All keys of a plane.
PLANE_KEYS = (*PLACES, "height", "margin", "grid", "n", *WISHES)
#: Largest illuminance, distance and power in a file.
MOST_LUX, MOST_METRES, MOST_WATTS = 1e6, 1e4, 1e9
#: Most cases, and largest emission of a light in one, relative to now.
MAX_CASES, MOST_FACTOR = 100, 1e6
#: Most observers.
MAX_OBSERVERS = 100


@dataclass(frozen=True)
class PlanesFile:
    """The content of a planes file.

    observers: who see glare; the camera if the file has none. error: relative error up to which is
    measured (`measure_illuminance`).
    """

    path: Path
    planes: tuple[illuminance.MeasuringPlane, ...]
    power: illuminance.PowerBudget = field(default_factory=illuminance.PowerBudget)
    cases: tuple[illuminance.LightCase, ...] = ()
    observers: tuple[GlareObserver, ...] = ()
    error: float = DEFAULT_ERROR

    def remarks(self, scene: Scene) -> list[str]:
        """Return what luminaires, which become panels, cover of planes in a scene."""
        panels = {x.name for x in scene.luminaires if x.is_panel}
        remarks = []
        for plane in self.planes:
            if covers := [name for name in plane.covered_by if name in panels]:
                count = "1 point is" if len(covers) == 1 else f"{len(covers)} points are"
                remarks.append(
                    f"plane {plane.name}: {count} left out behind {some_names(sorted({*covers}))}, "
                    "of the size of its luminous opening"
                )
        return remarks


def planes_file_beside(scene: Path) -> Path:
    """Return the path of the planes file of `scene`, whether it exists or not."""
    return scene.with_name(scene.stem + SUFFIX)


@keywords()
def read_planes(path: str | Path, scene: Scene) -> PlanesFile:
    """Read a planes file, and place its points in `scene`.

    Args:
        path: TOML (docs/photometry.md).
        scene: From `load_scene`.

    Raises:
        SceneError: For an invalid file, for a shape that the scene does not have, and for a plane
            without a point.

    Examples:
        >>> [desk] = lp.read_planes("room.planes.toml", lp.load_scene("room.xml")).planes
        >>> desk
        MeasuringPlane('desk', 36 points, 4.00 m²)
    """
    path = Path(path)
    content = _parse(path)
    if not use_variant().is_jit:
        raise SceneError(
            f"the variant is {use_variant().variant}, which cannot measure at points: use a "
            "variant like llvm_ad_rgb"
        )

    def place(loaded: Any) -> PlanesFile:
        room = RoomRays(scene, loaded)
        planes = tuple(place_plane(request, room) for request in content.planes)
        observers = place_observers(content.observers, scene, loaded, room)
        return PlanesFile(path, planes, content.power, content.cases, observers, content.error)

    return scene.while_loaded(place)


def plane_names(path: str | Path) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of the planes and of the cases of a file, without a scene.

    Raises SceneError.
    """
    content = _parse(Path(path))
    return tuple(x.name for x in content.planes), tuple(case.name for case in content.cases)


class _Content(NamedTuple):
    """The content of a planes file before it is placed in a scene."""

    planes: list[PlaneRequest]
    power: illuminance.PowerBudget
    cases: tuple[illuminance.LightCase, ...]
    observers: tuple[ObserverRequest, ...]
    error: float


def _parse(path: Path) -> _Content:
    """Return the content of a planes file, without a scene."""
    text = read_text(path, "planes file", SceneError, limit=MAX_BYTES)
    try:
        data = strict_toml(text)
    except ValueError as error:
        raise SceneError(f"{path} is not TOML: {one_line(str(error))}") from None
    _check_known(data, ("plane", "power", "case", "observer", "error"), str(path), "[plane.desk]")
    tables = data.get("plane", {})
    if not isinstance(tables, dict) or not tables:
        raise SceneError(f'{path} has no plane: expected a table like [plane.desk] shape = "floor"')
    if len(tables) > MAX_PLANES or any(len(name) > MAX_NAME for name in tables):
        raise SceneError(
            f"{path} has {len(tables)} planes: expected at most {MAX_PLANES}, with names of at "
            f"most {MAX_NAME} characters"
        )
    requests = [
        _request(name, table, SourceKey(str(path), "plane", one_line(name)), tables)
        for name, table in tables.items()
    ]
    power = _power(data.get("power", {}), SourceKey(str(path), "power"))
    cases = _cases(data.get("case", {}), SourceKey(str(path), "case"))
    observers = _observers(data.get("observer", {}), SourceKey(str(path), "observer"))
    return _Content(requests, power, cases, observers, _error(data, str(path)))


def _error(data: Mapping[str, Any], where: str) -> float:
    """Return the relative error up to which is measured, a number or a share like "1%"."""
    value = data.get("error", DEFAULT_ERROR)
    with suppress(ValueError):
        error = parse_share(value) if isinstance(value, str) else value
        if is_number(error) and LEAST_ERROR <= error <= 1:
            return float(error)
    raise SceneError(
        f'{where}: error is {one_line(repr(value))}: expected a relative error, like "1%"'
    )


def _check_known(table: Any, known: Iterable[str], where: str, example: str) -> None:
    """Raise SceneError unless it is a table of known keys."""
    if not isinstance(table, dict):
        raise SceneError(f"{where} is {one_line(repr(table))}: expected a table like {example}")
    if unknown := [key for key in table if key not in known]:
        listing = with_similar_name(f"known are {', '.join(known)}", unknown[0], [*known])
        raise SceneError(f"{where}: unknown key {one_line(repr(unknown[0]))}: {listing}")


def _request(name: str, table: Any, where: SourceKey, planes: Mapping[str, Any]) -> PlaneRequest:
    """Return a plane as its table describes it."""
    if not is_name(name):
        raise SceneError(f"{where} cannot be the name of a file, as a plane's has to be")
    _check_known(table, PLANE_KEYS, where, 'shape = "floor"')
    places = [key for key in PLACES if key in table]
    if len(places) != 1:
        given = " and ".join(places) or "none"
        raise SceneError(f"{where} has {given}: expected one of {', '.join(PLACES)}")
    allowed = (places[0], *PLACES[places[0]], *WISHES)
    if misplaced := [key for key in table if key not in allowed]:
        raise SceneError(f"{where} has {places[0]}, with which {misplaced[0]} does not go")
    shape = table.get("shape", ())
    return PlaneRequest(
        name,
        where,
        _names([shape] if isinstance(shape, str) else shape, where / "shape"),
        _names(table.get("walls", ()), where / "walls"),
        _vectors(table["corners"], where / "corners", (3, 4)) if "corners" in table else None,
        _vectors(table["points"], where / "points") if "points" in table else None,
        _normal(table["n"], where / "n") if "n" in table else None,
        height=_number(table, "height", where, 0, MOST_METRES, may_be_least=True) or 0.0,
        margin=_number(table, "margin", where, 0, MOST_METRES, may_be_least=True) or 0.0,
        grid=_number(table, "grid", where, 0, MOST_METRES),
        wishes=_wishes(name, table, where, planes),
    )


def _names(value: Any, where: str) -> tuple[str, ...]:
    if value == ():
        return ()
    if not (isinstance(value, list) and value and all(isinstance(x, str) and x for x in value)):
        raise SceneError(
            f'{where} is {one_line(repr(value))}: expected names of shapes, ["a", "b"]'
        )
    return tuple(value)


def _vectors(value: Any, where: str, counts: tuple[int, ...] = ()) -> Doubles:
    """Return a list of points, (p, 3). counts: possible numbers of them; empty for any."""
    is_list = isinstance(value, list) and len(value) > 0 and all(map(_is_vector, value))
    if not is_list or (counts and len(value) not in counts):
        number = f"{' or '.join(map(str, counts))} " if counts else ""
        raise SceneError(
            f"{where} is {one_line(repr(value))}: expected {number}points, [[x, y, z], …]"
        )
    return np.array(value, np.float64)


def _is_vector(value: Any) -> bool:
    return (
        isinstance(value, list)
        and len(value) == 3
        and all(is_number(x) and abs(x) <= FARTHEST for x in value)
    )


def _normal(value: Any, where: str) -> Position | Literal["cylindrical"]:
    if value == CYLINDRICAL:
        return "cylindrical"
    if not (_is_vector(value) and any(value)):
        raise SceneError(
            f"{where} is {one_line(repr(value))}: expected a direction like [0, -1, 0], or "
            f'"{CYLINDRICAL}"'
        )
    x, y, z = map(float, value)
    return x, y, z


def _number(
    table: Mapping[str, Any],
    key: str,
    where: SourceKey,
    least: float,
    most: float,
    *,
    may_be_least: bool = False,
) -> float | None:
    """Return a number of a table, > least, or >= least, and <= most; None if it is not there."""
    value = table.get(key)
    if value is None:
        return None
    if not (is_number(value) and (least < value <= most or (may_be_least and value == least))):
        sign = ">=" if may_be_least else ">"
        raise SceneError(
            f"{where / key} is {one_line(repr(value))}: expected a number {sign} {least:g}, at "
            f"most {most:g}"
        )
    return float(value)


def _wishes(
    name: str, table: Mapping[str, Any], where: SourceKey, planes: Mapping[str, Any]
) -> illuminance.Wishes:
    """Return the wishes of a plane; its own figures replace the figures of its preset."""
    preset = table.get("preset", "")
    if not isinstance(preset, str) or (preset and preset not in illuminance.PRESETS):
        listing = with_similar_name(
            f"there are {', '.join(illuminance.PRESETS)}", str(preset), [*illuminance.PRESETS]
        )
        raise SceneError(f"{where / 'preset'} is {one_line(repr(preset))}: {listing}")
    mean = _number(table, "mean", where, 0, MOST_LUX)
    uniformity = _number(table, "uniformity", where, 0, 1)
    most = _number(table, "max", where, 0, MOST_LUX)
    if preset:
        mean = illuminance.PRESETS[preset].mean if mean is None else mean
        uniformity = illuminance.PRESETS[preset].uniformity if uniformity is None else uniformity
    if mean is not None and most is not None and mean > most:
        raise SceneError(f"{where} wishes for a mean of {mean:g} lx and at most {most:g} lx")
    ratios = table.get("ratio", [])
    if isinstance(ratios, dict):
        ratios = [ratios]
    if not isinstance(ratios, list):
        raise SceneError(f"{where / 'ratio'} is {one_line(repr(ratios))}: expected {RATIO_EXAMPLE}")
    own = tuple(_ratio(name, x, where / "ratio", planes) for x in ratios)
    return illuminance.Wishes(mean, uniformity, most, own, preset)


RATIO_EXAMPLE = '{ to = "desk", at_least = 0.33 }'


def _ratio(name: str, table: Any, where: SourceKey, planes: Mapping[str, Any]) -> illuminance.Ratio:
    """Return the wish for the ratio of a plane's mean to another's."""
    _check_known(table, ("to", "at_least"), where, RATIO_EXAMPLE)
    to, at_least = table.get("to"), _number(table, "at_least", where, 0, 1e6)
    if at_least is None or not isinstance(to, str):
        raise SceneError(f"{where} is {one_line(repr(table))}: expected {RATIO_EXAMPLE}")
    if to not in planes or to == name:
        others = [plane for plane in planes if plane != name]
        known = f"the file has {some_names(others)}" if others else "the file has no other"
        listing = with_similar_name(known, to, others)
        raise SceneError(f"{where / 'to'} is no other plane, {one_line(repr(to))}: {listing}")
    return illuminance.Ratio(to, at_least)


def _cases(tables: Any, where: SourceKey) -> tuple[illuminance.LightCase, ...]:
    """Return the cases in which all wishes have to hold."""
    example = "[case.night] sky = 0"
    if not isinstance(tables, dict) or len(tables) > MAX_CASES:
        raise SceneError(f"{where} is {one_line(repr(tables))}: expected tables like {example}")
    cases = []
    for name, table in tables.items():
        if not is_name(name):
            raise SceneError(
                f"{where} has {one_line(repr(name))}, which cannot name a folder: choose another"
            )
        if not isinstance(table, dict) or not table:
            raise SceneError(
                f"{where / one_line(name)} is {one_line(repr(table))}: expected lights with their "
                f"emission relative to now, {example}"
            )
        factors = {
            light: _number(table, light, where / one_line(name), 0, MOST_FACTOR, may_be_least=True)
            for light in table
        }
        cases.append(illuminance.LightCase(name, {light: x or 0.0 for light, x in factors.items()}))
    return tuple(cases)


def _observers(tables: Any, where: SourceKey) -> tuple[ObserverRequest, ...]:
    """Return those who see glare."""
    if not isinstance(tables, dict) or len(tables) > MAX_OBSERVERS:
        raise SceneError(
            f"{where} is {one_line(repr(tables))}: expected at most {MAX_OBSERVERS} tables like "
            f"[observer.desk] {OBSERVER_EXAMPLE}"
        )
    observers = []
    for name, table in tables.items():
        own = where / one_line(name)
        _check_known(table, ("at", "towards"), own, OBSERVER_EXAMPLE)
        if not is_name(name) or len(name) > MAX_NAME:
            raise SceneError(f"{own} cannot name a row of a table: choose another")
        if table.get("at") == CAMERA and "towards" not in table:
            observers.append(ObserverRequest(name, own))
            continue
        for key in ("at", "towards"):
            if not _is_vector(table.get(key)):
                raise SceneError(
                    f"{own / key} is {one_line(repr(table.get(key)))}: expected a point, as in "
                    f'{OBSERVER_EXAMPLE}; or at = "{CAMERA}" alone'
                )
        at, towards = (np.array(table[key], float) for key in ("at", "towards"))
        if np.array_equal(at, towards):
            raise SceneError(f"{own} looks towards its own place: expected another point")
        observers.append(ObserverRequest(name, own, at, towards))
    return tuple(observers)


OBSERVER_EXAMPLE = "at = [1, 1.2, 0], towards = [4, 1.2, 0]"


def _power(table: Any, where: SourceKey) -> illuminance.PowerBudget:
    """Return the limit of power."""
    _check_known(table, ("watts", "per_area", "area"), where, "watts = 300")
    if {"watts", "per_area"} <= set(table):
        raise SceneError(f"{where} has watts and per_area: expected one of them")
    return illuminance.PowerBudget(
        _number(table, "watts", where, 0, MOST_WATTS),
        _number(table, "per_area", where, 0, MOST_WATTS),
        _number(table, "area", where, 0, MOST_METRES**2),
    )
