"""Shows of MVR (DIN SPEC 15801), 1.4 to 1.6: fixtures in their places, and what stands around them.

Lengths become metres; z is up, as in the file.
"""

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, count, islice
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from lightpaint.arrays import Doubles, as_position
from lightpaint.display_text import some_names
from lightpaint.dmx.console_rig import ConsoleRig, RigAxis, RigFixture, RigHead, RigLight
from lightpaint.dmx.gdtf.fixture_type import FixtureType
from lightpaint.dmx.gdtf.mode_channels import ModeHead
from lightpaint.dmx.gdtf.mode_lights import FixtureMode
from lightpaint.errors import RigError
from lightpaint.files import read_bytes
from lightpaint.scene.properties.site import unit
from lightpaint.sentences import Hint
from lightpaint.storage.rig_archive import RigArchive, as_utf_8, library, reading

#: The file in an MVR.
DESCRIPTION = "GeneralSceneDescription.xml"

#: What a file is, for errors.
KIND = "MVR"

#: Millimetres of the file in a metre.
MM = 1000.0

#: Largest number of models around the fixtures, with those that symbols repeat.
MAX_MODELS = 20_000

#: Least distance of a focus point from a light, in metres.
NEAREST_FOCUS = 0.01

#: What to know of fixtures without an address.
_UNPATCHED = "no address, so the lights are in the scene, but nothing is sent to them"

#: Elements of a list of children that are geometry, and have models.
_OBJECTS = ("SceneObject", "Truss", "Support", "VideoScreen", "Projector")

#: Characters of the name of a light: others mean something in patterns, options or ids.
_UNUSUAL = re.compile(r"[^\w \-+()#'&/:;!]")


@dataclass(frozen=True)
class ShowNode:
    """An element of a show in its place.

    matrix: to the world, (4, 4), column vectors, metres. parent: the same of what it hangs on.
    siblings: the list that it is in.
    """

    element: Element
    matrix: Doubles
    parent: Doubles
    siblings: Element


@dataclass(frozen=True)
class NamedFixture:
    """A fixture, and the name of its light, which the names of its pixels begin with.

    data: as pymvr reads it. addresses: absolute ones, by the file's breaks; empty without any.
    """

    name: str
    node: ShowNode
    data: Any
    addresses: Mapping[int, int]


@dataclass(frozen=True)
class PlacedModel:
    """A file with geometry, and its place as in `ShowNode`."""

    file: str
    matrix: Doubles


@dataclass(frozen=True)
class KindSummary:
    """The fixtures of one type and mode: their names, and what is known of their lights.

    emission: where it comes from. remarks: what was assumed or left. lacking: colours that the file
    lacks.
    """

    kind: str
    mode: str
    fixtures: tuple[str, ...]
    emitters: tuple[str, ...]
    emission: str
    remarks: tuple[str, ...]
    lacking: tuple[str, ...] = ()


@dataclass(frozen=True)
class Show:
    """The content of an MVR.

    kinds: its types and modes. models: of the room. remarks: on what was left.
    """

    rig: ConsoleRig
    kinds: tuple[KindSummary, ...]
    models: tuple[PlacedModel, ...] = ()
    remarks: tuple[str, ...] = ()


def read_rig(
    path: str | Path,
    *,
    gdtf_folder: str | Path | None = None,
    zoom: float | None = None,
    pixels: bool = False,
    usual_colors: bool = False,
) -> ConsoleRig:
    """Read the fixtures of an MVR, 1.4 to 1.6, with types in GDTF, 1.0 to 1.2.

    Args:
        path: The MVR.
        gdtf_folder: Folder with GDTF files, which replace files of the same name in the archive, or
            complete them.
        zoom: Beam angle in degrees of all fixtures that have a zoom. None for what they rest at.
        pixels: Whether each beam with channels of its own becomes a light. Otherwise a fixture is
            one light.
        usual_colors: Whether usual colours stand for the colours of emitters and filters that a
            file lacks.

    Raises:
        RigError: For a file that is not such a show, is damaged or too large; a missing GDTF, an
            unknown mode, two fixtures on one address, a channel beyond its universe, no fixture, a
            fixture without colour data.
    """
    options: dict[str, Any] = {"zoom": zoom, "pixels": pixels, "usual_colors": usual_colors}
    return read_show(Path(path), gdtf_folder=gdtf_folder, **options).rig


