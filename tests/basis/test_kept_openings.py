"""A basis of many lights that opens before its planes are read, with what is known of them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lightpaint as lp
from lightpaint.basis.cache import basis_cache, opening
from lightpaint.basis.file import basis_file
from lightpaint.basis.file.deferred_planes import DeferredPlanes
from lightpaint.basis.plane_results import array_name, array_once, known_arrays
from lightpaint.errors import BasisError, ImageError
from lightpaint.images.formats import RowFile

N = 6


@pytest.fixture(autouse=True)
def _few_are_many(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(basis_file, "MIN_LIGHTS", N)


@pytest.fixture
def kept(make_basis: Any) -> lp.Basis:
    """A cached basis, as it is read, of which all that a session begins with was computed."""
    rng = np.random.default_rng(3)
    images = rng.random((N, 12, 10, 3)) * (rng.random((N, 12, 10, 1)) < 0.3)
    assert basis_cache.keep(make_basis(images=images, half_differences=images / 8))
    basis = basis_cache.find(*arguments(make_basis(N)))
    assert basis is not None
    _ = basis.current_look, basis.power
    array_once(basis.noise, "loudest", lambda: np.array([x.max() for x in basis.noise]))
    assert opening.keep_opening(basis)
    return basis


def arguments(basis: lp.Basis) -> tuple[str, str, int, tuple[int, int]]:
    origin = basis.origin
    return origin.scene_identity, origin.sensor, origin.seed, basis.size


def find(basis: lp.Basis) -> lp.Basis | None:
    return opening.find_opening(*arguments(basis))


def no_walk(*_: Any) -> None:
    raise AssertionError("all planes are read")


def test_what_is_known_needs_no_planes(kept: lp.Basis, monkeypatch: pytest.MonkeyPatch) -> None:
    opened = find(kept)
    assert opened is not None
    assert isinstance(opened.planes, DeferredPlanes)
    with monkeypatch.context() as patch:
        patch.setattr(DeferredPlanes, "whole", property(no_walk))
        np.testing.assert_array_equal(opened.current_look, kept.current_look)
        np.testing.assert_array_equal(opened.power, kept.power)
        np.testing.assert_array_equal(opened.totals, kept.totals)
        assert array_once(opened.noise, "loudest", no_walk).shape == (N,)
        # One plane is read alone.
        np.testing.assert_array_equal(opened.planes.plane(2), kept.planes.plane(2))
        # Another lighting needs all.
        with pytest.raises(AssertionError, match="all planes are read"):
            opened.mix(2 * opened.current_weights)
    np.testing.assert_array_equal(opened.images, kept.images)
    np.testing.assert_array_equal(opened.half_differences, kept.half_differences)
    assert opened.lights == kept.lights


def test_another_basis_is_not_opened_by_what_was_known(kept: lp.Basis, make_basis: Any) -> None:
    assert basis_cache.keep(make_basis(N, seed=1))
    assert find(kept) is None


def test_a_damaged_file_of_known_walks_is_as_none(kept: lp.Basis) -> None:
    path = basis_cache.companion_path(kept, basis_cache.OPENING_SUFFIX)
    path.write_bytes(path.read_bytes()[:-40])
    assert find(kept) is None


@pytest.mark.parametrize("share", [0.3, 0.5, 0.8])
def test_a_changed_byte_of_known_walks_is_found(kept: lp.Basis, share: float) -> None:
    path = basis_cache.companion_path(kept, basis_cache.OPENING_SUFFIX)
    data = bytearray(path.read_bytes())
    data[int(share * len(data))] ^= 1
    path.write_bytes(data)
    assert find(kept) is None


def test_numpy_reads_the_same_and_what_is_kept_is_not_read_to_keep_it_again(
    kept: lp.Basis, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = basis_cache.companion_path(kept, basis_cache.OPENING_SUFFIX)
    opened = find(kept)
    assert opened is not None
    known = known_arrays(opened.planes)
    assert known
    with np.load(path) as arrays:
        for name, array in known.items():
            np.testing.assert_array_equal(arrays[f"images {name}"], array)
    before, read = path.stat().st_ino, opening._array

    def content_alone(archive: Any, name: str) -> Any:
        assert name == opening.CONTENT
        return read(archive, name)

    monkeypatch.setattr(opening, "_array", content_alone)
    assert opening.keep_opening(opened)
    assert path.stat().st_ino == before
    array_once(opened.planes, "one more", lambda: np.zeros(3))
    assert opening.keep_opening(opened)
    assert path.stat().st_ino != before


def test_damaged_pixels_are_found_by_the_first_walk(kept: lp.Basis) -> None:
    path = basis_cache.file_of(kept)
    assert path is not None
    opened = find(kept)
    assert opened is not None
    data = bytearray(path.read_bytes())
    first_row = int(RowFile(path).parts[0].offsets[0])
    data[first_row + 20] ^= 0xFF
    path.write_bytes(data)
    with pytest.raises((BasisError, ImageError)):
        _ = opened.images


def test_few_lights_are_read_at_once(kept: lp.Basis, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(basis_file, "MIN_LIGHTS", N + 1)
    assert find(kept) is None
    assert not opening.keep_opening(kept)


def test_openings_are_listed_and_deleted_with_their_basis(kept: lp.Basis) -> None:
    [entry] = basis_cache.entries()
    files = [
        file.stat().st_size for file in basis_cache.folder().glob("*.*") if file.suffix != ".TAG"
    ]
    assert entry.size == sum(files)
    assert len(files) == 2
    basis_cache.delete_entries([entry])
    assert not list(basis_cache.folder().glob("*.npz"))


def test_the_name_of_an_array_covers_what_it_depends_on() -> None:
    one, two = np.zeros(3), np.ones(3)
    assert array_name("look", one) == array_name("look", one.copy())
    assert array_name("look", one) != array_name("look", two)
    assert array_name("look", one) != array_name("mix", one)
