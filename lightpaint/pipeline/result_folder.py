"""The folder of results: which painting it answers, which files may be replaced; and writing an
answer into it: the lighting, the relit scene, files for other programs.

Everything that finds a lighting writes it with these functions: a run, a batch, a variation, a
relight and the painter. They add their own pictures and reports.
"""

import json
import os
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

from lightpaint.arrays import Doubles
from lightpaint.basis import LightGroups
from lightpaint.errors import LightpaintError, OutputError
from lightpaint.files import check_files, check_writable, one_line, read_text, write_text
from lightpaint.lighting import Lighting, write_lighting
from lightpaint.photometry import Glare, Illuminance, readings_files, write_readings
from lightpaint.photometry.planes_file import plane_names
from lightpaint.pipeline.look import RESULTS
from lightpaint.relit import EXPORTS, check_relightable, relight, settle, write_exports
from lightpaint.scene import Scene, load_scene
from lightpaint.sentences import Hint, Sentence
from lightpaint.storage.json_records import read_record, strict_json
from lightpaint.storage.staging import finish, is_below, staged
from lightpaint.version import __version__

FORMAT: Literal["lightpaint-result 1"] = "lightpaint-result 1"

#: File in which a result folder describes itself.
RECORD = "result.json"

#: Suffix of the name of a painting without a file.
IN_MEMORY = " (in memory)"

#: Advice about a folder that holds something else.
REMEDY = Sentence(
    "name another folder (", Hint("folder"), "), or replace it (", Hint("force", True), ")"
)

#: The folder within the folder of the answer.
PLANES_FOLDER = "planes"

#: Files of every answer; a scene may add files that it includes, light groups those for other
#: programs.
LIGHTING, RELIT = "lighting.json", "relit.xml"


@dataclass(frozen=True)
class _Record:
    """The content of result.json.

    answers: sources of the results, relative to the folder: paintings, or the lighting.json of a
    relit scene. files: paths relative to the folder, with the CRC-32 of each file as written.
    """

    format: Literal["lightpaint-result 1"]
    answers: tuple[str, ...]
    files: Mapping[str, str]
    lightpaint: str = __version__