def read_show(
    path: Path,
    *,
    gdtf_folder: str | Path | None = None,
    zoom: float | None = None,
    pixels: bool = False,
    usual_colors: bool = False,
) -> Show:
    """Read an MVR with what stands around its fixtures. See `read_rig`."""
    folder = None if gdtf_folder is None else Path(gdtf_folder)
    with RigArchive(path, path.name, KIND) as archive:
        root = archive.xml(DESCRIPTION)
        with reading(path.name):
            show = _ShowReader(archive, root, folder, {"zoom": zoom, "pixels": pixels}).read()
    if not usual_colors:
        _check_colours(show)
    return show


def _check_colours(show: Show) -> None:
    """Raise RigError, which lists them, for fixtures whose files lack colours."""
    lacking = [kind for kind in show.kinds if kind.lacking]
    if not lacking:
        return
    fixtures = [name for kind in lacking for name in kind.fixtures]
    missing = "; ".join(f"{kind.kind} lacks {some_names(kind.lacking)}" for kind in lacking)
    raise RigError(
        f"{show.rig.name} has no colour data for {some_names(fixtures)}: {missing}; give GDTF "
        "files that have them in a folder with ",
        Hint("gdtf_folder"),
        ", or take usual colours with ",
        Hint("usual_colors", True),
    )


def show_nodes(root: Element) -> Iterator[ShowNode]:
    """Yield all elements of a show that have a place, in the order of the file."""
    for layer in root.iterfind("Scene/Layers/Layer"):
        yield from _nodes_below(layer, world_matrix(layer))


def _nodes_below(element: Element, matrix: Doubles) -> Iterator[ShowNode]:
    for children in element.findall("ChildList"):
        for child in children:
            node = ShowNode(child, matrix @ world_matrix(child), matrix, children)
            yield node
            yield from _nodes_below(child, node.matrix)


def world_matrix(element: Element) -> Doubles:
    """Return the matrix of an element, (4, 4): column vectors, metres."""
    text = element.findtext("Matrix")
    # pymvr reads no blanks between the braces.
    written: Any = re.sub(r"\}\s*\{", "}{", text.strip()) if text and text.strip() else 0
    rows = np.array(library("pymvr").Matrix(written).matrix, float)
    # The rows are the axes, and the last one is the position.
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rows[:3, :3].T, rows[3, :3] / MM
    if not np.isfinite(matrix).all():
        raise ValueError(f"the matrix {text}")
    return matrix


def named_fixtures(
    nodes: Sequence[ShowNode], name: str
) -> tuple[list[NamedFixture], dict[str, list[str]]]:
    """Return the fixtures of a show that have a type, and the names of others by reason.

    name: of the file, for errors. Raises RigError if there are none.
    """
    fixtures: list[NamedFixture] = []
    left: dict[str, list[str]] = {}
    used: set[str] = set()
    for node in (x for x in nodes if x.element.tag == "Fixture"):
        data = library("pymvr").Fixture(xml_node=_without_children(node.element))
        addresses = _addresses_of(node.element)
        if data.multipatch or not data.gdtf_spec:
            reason = "as a copy of another fixture" if data.multipatch else "without a GDTF"
            left.setdefault(f"left out, {reason}", []).append(data.name)
            continue
        label = " ".join(filter(None, (_id_of(data), data.name or "light")))
        own_name = _free_name(" ".join(_UNUSUAL.sub("_", label).split()), used)
        used.add(own_name)
        fixtures.append(NamedFixture(own_name, node, data, addresses))
    if not fixtures:
        reasons = "; ".join(f"{some_names(names)} {why}" for why, names in left.items())
        raise RigError(f"{name} has no fixture" + (f" to use: {reasons}" if left else ""))
    return fixtures, left


def _free_name(name: str, used: Collection[str]) -> str:
    """Return a name that is not used yet, with a number behind it if need be."""
    numbered = (f"{name} ({k})" for k in count(2))
    return next(x for x in chain([name], numbered) if x not in used)


