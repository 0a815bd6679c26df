"""Facts about a scene from an earlier run, valid as long as nothing that they depend on changes.

Loading a scene takes seconds, but a cached basis only needs the scene's identity to be found. So
the identity is stored beside the basis, with the other facts that the painter needs. The key covers
everything that they may depend on: the arguments of loading, the code that reads scenes, every file
of the scene, and every file that does not exist but would be read if it did.

In doubt, the facts are discarded and the scene is loaded: for example if a file was written while
it was read, or if only Mitsuba's parser knows which files are read.
"""

import hashlib
import json
import os
import sys
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from lightpaint.basis.cache import basis_cache as bases
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.lights import BasisLight, Lights
from lightpaint.errors import LightpaintError
from lightpaint.files import write_text
from lightpaint.scene import Scene
from lightpaint.scene.checks.tokens import attributes, markup
from lightpaint.scene.lights.lights_file import SceneRequests
from lightpaint.sentences import Sentence
from lightpaint.storage.json_records import read_record, strict_json
from lightpaint.version import __version__

FORMAT = "lightpaint-known 3"

#: Seconds before the start of reading in which no file of the scene may have been written, since
#: file times may be that coarse.
COARSE_S = 2.0

#: Prefixes of environment variables that change how Mitsuba reads a scene.
ENVIRONMENT_PREFIXES = ("MI_", "MITSUBA")

#: Code that reads scenes and computes their identities: our packages, and libraries.
OWN_ROOMS = ("scene", "basis")
LIBRARIES = ("mitsuba", "drjit")


@dataclass(frozen=True)
class SceneFacts:
    """Facts about a scene that are known without loading it.

    identity, sensor, size: the key of its cached basis. spp: the scene's number of samples. path:
    as `Scene.path`. lights: the lights of its basis. remarks: messages from loading it.
    """

    identity: str
    sensor: str
    size: tuple[int, int]
    spp: int
    path: str
    lights: Lights
    remarks: tuple[str, ...]


def facts_key(asking: Mapping[str, Any]) -> str:
    """Return a key for everything that is neither in the scene nor in its files.

    asking: all arguments that decide how the scene is loaded and on which film, as plain values.
    """
    environment = {x: y for x, y in os.environ.items() if x.startswith(ENVIRONMENT_PREFIXES)}
    key = [FORMAT, dict(asking), os.getcwd(), environment, _code_version()]
    return hashlib.sha256(json.dumps(key, sort_keys=True).encode()).hexdigest()[:32]


def recall_facts(key: str) -> SceneFacts | None:
    """Return the stored facts of a scene, or None. key: from `facts_key`."""
    if "mitsuba" in sys.modules:  # other code may have changed its file resolver
        return None
    with suppress(OSError, LightpaintError, LookupError, TypeError, ValueError):
        for file in bases.folder().glob(f"*.{key}{bases.FACTS_SUFFIX}"):
            if not bases.is_own(file):
                continue
            record = strict_json(file.read_text("utf-8"))
            if record["format"] == FORMAT and _is_unchanged(record["places"], record["texts"]):
                facts = record["known"]
                facts["size"] = tuple(facts["size"])
                facts["remarks"] = tuple(map(Sentence.of_record, facts["remarks"]))
                lights = tuple(
                    read_record(BasisLight, light) for light in facts["lights"]["records"]
                )
                requests = SceneRequests(**facts["lights"]["requests"])
                return SceneFacts(**{**facts, "lights": Lights(lights, requests)})
    return None


def remember_facts(
    key: str,
    scene: Scene,
    basis: Basis,
    *,
    remarks: Collection[str],
    began_s: float,
) -> bool:
    """Store the facts of `scene` beside its cached `basis`. Returns whether that worked.

    began_s: system time at which reading of the scene's files began.
    """
    if bases.file_of(basis) is None:
        return False
    facts = SceneFacts(
        scene.identity,
        scene.sensor_names[scene.sensor],
        scene.size,
        scene.spp,
        str(scene.path),
        basis.lights.with_requests(scene.requests),
        tuple(remarks),
    )
    try:
        texts = {path for path in (*scene.files, scene.lights_file) if path is not None}
        places = {str(path): _stamp(path) for path in sorted(scene.places)}
        if any(_is_new(stamp, began_s) for stamp in places.values()):
            return False
        if any(_reads_more(path) for path in scene.files):
            return False
        record = {
            "format": FORMAT,
            "places": places,
            "texts": {str(path): _digest(path) for path in sorted(texts)},
            "known": {**asdict(facts), "remarks": [Sentence(x).record for x in remarks]},
        }
        text = json.dumps(record, allow_nan=False)
        if strict_json(text)["known"]["lights"]["requests"] != asdict(scene.requests):
            return False  # TOML has values that JSON lacks
        write_text(bases.companion_path(basis, f".{key}{bases.FACTS_SUFFIX}"), text)
    except (OSError, LightpaintError, TypeError, ValueError):
        return False
    return True


def _is_unchanged(places: Mapping[str, Any], texts: Mapping[str, str]) -> bool:
    return all(_stamp(Path(path)) == stamp for path, stamp in places.items()) and all(
        _digest(Path(path)) == digest for path, digest in texts.items()
    )


def _stamp(path: Path) -> list[int] | None:
    """Return a value that changes whenever the file does; None if it does not exist."""
    try:
        status = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    return [
        status.st_size,
        status.st_mtime_ns,
        status.st_ctime_ns,
        status.st_ino,
        status.st_dev,
        status.st_mode,
    ]


def _is_new(stamp: list[int] | None, began_s: float) -> bool:
    """Return True if a file may have changed after it was read without a new time stamp."""
    return stamp is not None and max(stamp[1], stamp[2]) > 1e9 * (began_s - COARSE_S)


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _reads_more(path: Path) -> bool:
    """Return True if the XML at `path` makes Mitsuba read further files or folders.

    Raises ValueError if the XML cannot be read here, for example in UTF-16.
    """
    for element in markup(path.read_bytes()):
        tag = element["tag"]
        if tag == b"path" or (tag not in (None, b"include") and "filename" in attributes(element)):
            return True
    return False


@cache
def _code_version() -> str:
    """Return a version of the code that reads scenes, derived from its files."""
    versions = [__version__, sys.version, *(list(_files_of_package(name)) for name in LIBRARIES)]
    versions += [list(_files_in_folder(folder)) for folder in _code_folders()]
    return hashlib.sha256(repr(versions).encode()).hexdigest()


def _code_folders() -> Iterator[Path]:
    """Yield the folders of our own code that reads scenes, including subfolders."""
    package = Path(__file__).parents[2]
    for room in OWN_ROOMS:
        for place, _, _ in sorted(os.walk(package / room)):
            if Path(place).name != "__pycache__":
                yield Path(place)


def _files_of_package(package: str) -> Iterator[tuple[str, int, int]]:
    spec = find_spec(package)
    if spec is not None and spec.origin is not None:
        yield from _files_in_folder(Path(spec.origin).parent)


def _files_in_folder(folder: Path) -> Iterator[tuple[str, int, int]]:
    """Yield path, size and modification time of each file in a folder."""
    for entry in sorted(os.scandir(folder), key=lambda entry: entry.path):
        if entry.is_file():
            status = entry.stat()
            yield entry.path, status.st_size, status.st_mtime_ns