@dataclass(frozen=True)
class ResultFolder:
    """A folder for results, and the rules for replacing files in it.

    Existing files stay, unless they are lightpaint's unchanged answer to the same painting, or
    `force` is set. Files that are read stay in any case.

    folder: it may not exist yet. files: files in it that may be written. reads: files that are
    read. answers: paintings, by file or, for those in memory, by name. adds_to: the lighting that
    was read; if it is in the folder, the new files belong to it, and it stays.
    """

    folder: Path
    files: tuple[Path, ...]
    reads: tuple[Path, ...]
    answers: tuple[Path | str, ...]
    adds_to: Path | None = None
    force: bool = False

    def check(self) -> None:
        """Raise OutputError for a file that cannot be written, or must not be replaced."""
        finish(self.folder)
        check_writable(self.folder)
        record = self._record()
        replaced_files = dict.fromkeys(self._obsolete(record) + list(self.files))
        check_files([*replaced_files, self.folder / RECORD], self.reads)
        existing_files = [file for file in replaced_files if os.path.lexists(file)]
        if self._read_record() is None and os.path.lexists(self.folder / RECORD):
            existing_files.append(self.folder / RECORD)
        if self.force or not existing_files or (record is None and self._belongs_to_lighting):
            return
        if record is None:
            raise self._unrecorded(existing_files)
        if not (self._belongs_to_lighting or set(record.answers) <= set(self._answers)):
            raise OutputError(
                f"{self.folder} holds the answer to {self._names_of(record.answers)}, not to "
                f"{self._names_of(self._answers)}: ",
                REMEDY,
            )
        for file in existing_files:
            checksum = record.files.get(file.relative_to(self.folder).as_posix())
            if checksum is None:
                raise OutputError(f"{file} exists and is not a result of lightpaint: ", REMEDY)
            if checksum != _checksum(file):
                raise OutputError(f"{file} was changed since lightpaint wrote it: ", REMEDY)

    @contextmanager
    def filled(self) -> Iterator[Path]:
        """Yield a folder to write to; its files then appear in the real one, all at once.

        Raises OutputError as `check` does, also for files that appeared in the meantime.
        """
        record = self._record()
        with staged(self.folder, self._obsolete(record)) as stage:
            yield stage
            self._write_record(stage, record)
            self.check()

    @property
    def _real(self) -> str:
        return os.path.realpath(self.folder)

    @property
    def _answers(self) -> list[str]:
        """`answers` as recorded in the file."""
        return [
            os.path.relpath(os.path.realpath(answer), self._real)
            if isinstance(answer, Path)
            else answer + IN_MEMORY
            for answer in self.answers
        ]

    @property
    def _belongs_to_lighting(self) -> bool:
        """True if the new files belong to the lighting in the folder."""
        lighting = self.folder / "lighting.json"
        return self.adds_to is not None and lighting.exists() and self.adds_to.samefile(lighting)

    def _obsolete(self, record: _Record | None) -> list[Path]:
        """Return the files that disappear when new results appear, unless these replace them."""
        if self._belongs_to_lighting:
            return []
        if record is not None:
            return [self.folder / name for name in record.files]
        return earlier_results(self.folder)

    def _record(self) -> _Record | None:
        """Return the content of result.json, if any file that it lists exists."""
        record = self._read_record()
        if record is None:
            return None
        checksums = {name: value for name, value in record.files.items() if is_below(name)}
        if not any((self.folder / name).is_file() for name in checksums):
            return None
        return _Record(FORMAT, tuple(map(os.path.normpath, record.answers)), checksums)

    def _read_record(self) -> _Record | None:
        """Return the content of result.json; None if it is missing or not ours."""
        try:
            text = read_text(self.folder / RECORD, "record", OutputError)
            return read_record(_Record, strict_json(text), others=True)
        except (LightpaintError, ValueError):
            return None

    def _write_record(self, stage: Path, earlier_record: _Record | None) -> None:
        """Record the files in `stage`, and their sources."""
        answers, files = tuple(self._answers), {}
        if self._belongs_to_lighting:
            if earlier_record is None:  # results of an older version stay without a record
                return
            answers, files = earlier_record.answers, dict(earlier_record.files)
        written_files = sorted(file for file in stage.rglob("*") if file.is_file())
        files |= {file.relative_to(stage).as_posix(): _checksum(file) for file in written_files}
        record = asdict(_Record(FORMAT, answers, files))
        write_text(stage / RECORD, json.dumps(record, indent=2, ensure_ascii=False) + "\n")

    def _names_of(self, answers: Iterable[str]) -> str:
        """Return recorded answers, named relative to the working directory."""
        names = [
            answer
            if answer.endswith(IN_MEMORY)
            else os.path.relpath(os.path.join(self._real, answer))
            for answer in answers
        ]
        return one_line(" and ".join(names))

    def _unrecorded(self, existing_files: list[Path]) -> OutputError:
        """Return the error for a folder without a record."""
        if self.folder / "lighting.json" in existing_files:
            return OutputError(
                f"{self.folder} holds results of an older lightpaint, which do not name their "
                "painting: ",
                REMEDY,
            )
        return OutputError(
            f"{existing_files[0]} exists and is not a result of lightpaint: ", REMEDY
        )


def is_as_written(folder: Path) -> bool:
    """Return True if all files in the record of `folder` exist and are unchanged."""
    record = ResultFolder(folder, (), (), ())._read_record()
    return record is not None and all(
        is_below(name) and _checksum(folder / name) == checksum
        for name, checksum in record.files.items()
    )


def earlier_results(folder: Path) -> list[Path]:
    """Return the results in `folder` of a version of lightpaint that kept no record."""
    if not (folder / "lighting.json").is_file():
        return []  # not ours, whatever their names
    return [file for pattern in RESULTS for file in folder.glob(pattern)]


def _checksum(file: Path) -> str:
    """Return the CRC-32 of a file; "" if there is none."""
    if not file.is_file():
        return ""
    crc = 0
    with file.open("rb") as stream:
        while data := stream.read(2**24):
            crc = zlib.crc32(data, crc)
    return f"{crc:08x}"


def files_of_planes(folder: Path, planes: str | Path) -> list[Path]:
    """Return the files of measured planes in a result folder. planes: the path of their file."""
    names, cases = plane_names(planes)
    files = readings_files(names)
    return [folder / PLANES_FOLDER / case / name for case in cases or ("",) for name in files]


