"""Work items for other machines: packing their files, running them in a worker of a Dask cluster,
and unpacking their results.

On a shared disk only the content is checked. Otherwise each worker has a store of files by their
SHA-256, so that none is sent twice. An item finds them at their local paths under its own root, so
that relative paths in results stay the same.

A process has one Mitsuba, so a worker runs one task at a time, however many Dask gives it.
"""

import ctypes
import hashlib
import os
import shutil
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from lightpaint.batch.work.item_execution import run_item
from lightpaint.batch.work.work_items import ItemResult, Task, WorkItem, item_label, with_paths
from lightpaint.batch.work.worker_storage import WorkerCache
from lightpaint.display_text import some_names
from lightpaint.errors import BatchError, OutputError
from lightpaint.files import first_line
from lightpaint.pipeline import RECORD, ResultFolder
from lightpaint.progress import silent
from lightpaint.scene.runtime.kernel_threads import limit_threads
from lightpaint.sentences import Hint, Sentence
from lightpaint.storage.json_records import strict_json
from lightpaint.storage.staging import is_below
from lightpaint.version import __version__

#: Bytes of a file that are sent at a time.
PIECE_BYTES = 2**26

#: Parameters of glibc's mallopt, with the values it settles at by itself.
MALLOPT_VALUES = {-1: 2**26, -3: 2**25}  # M_TRIM_THRESHOLD, M_MMAP_THRESHOLD


@dataclass(frozen=True)
class Parcel:
    """A work item for another machine.

    files: those that it needs, by absolute path, with the SHA-256 of each. local_files: the same of
    files that exist only here. place: folder that relative paths start from. is_shared: whether
    `files` are there under the same paths. run: identifies the batch.
    """

    item: WorkItem
    files: tuple[tuple[str, str], ...]
    local_files: tuple[tuple[str, str], ...]
    place: str
    is_shared: bool
    run: str


class FileHashes:
    """SHA-256 of files, each read once as long as it does not change."""

    def __init__(self) -> None:
        self._digests: dict[tuple[str, int, int], str] = {}

    def sha256(self, file: str) -> str:
        """Return the SHA-256 of a file. Raises BatchError for one that cannot be read."""
        try:
            status = os.stat(file)
            key = file, status.st_size, status.st_mtime_ns
            if key not in self._digests:
                with open(file, "rb") as stream:
                    self._digests[key] = hashlib.file_digest(stream, "sha256").hexdigest()
        except OSError as error:
            raise BatchError(f"cannot read {file}: {error.strerror or error}") from error
        return self._digests[key]


def pack(item: WorkItem, contents: FileHashes, *, run: str, is_shared: bool) -> Parcel:
    """Return the item with its files. Raises BatchError for a file that cannot be read."""

    def with_hashes(paths: Iterable[str]) -> tuple[tuple[str, str], ...]:
        absolute_paths = dict.fromkeys(os.path.abspath(file) for file in paths)
        return tuple((file, contents.sha256(file)) for file in absolute_paths)

    files, local_files = with_hashes(item.input_files), with_hashes(item.local_files)
    return Parcel(item, files, local_files, os.getcwd(), is_shared, run)


