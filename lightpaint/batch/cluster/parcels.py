"""Errands that are done elsewhere: their files go along by content, and what is written comes back.

On a disk that all share only the content is checked. Else each worker has a store of files by their
SHA-256, so that none is sent to it twice, and an errand finds them under a root of its own, in the
places that they have here: relative paths in what is written come out the same.
"""

import hashlib
import os
import shutil
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from lightpaint.batch.work.task import Task
from lightpaint.batch.work.work_items import Done, Errand
from lightpaint.errors import BatchError, OutputError
from lightpaint.files import first_line
from lightpaint.pipeline.result_folder import RECORD, ResultFolder
from lightpaint.screen import some_names
from lightpaint.storage.json_records import strict_json
from lightpaint.storage.staging import is_below

#: Bytes that are sent at a time.
PIECE = 2**26


@dataclass(frozen=True)
class Parcel:
    """An errand that is done elsewhere.

    files: that it needs, by whole path, with the SHA-256 of each. carried: the same of files that
    are only here. place: folder that relative paths start from. is_shared: whether `files` are
    there under the same paths. run: whose it is.
    """

    errand: Errand
    files: tuple[tuple[str, str], ...]
    carried: tuple[tuple[str, str], ...]
    place: str
    is_shared: bool
    run: str


class Contents:
    """SHA-256 of files, each read once as long as it is as it was."""

    def __init__(self) -> None:
        self._sums: dict[tuple[str, int, int], str] = {}

    def of(self, file: str) -> str:
        """Of that file. Raises BatchError for one that cannot be read."""
        try:
            status = os.stat(file)
            key = file, status.st_size, status.st_mtime_ns
            if key not in self._sums:
                with open(file, "rb") as opened:
                    self._sums[key] = hashlib.file_digest(opened, "sha256").hexdigest()
        except OSError as error:
            raise BatchError(f"cannot read {file}: {error.strerror or error}") from error
        return self._sums[key]


def packed(errand: Errand, contents: Contents, *, run: str, is_shared: bool) -> Parcel:
    """The errand with its files. Raises BatchError for one that cannot be read."""

    def summed(some: Iterable[str]) -> tuple[tuple[str, str], ...]:
        whole = dict.fromkeys(os.path.abspath(file) for file in some)
        return tuple((file, contents.of(file)) for file in whole)

    files, carried = summed(errand.needs), summed(errand.carried)
    return Parcel(errand, files, carried, os.getcwd(), is_shared, run)