def write_planes(
    folder: Path,
    illuminance: Illuminance,
    weights: Mapping[str, Doubles],
    origin: str,
    *,
    glare: Glare | None = None,
) -> None:
    """Write what weights (n, 3) by case give on planes, in a folder for each. origin: of the light,
    in words. glare: of all lights, if it was measured.
    """
    for case, lit in weights.items():
        place, words = folder / PLANES_FOLDER / case, f"{origin}, {case}" if case else origin
        place.mkdir(parents=True, exist_ok=True)
        write_readings(place, illuminance, lit, words, glare=glare)


@dataclass
class AnswerFolder:
    """A hidden folder with an answer, before it replaces the real one.

    Attributes:
        path: The folder.
        relit: The relit scene in that folder; None without a scene.
        has_moved_paths: True if relative paths in relit.xml change when it moves to its final
            place; set at the end.
    """

    path: Path
    relit: Scene | None = None
    has_moved_paths: bool = False

    def seen_through(self, sensor: int) -> Scene:
        """Return the relit scene through a sensor, reloaded if that is a different one."""
        assert self.relit is not None
        if self.relit.sensor == sensor:
            return self.relit
        return reload_relit(self.relit, self.relit.path, sensor)


def write_answer(
    folder: Path,
    lighting: Lighting,
    *,
    scene: Scene | None = None,
    groups: LightGroups | None = None,
    has_lighting: bool = False,
    home: Path | None = None,
) -> Scene | None:
    """Write an answer to files for people and programs; return the relit scene.

    scene: the scene to relight. groups: light groups of another renderer, which get files for other
    programs. has_lighting: True if lighting.json exists already, or is not needed. home: the folder
    to which these files will be moved, if it is another. A lighting that says nothing of places
    gets the places of the scene.
    """
    lighting = with_places(lighting.of_lamps(), scene)
    if not has_lighting:
        write_lighting(folder / LIGHTING, lighting)
    if groups is not None:
        write_exports(folder, groups, lighting, home=home)
    return None if scene is None else relight(scene, lighting, folder / RELIT)


def with_places(lighting: Lighting, scene: Scene | None) -> Lighting:
    """Return a lighting that says where lights are, as in `scene` if it does not, and what sees
    the scene with spectra.
    """
    if scene is not None and scene.is_spectral:
        lighting = replace(lighting, observer=scene.observer)
    if scene is None or lighting.places:
        return lighting
    return replace(lighting, places=scene.emitter_places, up=scene.up)


def answer_files(
    folder: Path,
    *,
    scene: Scene | None = None,
    groups: LightGroups | None = None,
    has_lighting: bool = False,
) -> list[Path]:
    """Return all files that `write_answer` may write.

    Raises the errors that `write_answer` would raise for any lighting, before any expensive work.
    """
    files = [] if has_lighting else [folder / LIGHTING]
    if scene is not None:
        files += check_relightable(scene, folder / RELIT)
    if groups is not None:
        files += [folder / name for name in EXPORTS]
    return files


@contextmanager
def new_answer(
    results: ResultFolder,
    lighting: Lighting,
    *,
    scene: Scene | None = None,
    groups: LightGroups | None = None,
    has_lighting: bool = False,
) -> Iterator[AnswerFolder]:
    """Yield a folder with an answer, to which more files may be added; it then appears all at once.

    The other arguments are as for `write_answer`. Raises OutputError as `ResultFolder.filled` does.
    """
    with results.filled() as folder:
        relit = write_answer(
            folder,
            lighting,
            scene=scene,
            groups=groups,
            has_lighting=has_lighting,
            home=results.folder,
        )
        answer = AnswerFolder(folder, relit)
        yield answer
        if scene is not None:
            home = results.folder / RELIT
            answer.has_moved_paths = settle(scene, lighting, folder / RELIT, home)


def reload_relit(relit: Scene, path: Path, sensor: int) -> Scene:
    """Load a relit scene again from `path`, with its parameters."""
    scene = load_scene(
        path,
        sensor=sensor,
        parameters=relit.parameters,
        use_lights_file=False,
        lamps=["*"],
    )
    return replace(scene, is_spectral=relit.is_spectral, observer=relit.observer)