class ParcelStore:
    """The file store of one worker, in a `folder` of its own."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._contents = FileHashes()
        self._run = ""

    def missing(self, parcel: Parcel) -> list[str]:
        """Return the SHA-256 of files that must be sent first."""
        return [digest for _, digest in files_to_send(parcel) if not self._file(digest).is_file()]

    def put(self, digest: str, data: bytes, *, is_first: bool, is_last: bool) -> None:
        """Store a piece of the file with that SHA-256. Raises BatchError if the sum differs."""
        self._folder.mkdir(parents=True, exist_ok=True)
        temporary = self._file(f"{digest}.half")
        with temporary.open("wb" if is_first else "ab") as file:
            file.write(data)
        if is_last:
            if self._contents.sha256(str(temporary)) != digest:
                temporary.unlink()
                raise BatchError("a file came otherwise than it was sent")
            temporary.chmod(0o444)
            temporary.replace(self._file(digest))

    def run_parcel(self, parcel: Parcel, run_item: Callable[[WorkItem], ItemResult]) -> ItemResult:
        """Run an item here by `run_item`; all its files have to be in the store."""
        folder_before = os.getcwd()
        try:
            if parcel.is_shared:
                return self._run_in_place(parcel, run_item)
            return self._run_apart(parcel, run_item)
        except OSError as error:
            failure = f"a worker cannot do it: {error}"
            return ItemResult(parcel.item.name, parcel.item.kind, failure)
        finally:
            os.chdir(folder_before)

    def _run_in_place(
        self, parcel: Parcel, run_item: Callable[[WorkItem], ItemResult]
    ) -> ItemResult:
        item = parcel.item
        for file, digest in parcel.files:
            try:
                differs = self._contents.sha256(file) != digest
            except BatchError:
                differs = True
            if differs:
                failure = Sentence(
                    f"{file} is another on a worker: is its disk shared? leave out ",
                    Hint("shared_fs", True),
                )
                return ItemResult(item.name, item.kind, failure)
        os.chdir(parcel.place)
        return run_item(with_paths(item, self._path_map(parcel)))

    def _run_apart(self, parcel: Parcel, run_item: Callable[[WorkItem], ItemResult]) -> ItemResult:
        root = self._folder / "runs" / parcel.run
        if self._run != parcel.run:
            shutil.rmtree(root.parent, ignore_errors=True)
            self._run = parcel.run
        item, start_folder = parcel.item, f"{root}{parcel.place}"
        os.makedirs(start_folder, exist_ok=True)
        target = None
        if item.output_folder:
            target = Path(f"{root}{_absolute(parcel, item.output_folder)}")
            shutil.rmtree(target, ignore_errors=True)
        links = {}
        for file, digest in parcel.files:
            place = Path(f"{root}{file}")
            place.parent.mkdir(parents=True, exist_ok=True)
            place.unlink(missing_ok=True)
            os.link(self._file(digest), place)
            links[place] = self._file(digest)
        os.chdir(start_folder)
        result = run_item(with_paths(item, self._path_map(parcel, root)))
        if target is None or result.failure:
            failure = Sentence(result.failure).mapped(lambda text: text.replace(str(root), ""))
            # The full disk is this worker's own; another worker may have room.
            is_lost = result.is_lost or result.is_disk_full
            return replace(result, failure=failure, is_disk_full=False, is_lost=is_lost)
        files = (x for x in sorted(target.rglob("*")) if x.is_file())
        return replace(
            result,
            files={
                file.relative_to(target).as_posix(): _without_root(file.read_bytes(), root)
                for file in files
                if file not in links or not file.samefile(links[file])
            },
        )

    def _path_map(self, parcel: Parcel, root: Path | None = None) -> Callable[[str], str]:
        """Return a function from local paths to paths in the store and, given a root, under it."""
        local_files = {file: str(self._file(digest)) for file, digest in parcel.local_files}
        moved_paths: set[str] = set()
        if root is not None:
            moved_paths |= {file for file, _ in parcel.files}
            if parcel.item.output_folder:
                moved_paths.add(_absolute(parcel, parcel.item.output_folder))
            moved_paths |= {
                str(folder) for file in tuple(moved_paths) for folder in Path(file).parents
            }
            moved_paths.discard("/")
        # Files that this item leaves out of a folder stay out, even if other items sent them.
        folders = {os.path.dirname(file) for file, _ in parcel.files} & moved_paths

        def move(text: str) -> str:
            if (absolute_path := _absolute(parcel, text)) in local_files:
                return local_files[absolute_path]
            is_moved = absolute_path in moved_paths or os.path.dirname(absolute_path) in folders
            return f"{root}{text}" if os.path.isabs(text) and is_moved else text

        return move

    def _file(self, digest: str) -> Path:
        return self._folder / digest


def files_to_send(parcel: Parcel) -> tuple[tuple[str, str], ...]:
    """Return the files that have to be in a worker's store."""
    return parcel.local_files if parcel.is_shared else parcel.files + parcel.local_files


def _without_root(data: bytes, root: Path) -> bytes:
    """Return a file that was written under `root`, with the root removed from paths in texts."""
    return data if b"\0" in data else data.replace(os.fsencode(root), b"")


