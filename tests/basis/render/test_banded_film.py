"""A large film is rendered in bands: to the same bits, and with one band at a time in memory."""

import errno
import os
import signal
from pathlib import Path
from typing import Any

import pytest
from nightly import nightly
from renderer import assert_equal_bits

import lightpaint.scene.scene_render
from lightpaint.basis.cache import basis_cache
from lightpaint.basis.cache.cached_render import obtain_basis
from lightpaint.basis.file import basis_file
from lightpaint.basis.file.file_planes import FilePlanes
from lightpaint.basis.file.half_floats import EncodedPlanes
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.planes import MemoryPlanes
from lightpaint.basis.render import banded_film, basis_render, render_parts
from lightpaint.basis.render.banded_film import (
    FileSums,
    SumPlanes,
    memory_expected,
    memory_needed,
    renders_in_bands,
)
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.basis.render.render_parts import PartRenderer, PartSums, plan_parts
from lightpaint.errors import SceneError
from lightpaint.progress import Interrupted
from lightpaint.scene.mitsuba_scene import Scene

#: Rows of a band: three bands and a shorter one of the twenty rows of the test room.
ROWS = 6


@pytest.fixture(autouse=True)
def small_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps of four samples of a pixel of a band in each half."""
    monkeypatch.setattr(lightpaint.scene.scene_render, "SAMPLES_PER_PASS", 4 * 4 * 24 * ROWS)
    monkeypatch.setattr(basis_render, "TRAINING_SAMPLES", (2**12,))


@pytest.fixture
def whole_basis(small_room: Scene) -> Basis:
    return render_basis(small_room, spp=20, seed=3)


@pytest.fixture
def band_memory(
    monkeypatch: pytest.MonkeyPatch, whole_basis: Basis, small_room: Scene
) -> list[int]:
    """Bands from here on. Returns the bytes of the sums that memory has at a time."""
    _, width = small_room.size
    planes = 2 * len(small_room.lights)
    monkeypatch.setattr(banded_film, "WHOLE_MAX_BYTES", 0)
    monkeypatch.setattr(banded_film, "BAND_BYTES", 12 * planes * width * ROWS)
    assert renders_in_bands(small_room)
    read: list[int] = []
    plain = FileSums.read

    def count_memory(sums: FileSums, half: int, rows: range) -> Any:
        read.append(sums.array[half, :, rows.start : rows.stop].nbytes)
        return plain(sums, half, rows)

    monkeypatch.setattr(FileSums, "read", count_memory)
    return read


def test_bands_have_the_bits_of_the_whole_film(
    small_room: Scene, whole_basis: Basis, band_memory: list[int]
) -> None:
    basis = render_basis(small_room, spp=20, seed=3)
    assert isinstance(basis.planes, SumPlanes)
    assert_equal_bits(basis, whole_basis)
    assert basis.indirect is not None
    for planes in (basis.planes, basis.noise, basis.indirect.planes, basis.indirect.noise):
        array = planes.array()
        assert planes.plane(1).tobytes() == array[1].tobytes()
        assert planes.rows(3, 9).tobytes() == array[:, 3:9].tobytes()
    assert max(band_memory) <= banded_film.BAND_BYTES
    assert len(band_memory) > 8


def test_parts_are_added_in_a_file_to_the_same_bits(
    small_room: Scene,
    whole_basis: Basis,
    band_memory: list[int],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(render_parts, "PART_SAMPLES", 2**11)
    parts, table = plan_parts(small_room, 20), whole_basis.guide_table
    renderer, sums = PartRenderer(small_room, 3, table), PartSums(small_room, parts, seed=3)
    for part in reversed(parts):
        sums.add(part, *renderer.render(part))
    renderer.close()
    basis = sums.basis(table)
    assert len(parts) > 3
    assert isinstance(basis.planes, SumPlanes)
    assert_equal_bits(basis, whole_basis)
    assert band_memory == []  # rows are written, and none is read before the planes are


@pytest.mark.nightly
@pytest.mark.parametrize("after", [nightly(2), 6, nightly(11)])
def test_an_interrupted_band_goes_on_to_the_same_bits(
    small_room: Scene,
    whole_basis: Basis,
    band_memory: list[int],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    after: int,
) -> None:
    """Bands that are behind are brought to those that were rendered, and none twice."""
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(basis_file, "SINGLES_MAX_BYTES", 0)
    plain = FileSums.write

    def interrupted(sums: FileSums, half: int, rows: range, values: Any) -> None:
        plain(sums, half, rows, values)
        if len(band_memory) == after:
            band_memory.append(0)
            os.kill(os.getpid(), signal.SIGINT)

    with monkeypatch.context() as patch:
        patch.setattr(FileSums, "write", interrupted)
        with pytest.raises(Interrupted, match="are kept"):
            obtain_basis(small_room, spp=20, seed=3)
    sensor = small_room.sensor_names[small_room.sensor]
    part = basis_cache.find(small_room.identity, sensor, 3, small_room.size)
    assert part is not None
    assert 0 < part.origin.spp < 20
    basis = obtain_basis(small_room, spp=20, seed=3)
    assert isinstance(basis.planes, EncodedPlanes)
    assert_equal_bits(basis, basis_file.as_stored(whole_basis))


@pytest.mark.nightly
def test_sums_are_read_once_to_write_all_planes(
    small_room: Scene, band_memory: list[int], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    basis = render_basis(small_room, spp=4, seed=3)
    read: list[int] = []
    plain = FileSums.halves

    def count_reads(sums: FileSums, planes: slice, rows: slice) -> Any:
        read.extend(range(*planes.indices(2 * len(small_room.lights))))
        return plain(sums, planes, rows)

    monkeypatch.setattr(FileSums, "halves", count_reads)
    basis_file.write_basis(tmp_path / "a.basis.exr", basis)
    assert sorted(read) == [*range(2 * len(small_room.lights))]


@pytest.mark.nightly
def test_indirect_planes_of_many_lights_stay_in_their_file(
    small_room: Scene, whole_basis: Basis, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Rendered, found again, and of a file: with the bits that memory would have."""
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))
    expected = basis_file.as_stored(render_basis(small_room, spp=20, seed=3))
    assert isinstance(expected.indirect.planes, MemoryPlanes)  # type: ignore[union-attr]
    monkeypatch.setattr(basis_file, "SINGLES_MAX_BYTES", 0)
    monkeypatch.setattr(basis_file, "INDIRECT_MAX_BYTES", 0)
    path = tmp_path / "a.basis.exr"
    basis_file.write_basis(path, whole_basis)
    rendered, cached = (obtain_basis(small_room, spp=20, seed=3) for _ in range(2))
    for basis in (rendered, cached, basis_file.read_basis(path)):
        assert isinstance(basis.planes, EncodedPlanes)
        assert basis.indirect is not None
        assert isinstance(basis.indirect.planes, FilePlanes)
        assert isinstance(basis.indirect.noise, FilePlanes)
        assert_equal_bits(basis, expected)


