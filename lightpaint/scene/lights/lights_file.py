"""The lights file: a TOML file beside the scene that says which lights to adjust and to group.

For `hall.xml` it is `hall.lights.toml`; docs/formats.md has the details. Constraints and permitted
moves are stored unparsed; lighting/constraints/constraints_file.py and placement/rigging.py read
them.
"""

import os
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from lightpaint import validation
from lightpaint.colour import file_of_spectrum
from lightpaint.display_text import known_keys
from lightpaint.errors import SceneError
from lightpaint.files import one_line, read_text
from lightpaint.luminaires import LUMINAIRE_KEYS, PHOTOMETRY, LuminaireRequest, luminaires_in
from lightpaint.scene.lights.texels.image_domains import GridSize
from lightpaint.scene.lights.texels.texel import TexelLayout, image_of, parse_size
from lightpaint.storage.json_records import strict_toml

SUFFIX = ".lights.toml"
#: Keys of constraints for the solve.
CONSTRAINTS = (
    *("light", "tie", "prefer_current", "sparse", "start", "near"),
    *("cd_per_unit", "prefer_emitters"),
)
#: Older key for `prefer_current`, as in `prefer = { current = 0.01 }`.
OLDER = ("prefer",)
#: Keys of permitted moves, and the keys of a light in `[light.NAME]`.
RIGGING, MOVES = ("on", "new", "pair"), ("move", "aim", "cone", "beam")
#: Key of a light in `[light.NAME]` for the size of its image.
SPLIT = "split"
#: Key of a light in `[light.NAME]` for an image that is equal to its mirror image.
SYMMETRIC = "symmetric"
#: Key of a light in `[light.NAME]` for the number of finer texels with which a sun is found.
SUN = "sun"
#: Keys of a light for its image.
IMAGE_KEYS = (SPLIT, SYMMETRIC, SUN)
KNOWN_KEYS = ("lights", "groups", "group_alike", *CONSTRAINTS, *RIGGING)

#: Maximum size of a lights file in bytes.
MAX_BYTES = 2**20