def _recorded_answers(record: bytes) -> tuple[str, ...]:
    """Return the names of the answers in a worker's record. Raises OutputError."""
    try:
        answers = strict_json(record.decode())["answers"]
        if not (isinstance(answers, list) and all(isinstance(x, str) for x in answers)):
            raise TypeError("answers is not a list of names")
    except (LookupError, TypeError, ValueError) as error:
        raise OutputError(f"a worker's {RECORD} is damaged: {first_line(error)}") from None
    return tuple(answers)


def _absolute(parcel: Parcel, path: str) -> str:
    return os.path.normpath(os.path.join(parcel.place, path))


def pieces(data: bytes) -> Iterable[tuple[bytes, bool, bool]]:
    """Yield pieces of a file, with whether each is the first and the last."""
    offsets: Sequence[int] = range(0, max(len(data), 1), PIECE_BYTES)
    for start in offsets:
        yield data[start : start + PIECE_BYTES], start == 0, start == offsets[-1]


def unpack(item: WorkItem, files: dict[str, bytes]) -> None:
    """Write a worker's files where they belong, all at once.

    Raises OutputError for files that must not be replaced, like those that are written locally.
    """
    folder = Path(item.output_folder)
    if outside_names := [name for name in files if not is_below(name)]:
        raise OutputError(f"a worker would write {some_names(outside_names)} beside {folder}")
    answers = _recorded_answers(files[RECORD]) if RECORD in files else ()
    adds_to = folder / "lighting.json" if item.kind == "render" else None
    results = ResultFolder(
        folder,
        tuple(folder / name for name in files if name != RECORD),
        (),
        tuple(folder / answer for answer in answers),
        adds_to,
        force=isinstance(item, Task) and item.force,
    )
    try:
        with results.filled() as stage:
            for name, data in files.items():
                if name != RECORD:
                    (stage / name).parent.mkdir(parents=True, exist_ok=True)
                    (stage / name).write_bytes(data)
    except OSError as error:
        raise OutputError(f"cannot write into {folder}: {error.strerror or error}") from error


def _keep_memory() -> None:
    """Keep the memory of arrays of a few hundred kilobytes for the next ones.

    Dask's workers return it to the system at once (MALLOC_TRIM_THRESHOLD_). The system then has to
    clear it for each block of pixels, which takes longer than the arithmetic.
    """
    with suppress(AttributeError, OSError):
        mallopt = ctypes.CDLL(None).mallopt
        for parameter, size in MALLOPT_VALUES.items():
            mallopt(parameter, size)


class _WorkerState:
    """State of this process between work items."""

    def __init__(self) -> None:
        self.thread = ThreadPoolExecutor(1, "lightpaint")
        self.cache, self.run = WorkerCache(), ""
        self.stores: dict[str, ParcelStore] = {}

    def store(self, worker: Any) -> ParcelStore:
        """Return the file store of a worker; it is deleted with the worker's folder."""
        folder = str(worker.local_directory)
        return self.stores.setdefault(folder, ParcelStore(Path(folder) / "lightpaint"))


_STATE = _WorkerState()


def versions() -> dict[str, str]:
    """Return the versions of packages that affect the last bit of a result."""
    from importlib.metadata import version

    packages = {name: version(name) for name in ("mitsuba", "drjit", "numpy")}
    return {"lightpaint": __version__, **packages}


def put(digest: str, data: bytes, is_first: bool, is_last: bool, dask_worker: Any = None) -> None:
    """Add a piece of a file to this worker's store."""
    _STATE.store(dask_worker).put(digest, data, is_first=is_first, is_last=is_last)


def do_parcel(parcel: Parcel) -> ItemResult | list[str]:
    """Run an item and return its result, or the SHA-256 of files that are missing."""
    from distributed import get_worker

    return _STATE.thread.submit(_do, parcel, get_worker()).result()


def _do(parcel: Parcel, worker: Any) -> ItemResult | list[str]:
    store = _STATE.store(worker)
    if missing := store.missing(parcel):
        return missing
    if _STATE.run != parcel.run:
        # Files of another batch may have the same names and other contents.
        _STATE.cache.release_renderer()
        _STATE.cache, _STATE.run = WorkerCache(), parcel.run
        threadpool_limits(worker.state.nthreads, "blas")
        limit_threads(worker.state.nthreads)
        _keep_memory()
    worker.log_event(parcel.run, {"item": item_label(parcel.item), "worker": worker.address})
    return store.run_parcel(parcel, lambda item: run_item(item, _STATE.cache, silent))