@pytest.mark.nightly
def test_indirect_planes_of_another_file_are_not_taken(
    small_room: Scene, whole_basis: Basis, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(basis_file, "SINGLES_MAX_BYTES", 0)
    path = tmp_path / "a.basis.exr"
    basis_file.write_basis(path, render_basis(small_room, spp=4, seed=3))
    assert basis_file.leave_indirect(whole_basis, path) is whole_basis
    assert basis_file.leave_indirect(whole_basis, tmp_path / "none.exr") is whole_basis


def test_memory_is_that_of_half_floats_and_some_bands(
    small_room: Scene, band_memory: list[int]
) -> None:
    whole_film, banded = (memory_needed(small_room, in_bands=x) for x in (False, True))
    height, width = small_room.size
    assert whole_film - banded > 9 * len(small_room.lights) * height * width * 12


def test_memory_of_lit_pixels_grows_with_samples_up_to_the_bound(
    small_room: Scene, band_memory: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    bound = memory_needed(small_room, in_bands=True)
    assert memory_expected(small_room, 1) == bound  # few lights may be lit everywhere
    monkeypatch.setattr(banded_film, "MIN_LIGHTS", 1)
    monkeypatch.setattr(banded_film, "BAND_BYTES", 0)
    height, width = small_room.size
    values = len(small_room.lights) * height * width
    expected = [memory_expected(small_room, spp) / values for spp in (1, 2, 1000)]
    assert expected[0] < expected[1] < expected[2]
    assert expected[-1] == banded_film.LIT_BYTES


@pytest.mark.nightly
def test_a_full_disk_is_one_clear_line(
    small_room: Scene, band_memory: list[int], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", full)
    with pytest.raises(SceneError, match=r"0\.0 GB in .*No space left on device.*TMPDIR"):
        render_basis(small_room, spp=2)