class _ShowReader:
    """The reading of one show."""

    def __init__(
        self,
        archive: RigArchive,
        root: Element,
        gdtf_folder: Path | None,
        options: Mapping[str, Any],
    ) -> None:
        self.archive, self.root, self.folder = archive, root, gdtf_folder
        self.options = options
        self.types: dict[str, FixtureType] = {}

    def read(self) -> Show:
        nodes = [*show_nodes(self.root)]
        points = [x for x in nodes if x.element.tag == "FocusPoint"]
        focus = {x.element.get("uuid"): x.matrix[:3, 3] for x in points}
        named, left = named_fixtures(nodes, self.archive.name)
        self._read_types({fixture.data.gdtf_spec for fixture in named})
        fixtures: list[RigFixture] = []
        modes: list[FixtureMode] = []
        for fixture in named:
            mode, addresses, missing = self._mode_of(fixture)
            if missing:
                numbers = ", ".join(map(str, sorted(missing)))
                reason = f"without its channels of break {numbers}, which has no address"
                left.setdefault(reason, []).append(fixture.name)
            lights = _lights(fixture, mode, focus.get(fixture.data.focus))
            kind = self.types[fixture.data.gdtf_spec].name
            label = fixture.data.name or kind
            channels = mode.channels
            turned = [_head(x, fixture.node.matrix, lights) for x in mode.heads]
            if not addresses:
                left.setdefault(_UNPATCHED, []).append(fixture.name)
                lights, channels, turned = tuple(map(_uncontrolled, lights)), (), []
            fixtures.append(
                RigFixture(
                    *(_id_of(fixture.data), label, kind, mode.name, addresses),
                    channels,
                    lights,
                    tuple(turned),
                )
            )
            modes.append(mode)
        if not any(x.lights for x in fixtures):
            raise RigError(f"{self.archive.name} has no fixture whose channels dim light")
        rig = ConsoleRig(self.archive.name, tuple(fixtures))
        models = tuple(islice(_models(nodes, self.root), MAX_MODELS + 1))
        if len(models) > MAX_MODELS:
            raise RigError(f"{self.archive.name} shows more than {MAX_MODELS} models")
        remarks = tuple(f"{some_names(names)}: {why}" for why, names in left.items())
        return Show(rig, _summaries(fixtures, modes), models, remarks)

    def _read_types(self, specs: Collection[str]) -> None:
        """Read each type once. Raises RigError, which lists all that are missing."""
        own = {} if self.folder is None else _files_in(self.folder)
        missing = []
        for spec in sorted(specs):
            member = self.archive.find(spec) or self.archive.find(f"{spec}.gdtf")
            name = as_utf_8(spec)
            if (file := own.get(name.casefold())) is not None:
                self.types[spec] = FixtureType(read_bytes(file, "GDTF", RigError), file.name)
            elif member is not None:
                self.types[spec] = FixtureType(self.archive.read(member), name)
            else:
                missing.append(name)
        if missing:
            raise RigError(
                f"{self.archive.name} lacks the GDTF {some_names(missing)}: give a folder that has "
                f"{'it' if len(missing) == 1 else 'them'} with ",
                Hint("gdtf_folder"),
            )

    def _mode_of(self, fixture: NamedFixture) -> tuple[FixtureMode, dict[int, int], set[int]]:
        """Return the mode of a fixture, addresses by break, and breaks that have none."""
        type_, wanted = self.types[fixture.data.gdtf_spec], fixture.data.gdtf_mode or ""
        breaks = type_.breaks(wanted)
        if not fixture.addresses:
            return type_.mode(wanted, **self.options), {}, set()
        # MVR counts breaks from 0 and GDTF from 1; some programs count from 1 in both.
        first = 1 if min(fixture.addresses) == 0 else 0
        own = {number + first: address for number, address in fixture.addresses.items()}
        if not breaks & own.keys() and len(own) == 1 and len(breaks) == 1:
            own = dict.fromkeys(breaks, min(own.values()))
        mode = type_.mode(wanted, frozenset(own), **self.options)
        return mode, own, breaks - own.keys()


def _lights(
    fixture: NamedFixture, mode: FixtureMode, target: Doubles | None
) -> tuple[RigLight, ...]:
    """Return the lights of a fixture. target: its focus point, if it has one."""
    names = [f"{fixture.name} {x.name}" if x.name else fixture.name for x in mode.lights]
    return tuple(
        _placed(name, light, fixture.node.matrix, target)
        for name, light in zip(names, mode.lights, strict=True)
    )