class ParcelStore:
    """The files of a worker, in `folder`, which nobody else uses."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._contents = Contents()
        self._run = ""

    def lacking(self, parcel: Parcel) -> list[str]:
        """SHA-256 of what is to be sent first."""
        return [its for _, its in sent_files(parcel) if not self._file(its).is_file()]

    def put(self, sum_: str, data: bytes, *, is_first: bool, is_last: bool) -> None:
        """Take a piece of the file of that SHA-256. Raises BatchError if it comes to another."""
        self._folder.mkdir(parents=True, exist_ok=True)
        half = self._file(f"{sum_}.half")
        with half.open("wb" if is_first else "ab") as file:
            file.write(data)
        if is_last:
            if self._contents.of(str(half)) != sum_:
                half.unlink()
                raise BatchError("a file came otherwise than it was sent")
            half.chmod(0o444)
            half.replace(self._file(sum_))

    def done(self, parcel: Parcel, do: Callable[[Errand], Done]) -> Done:
        """What comes of it when it is done here by `do`. All it needs has to be there."""
        before = os.getcwd()
        try:
            if parcel.is_shared:
                return self._done_in_place(parcel, do)
            return self._done_apart(parcel, do)
        except OSError as error:
            said = f"a worker cannot do it: {error}"
            return Done(parcel.errand.name, parcel.errand.kind, said)
        finally:
            os.chdir(before)

    def _done_in_place(self, parcel: Parcel, do: Callable[[Errand], Done]) -> Done:
        errand = parcel.errand
        for file, its in parcel.files:
            try:
                other = self._contents.of(file) != its
            except BatchError:
                other = True
            if other:
                said = (
                    f"{file} is another on a worker: is its disk shared? leave out shared_fs=True"
                )
                return Done(errand.name, errand.kind, said)
        os.chdir(parcel.place)
        return do(errand.moved(self._mover(parcel)))

    def _done_apart(self, parcel: Parcel, do: Callable[[Errand], Done]) -> Done:
        root = self._folder / "runs" / parcel.run
        if self._run != parcel.run:
            shutil.rmtree(root.parent, ignore_errors=True)
            self._run = parcel.run
        errand, there = parcel.errand, f"{root}{parcel.place}"
        os.makedirs(there, exist_ok=True)
        filled = None
        if errand.writes:
            filled = Path(f"{root}{_whole(parcel, errand.writes)}")
            shutil.rmtree(filled, ignore_errors=True)
        laid = {}
        for file, its in parcel.files:
            place = Path(f"{root}{file}")
            place.parent.mkdir(parents=True, exist_ok=True)
            place.unlink(missing_ok=True)
            os.link(self._file(its), place)
            laid[place] = self._file(its)
        os.chdir(there)
        done = do(errand.moved(self._mover(parcel, root)))
        if filled is None or done.failure:
            # A disk that is full is this worker's, and others have others.
            said, is_lost = done.failure.replace(str(root), ""), done.is_lost or done.is_full
            return replace(done, failure=said, is_full=False, is_lost=is_lost)
        written = (x for x in sorted(filled.rglob("*")) if x.is_file())
        return replace(
            done,
            files={
                file.relative_to(filled).as_posix(): _from_here(file.read_bytes(), root)
                for file in written
                if file not in laid or not file.samefile(laid[file])
            },
        )

    def _mover(self, parcel: Parcel, root: Path | None = None) -> Callable[[str], str]:
        """What leads to files in this store and, given a root, to files and folders under that."""
        carried = {file: str(self._file(its)) for file, its in parcel.carried}
        known: set[str] = set()
        if root is not None:
            known |= {file for file, _ in parcel.files}
            if parcel.errand.writes:
                known.add(_whole(parcel, parcel.errand.writes))
            known |= {str(folder) for file in tuple(known) for folder in Path(file).parents}
            known.discard("/")
        # What is left out of a folder is left out there, too, where others had it sent.
        folders = {os.path.dirname(file) for file, _ in parcel.files} & known

        def move(text: str) -> str:
            if (whole := _whole(parcel, text)) in carried:
                return carried[whole]
            is_there = whole in known or os.path.dirname(whole) in folders
            return f"{root}{text}" if os.path.isabs(text) and is_there else text

        return move

    def _file(self, sum_: str) -> Path:
        return self._folder / sum_


def sent_files(parcel: Parcel) -> tuple[tuple[str, str], ...]:
    """Those that have to be in a worker's store."""
    return parcel.carried if parcel.is_shared else parcel.files + parcel.carried


def _from_here(data: bytes, root: Path) -> bytes:
    """A file that was written under `root`: texts name others by where they are without it."""
    return data if b"\0" in data else data.replace(os.fsencode(root), b"")


def _answers(record: bytes) -> tuple[str, ...]:
    """Names of the answers that a worker's record speaks of. Raises OutputError."""
    try:
        answers = strict_json(record.decode())["answers"]
        if not (isinstance(answers, list) and all(isinstance(x, str) for x in answers)):
            raise TypeError("answers is no list of names")
    except (LookupError, TypeError, ValueError) as error:
        raise OutputError(f"a worker's {RECORD} is damaged: {first_line(error)}") from None
    return tuple(answers)


def _whole(parcel: Parcel, path: str) -> str:
    return os.path.normpath(os.path.join(parcel.place, path))


def pieces(data: bytes) -> Iterable[tuple[bytes, bool, bool]]:
    """Pieces of a file, with whether each is the first and the last."""
    starts: Sequence[int] = range(0, max(len(data), 1), PIECE)
    for start in starts:
        yield data[start : start + PIECE], start == 0, start == starts[-1]


def unpack(errand: Errand, files: dict[str, bytes]) -> None:
    """Write what a worker has written where it belongs, all at once.

    Raises OutputError for what must not be replaced, as if it were written from here.
    """
    folder = Path(errand.writes)
    if odd := [name for name in files if not is_below(name)]:
        raise OutputError(f"a worker would write {some_names(odd)} beside {folder}")
    answers = _answers(files[RECORD]) if RECORD in files else ()
    adds_to = folder / "lighting.json" if errand.kind == "render" else None
    results = ResultFolder(
        folder,
        tuple(folder / name for name in files if name != RECORD),
        (),
        tuple(folder / answer for answer in answers),
        adds_to,
        force=isinstance(errand, Task) and errand.force,
    )
    try:
        with results.filled() as stage:
            for name, data in files.items():
                if name != RECORD:
                    (stage / name).parent.mkdir(parents=True, exist_ok=True)
                    (stage / name).write_bytes(data)
    except OSError as error:
        raise OutputError(f"cannot write into {folder}: {error.strerror or error}") from error