@dataclass(frozen=True)
class SceneRequests:
    """Constraints and permitted moves of a lights file, unparsed.

    source: the file, for errors; "" if there is none, and hence no constraints.
    """

    keys: Mapping[str, Any] = field(default_factory=dict)
    source: str = ""

    @classmethod
    def of(cls, path: Path, data: Mapping[str, Any]) -> "SceneRequests":
        """Return the requests among the keys of the lights file at `path`."""
        keys = (*CONSTRAINTS, *OLDER, *RIGGING)
        return cls({key: data[key] for key in keys if key in data}, str(path))

    @property
    def _tables(self) -> dict[str, Mapping[str, Any]]:
        """The tables `[light.NAME]`; `constraints_of` refuses anything else there."""
        lights = self.keys.get("light")
        tables = lights.items() if isinstance(lights, dict) else ()
        return {name: table for name, table in tables if isinstance(table, dict)}

    def _values(self, key: str, check: validation.Check) -> dict[str, Any]:
        """Return the values of a key by the names of the lights that have it. Raises SceneError."""
        values = {name: table[key] for name, table in self._tables.items() if key in table}
        for name, value in values.items():
            if not check.is_valid(value):
                raise SceneError(
                    f"{self.source}: light.{name}.{key} is {one_line(repr(value))}: expected "
                    f"{check.expectation}"
                )
        return values

    @property
    def split(self) -> dict[str, GridSize | TexelLayout]:
        """Columns and rows, or layouts, of images to split into texels, by name of the light."""
        return {
            name: parse_size(table[SPLIT], f"{self.source}: light.{name}.{SPLIT}")
            for name, table in self._tables.items()
            if SPLIT in table
        }

    @property
    def lamps(self) -> tuple[str, ...]:
        """Names and patterns of the lights whose emitters it lists."""
        return tuple(
            name for name, table in self._tables.items() if {"emitters", PHOTOMETRY} & table.keys()
        )

    @property
    def cd_per_unit(self) -> float:
        """Candelas of an intensity of 1 in a scene with luminaires: 1 unless the file says it.

        Raises SceneError for an invalid value.
        """
        value = self.keys.get("cd_per_unit", 1.0)
        if not (validation.is_number(value) and 0 < value <= validation.BRIGHTEST):
            raise SceneError(
                f"{self.source}: cd_per_unit is {one_line(repr(value))}: expected candelas of an "
                "intensity of 1 in the scene, like 1"
            )
        return float(value)

    @property
    def luminaires(self) -> dict[str, LuminaireRequest]:
        """Luminaires, by name or pattern of the lights whose places they take.

        Raises SceneError for an invalid value, and for keys that a luminaire cannot have.
        """
        lights = self.keys.get("light")
        luminaires = luminaires_in(lights, self.source)
        for name in luminaires:
            assert isinstance(lights, Mapping)
            if refused := [key for key in (*IMAGE_KEYS, *MOVES) if key in lights[name]]:
                reason = "shows no picture" if refused[0] in IMAGE_KEYS else "stays where it is"
                raise SceneError(
                    f"{self.source}: light.{one_line(name)} has {PHOTOMETRY} and {refused[0]}, and "
                    f"a luminaire {reason}: leave one out"
                )
        return luminaires

    def only_luminaires(self) -> "SceneRequests":
        """Return the requests for luminaires, without constraints on them, and their scale."""
        if not (luminaires := self.luminaires):
            return SceneRequests()
        tables = {
            name: {key: x for key, x in self.keys["light"][name].items() if key in LUMINAIRE_KEYS}
            for name in luminaires
        }
        scale = {key: self.keys[key] for key in ("cd_per_unit",) if key in self.keys}
        return SceneRequests({"light": tables, **scale}, self.source)

    @property
    def spectrum_files(self) -> tuple[Path, ...]:
        """The files of the spectra of its emitters."""
        lists = [x.get("emitters") for x in self._tables.values()]
        emitters = [x for found in lists if isinstance(found, list) for x in found]
        spectra = [x.get("spectrum") for x in emitters if isinstance(x, dict)]
        files = dict.fromkeys(file_of_spectrum(x) for x in spectra if isinstance(x, str))
        return tuple(Path(self.source).parent / file for file in files if file is not None)

    @property
    def symmetric(self) -> frozenset[str]:
        """Names of the lights whose images are symmetric."""
        values = self._values(SYMMETRIC, replace(validation.SWITCH, expectation="true or false"))
        return frozenset(name for name, value in values.items() if value)

    @property
    def sun(self) -> dict[str, int]:
        """Number of texels that a sky may get more where a sun is, by name of the light."""
        expectation = "how many texels more the sky may get, such as 72"
        counts = self._values(SUN, replace(validation.whole(0), expectation=expectation))
        return {name: count for name, count in counts.items() if count}

    @property
    def names(self) -> tuple[str, ...]:
        """Names and patterns of lights with constraints."""
        lights, ties = self.keys.get("light"), self.keys.get("tie")
        named = lights if isinstance(lights, dict) else ()
        start = self.keys.get("start")
        started = start if isinstance(start, dict) else ()
        return (*named, *started, *_texts(ties), *_texts(self.keys.get("pair")))


@dataclass(frozen=True)
class LightsFile:
    """The content of a lights file. path: None if there is no file.

    lights, groups, group_alike: as in `choose_lights`. requests: constraints on lights, and
    permitted moves.
    """

    path: Path | None = None
    lights: Iterable[str] | None = None
    groups: Mapping[str, Iterable[str]] = field(default_factory=dict)
    requests: SceneRequests = field(default_factory=SceneRequests)
    group_alike: bool = True

    def with_more(
        self, lights: Iterable[str] | None, groups: Mapping[str, Iterable[str]] | None
    ) -> "LightsFile":
        """Return the content combined with arguments: `lights` replaces its own, `groups` are
        added.
        """
        groups = groups or {}
        if lights is None and self.lights is not None:
            # A group given as an argument is meant to be adjusted.
            lights = (*self.lights, *groups)
        return replace(self, lights=lights, groups={**self.groups, **groups})

    def only_luminaires(self) -> "LightsFile":
        """Return the content without anything but its luminaires, and their scale."""
        requests = self.requests.only_luminaires()
        return LightsFile(self.path, requests=requests) if requests.keys else LightsFile()

    def without_groups_of(self, images: Collection[str]) -> "LightsFile":
        """Return the content without the pairs of texels of images that are not split."""
        groups = {
            name: names for name, names in self.groups.items() if image_of(name) not in images
        }
        return replace(self, groups=groups)