def _placed(name: str, light: RigLight, matrix: Doubles, target: Doubles | None) -> RigLight:
    """Return a light of a mode in the world. target: point that it is aimed at, if there is one."""
    position = matrix[:3, :3] @ light.position + matrix[:3, 3]
    direction, up = (matrix[:3, :3] @ way for way in (light.direction, light.up))
    if target is not None and np.linalg.norm(target - position) > NEAREST_FOCUS:
        direction = target - position
    if not np.linalg.norm(direction) > 0 or not np.linalg.norm(up) > 0:
        raise ValueError(f"the matrix of {name}, which has no volume")
    return replace(
        light, name=name, position=as_position(position), direction=unit(direction), up=unit(up)
    )


def _head(head: ModeHead, matrix: Doubles, lights: Sequence[RigLight]) -> RigHead:
    """Return a head of a mode in the world. lights: of its fixture."""
    turn = matrix[:3, :3]
    axes = tuple(
        RigAxis(x.name, x.channel, unit(turn @ x.axis), x.levels, x.degrees) for x in head.axes
    )
    return RigHead(axes, unit(turn @ head.direction), tuple(lights[k].name for k in head.lights))


def _uncontrolled(light: RigLight) -> RigLight:
    """Return a light that no channel sets."""
    emitters = tuple(replace(x, channels=()) for x in light.emitters)
    return replace(light, emitters=emitters, dimmers=(), masters=(), filters=(), chromaticity=())


def _id_of(fixture: Any) -> str:
    """Return the number that a console shows; programs write 0 for none."""
    text = (fixture.fixture_id or "").strip()
    return "" if text == "0" else text


def _without_children(element: Element) -> Element:
    """Return an element without its list of children, which are read by themselves."""
    alone = Element(element.tag, element.attrib)
    alone.extend([x for x in element if x.tag not in ("ChildList", "Matrix")])
    return alone


def _addresses_of(element: Element) -> dict[int, int]:
    """Return absolute addresses by the file's break, without 0, which pymvr takes for 1."""
    found = {}
    for entry in element.iterfind("Addresses/Address"):
        text = (entry.text or "").strip()
        if text and text != "0":
            address = library("pymvr").Address(xml_node=entry)
            absolute = 512 * (address.universe - 1) + address.address
            if absolute < 1:
                raise ValueError(f"the address {text}")
            found[address.dmx_break] = absolute
    return found


def _files_in(folder: Path) -> dict[str, Path]:
    """Return the GDTF files in a folder, by their names in lower case."""
    try:
        return {x.name.casefold(): x for x in sorted(folder.iterdir()) if x.suffix == ".gdtf"}
    except OSError as error:
        raise RigError("cannot read the folder ", folder, f": {error.strerror}") from None


def _models(nodes: Sequence[ShowNode], root: Element) -> Iterator[PlacedModel]:
    """Yield the models of all objects; the models of symbols, which may hold others, too."""
    symbols = {x.get("uuid"): x for x in root.iterfind("Scene/AUXData/Symdef")}
    for node in nodes:
        if node.element.tag in _OBJECTS:
            for geometries in node.element.findall("Geometries"):
                yield from _models_in(geometries, node.matrix, symbols, ())


def _models_in(
    geometries: Element,
    matrix: Doubles,
    symbols: Mapping[str | None, Element],
    inside: tuple[str | None, ...],
) -> Iterator[PlacedModel]:
    for item in geometries:
        own = matrix @ world_matrix(item)
        if item.tag == "Geometry3D" and item.get("fileName"):
            yield PlacedModel(item.get("fileName", ""), own)
        elif item.tag == "Symbol" and (name := item.get("symdef")) not in inside:
            for children in symbols[name].findall("ChildList") if name in symbols else ():
                yield from _models_in(children, own, symbols, (*inside, name))


def _summaries(
    fixtures: Sequence[RigFixture], modes: Sequence[FixtureMode]
) -> tuple[KindSummary, ...]:
    """Return a summary for each type and mode, in the order of their first fixtures."""
    summaries: dict[tuple[str, str, tuple[str, ...]], KindSummary] = {}
    for fixture, mode in zip(fixtures, modes, strict=True):
        key = fixture.kind, fixture.mode, mode.lacking
        names = tuple(dict.fromkeys(e.name for light in mode.lights for e in light.emitters))
        known_of = names, mode.emission, mode.remarks, mode.lacking
        new = KindSummary(fixture.kind, fixture.mode, (), *known_of)
        known = summaries.setdefault(key, new)
        label = " ".join(filter(None, (fixture.fixture_id, fixture.name)))
        summaries[key] = replace(known, fixtures=(*known.fixtures, label))
    return tuple(summaries.values())
