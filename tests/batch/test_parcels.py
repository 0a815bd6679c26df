"""What goes to a worker and comes back, without a network: by content, and to the right places."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from batches import contents, write_batch
from light_groups import interleaved, pictures

from lightpaint.batch.parcels import FileHashes, Parcel, ParcelStore, pack, pieces, unpack
from lightpaint.batch.plan.planner import plan_batch
from lightpaint.batch.run import run_batch
from lightpaint.batch.work.item_execution import run_item
from lightpaint.batch.work.work_items import ItemResult, Task, WorkItem
from lightpaint.batch.work.worker_storage import WorkerCache
from lightpaint.errors import BatchError, OutputError
from lightpaint.progress import silent


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "project").mkdir()
    monkeypatch.chdir(tmp_path / "project")
    write_batch(tmp_path / "project")
    return tmp_path / "project"


@pytest.fixture
def store(tmp_path: Path) -> ParcelStore:
    return ParcelStore(tmp_path / "worker")


def task(manifest: Path, output_folder: Path, look: str = "p0") -> Task:
    return next(
        x.steps[0].task for x in plan_batch(manifest, output_folder).looks if x.entry.name == look
    )


def run_item_locally(item: WorkItem) -> ItemResult:
    return run_item(item, WorkerCache(), silent)


def send_parcel(store: ParcelStore, parcel: Parcel) -> None:
    """Send what is lacking, as the engine does."""
    files = {parcel_name: file for file, parcel_name in (*parcel.files, *parcel.local_files)}
    for sum_ in store.missing(parcel):
        for data, is_first, is_last in pieces(Path(files[sum_]).read_bytes()):
            store.put(sum_, data, is_first=is_first, is_last=is_last)
    assert store.missing(parcel) == []


@pytest.mark.parametrize("is_whole", [False, True])
def test_a_look_done_elsewhere_is_the_look_done_here(
    folder: Path, store: ParcelStore, is_whole: bool
) -> None:
    base = folder if is_whole else Path()
    run_batch(plan_batch(base / "looks.toml", base / "expected").select("p0"))
    item = task(base / "looks.toml", base / "expected")
    remote_task = task(base / "looks.toml", base / "out")
    parcel = pack(remote_task, FileHashes(), run="a", is_shared=False)
    assert len(store.missing(parcel)) == 2  # basis and painting
    send_parcel(store, parcel)
    outcome = store.run_parcel(parcel, run_item_locally)
    assert (outcome.failure, outcome.files and sorted(outcome.files)) == (
        "",
        ["lighting.json", "predicted.exr", "report.json", "result.json"],
    )
    assert not (folder / "out").exists()
    assert outcome.files is not None
    unpack(remote_task, outcome.files)
    assert contents(folder / "out/p0") == contents(folder / item.output_folder)
    # And again, as the same answer; but not over what was changed by hand.
    unpack(remote_task, outcome.files)
    (folder / "out/p0/lighting.json").write_text("mine", encoding="utf-8")
    with pytest.raises(OutputError, match="was changed since lightpaint wrote it"):
        unpack(remote_task, outcome.files)
    unpack(force(remote_task), outcome.files)


@pytest.mark.nightly
@pytest.mark.parametrize("is_whole", [False, True])
def test_light_groups_in_a_folder_among_paintings_are_the_same_elsewhere(
    folder: Path, store: ParcelStore, is_whole: bool
) -> None:
    base, images = folder if is_whole else Path(), pictures()
    (folder / "renders").mkdir()
    for name, image in zip("abc", images, strict=True):
        interleaved(folder / f"renders/{name}.exr", {"": image})
    for k in range(2):
        interleaved(folder / f"renders/p{k}.exr", {"": images[k] + images[2] / 2})
    (folder / "groups.toml").write_text(
        'look = [{ light_groups = "renders", paintings = ["renders/p*.exr"], '
        'variations = ["warmer"], want = ["predict"] }]',
        encoding="utf-8",
    )
    run_batch(plan_batch(base / "groups.toml", base / "expected"))
    for look in ("p0", "p1", "p1-warmer"):
        item = task(base / "groups.toml", base / "out", look)
        parcel = pack(item, FileHashes(), run="a", is_shared=False)
        send_parcel(store, parcel)
        results = store.run_parcel(parcel, run_item_locally)
        assert results.failure == ""
        assert results.files is not None
        unpack(item, results.files)
        assert contents(folder / f"out/{look}") == contents(folder / f"expected/{look}")


def force(task_: Task) -> Task:
    job = json.loads(task_.job)
    job["settings"]["force"] = True
    return replace(task_, job=json.dumps(job))


def test_other_content_under_the_same_name_is_sent_anew(folder: Path, store: ParcelStore) -> None:
    item, contents_ = task(folder / "looks.toml", folder / "out"), FileHashes()
    send_parcel(store, pack(item, contents_, run="a", is_shared=False))
    (folder / "p0.exr").write_bytes((folder / "p1.exr").read_bytes())
    parcel = pack(item, contents_, run="a", is_shared=False)
    assert len(store.missing(parcel)) == 1
    send_parcel(store, parcel)
    contents_seen: list[bytes] = []

    def look(work_item: WorkItem) -> ItemResult:
        assert isinstance(work_item, Task)
        [painting] = [file for file in work_item.source_files if file.endswith("p0.exr")]
        contents_seen.append(Path(painting).read_bytes())
        return ItemResult("p0", "answer")

    store.run_parcel(parcel, look)
    assert contents_seen == [(folder / "p1.exr").read_bytes()]


def test_what_comes_otherwise_than_it_was_sent_is_refused(store: ParcelStore) -> None:
    with pytest.raises(BatchError, match="otherwise than it was sent"):
        store.put("0" * 64, b"data", is_first=True, is_last=True)


def test_a_shared_disk_is_believed_only_if_it_holds_the_same(
    folder: Path, store: ParcelStore
) -> None:
    item = task(folder / "looks.toml", folder / "out")
    parcel = pack(item, FileHashes(), run="a", is_shared=True)
    assert store.missing(parcel) == []
    assert store.run_parcel(parcel, run_item_locally).failure == ""
    assert (folder / "out/p0/lighting.json").is_file()
    (folder / "p0.exr").write_bytes(b"other")
    assert "p0.exr is another on a worker" in store.run_parcel(parcel, run_item_locally).failure


def test_files_that_are_only_here_are_carried_to_a_shared_disk_too(
    folder: Path, store: ParcelStore
) -> None:
    only_here = (folder / "b.basis.exr").rename(folder / "only-here.exr")
    write_batch(folder)
    item = replace(task(folder / "looks.toml", folder / "out"), files=(str(only_here),))
    parcel = pack(item, FileHashes(), run="a", is_shared=True)
    assert len(store.missing(parcel)) == 1
    send_parcel(store, parcel)

    def look(work_item: WorkItem) -> ItemResult:
        assert isinstance(work_item, Task)
        assert work_item.source_files == item.source_files
        [file] = work_item.files
        assert file != item.files[0]
        assert Path(file).read_bytes() == only_here.read_bytes()
        return ItemResult("p0", "answer")

    store.run_parcel(parcel, look)


@pytest.mark.parametrize("size", [0, 1, 2**26, 2**26 + 1])
def test_pieces_make_the_whole(size: int) -> None:
    parts = list(pieces(bytes(size)))
    assert sum(len(data) for data, _, _ in parts) == size
    assert [first for _, first, _ in parts] == [True] + [False] * (len(parts) - 1)
    assert [last for _, _, last in parts] == [False] * (len(parts) - 1) + [True]


def test_a_file_that_is_gone_is_one_look_s_failure(folder: Path) -> None:
    item = task(folder / "looks.toml", folder / "out")
    (folder / "p0.exr").unlink()
    with pytest.raises(BatchError, match="cannot read"):
        pack(item, FileHashes(), run="a", is_shared=False)