def lights_file_beside(scene: Path) -> Path:
    """Return the path of the lights file of `scene`, whether it exists or not."""
    return scene.with_name(scene.stem + SUFFIX)


def lights_file_for(
    scene: Path, path_given: str | Path | None, *, beside_scene: bool
) -> LightsFile:
    """Return the content of `path_given`, or else of the file beside `scene` if permitted.

    Whatever has the name of that file is read: a link that leads nowhere is not absent.
    """
    if path_given is not None:
        return read_lights_file(Path(path_given))
    path = lights_file_beside(scene)
    return read_lights_file(path) if beside_scene and os.path.lexists(path) else LightsFile()


def read_lights_file(path: Path) -> LightsFile:
    """Read a lights file.

    Raises SceneError with the line of a TOML error, or with the wrong key.
    """
    data = read_keys(path)
    groups, group_alike = data.get("groups", {}), data.get("group_alike", True)
    if not isinstance(group_alike, bool):
        value = one_line(repr(group_alike))
        raise SceneError(f"{path}: group_alike is true or false, not {value}")
    if not isinstance(groups, dict):
        raise SceneError(f'{path}: groups is a table, [groups], with lines like a = ["b", "c"]')
    return LightsFile(
        path,
        _names(path, "lights", data["lights"]) if "lights" in data else None,
        {
            name: _names(path, f"groups.{one_line(name)}", members)
            for name, members in groups.items()
        },
        SceneRequests.of(path, data),
        group_alike,
    )


def read_keys(path: Path) -> dict[str, Any]:
    """Return all keys of a lights file. Raises SceneError if one is unknown."""
    text = read_text(path, "lights file", SceneError, limit=MAX_BYTES, may_be_empty=True)
    try:
        data = strict_toml(text)
    except ValueError as error:
        end = f"at line {text.rstrip().count(chr(10)) + 1}, the end"
        reason = one_line(str(error).replace("at end of document", end))
        raise SceneError(f"{path} is not TOML: {reason}") from None
    if unknown := [key for key in data if key not in (*KNOWN_KEYS, *OLDER)]:
        key = unknown[0]
        raise SceneError(
            f"{path}: unknown key {one_line(repr(key))}; {known_keys(key, KNOWN_KEYS)}"
        )
    if any(not -(2**63) <= number < 2**63 for number in _integers(data)):
        raise SceneError(f"{path} is not TOML: it has an integer of more than 64 bits")
    if (count := sum(1 for _ in _texts_in(data))) > validation.MAX_LISTED:
        raise SceneError(f"{path} names {count} lights: expected at most {validation.MAX_LISTED}")
    if any(len(text) > validation.MAX_NAME for text in _texts_in(data)):
        raise SceneError(f"{path} has a name of more than {validation.MAX_NAME} characters")
    return data


def _texts(value: Any) -> Iterator[str]:
    """Yield all strings in lists, and in the `lights` of tables, at any depth."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        yield from _texts(value.get("lights"))
    elif isinstance(value, list):
        for text in value:
            yield from _texts(text)


def _texts_in(value: Any) -> Iterator[str]:
    """Yield all keys and strings, at any depth."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        yield from value
        for entry in value.values():
            yield from _texts_in(entry)
    elif isinstance(value, list):
        for entry in value:
            yield from _texts_in(entry)


def _integers(value: Any) -> Iterator[int]:
    if isinstance(value, int):
        yield value
    elif isinstance(value, dict | list):
        for number in value.values() if isinstance(value, dict) else value:
            yield from _integers(number)


def _names(path: Path, key: str, value: Any) -> tuple[str, ...]:
    if not (isinstance(value, list) and value and all(isinstance(v, str) and v for v in value)):
        text = one_line(repr(value))
        raise SceneError(f'{path}: {key} is a list of at least one name, ["a", "b"], not {text}')
    return tuple(value)
