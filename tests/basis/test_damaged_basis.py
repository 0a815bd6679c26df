"""A basis that was damaged, or that another program has opened and saved: read right or refused."""

import json
import random
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from damaged_files import Case, damage, flip_bit, outcomes, read_despite_cut, wrong_outcomes
from nightly import FIFTHS, fifth_of

from lightpaint.basis.cache import basis_cache
from lightpaint.basis.file.basis_file import (
    ORIGIN_KEY,
    as_stored,
    read_basis,
    read_origin,
    write_basis,
)
from lightpaint.basis.file.file_parts import CHECKSUMS_KEY, LIGHT_KEY
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.lightgroups.light_groups import read_light_groups
from lightpaint.basis.lightgroups.render_layers import MAX_FILES, is_light_groups
from lightpaint.errors import BasisError, ImageError
from lightpaint.images.formats.exr import ExrPart, read_parts, write_parts, write_rgb

SIZE = (6, 5)


@pytest.fixture
def basis(make_basis: Any) -> Basis:
    source = make_basis(3, SIZE, names=["key", "fill", "rim"], seen=np.eye(*SIZE, dtype=bool))
    halves = np.random.default_rng(1).normal(size=source.images.shape).astype(np.float32)
    return as_stored(replace(source, noise=halves, guide_table=np.ones((2, 4, 3), np.float32)))


@pytest.fixture
def path(tmp_path: Path, basis: Basis) -> Path:
    write_basis(tmp_path / "a.basis.exr", basis)
    return tmp_path / "a.basis.exr"


def _cases(content: bytes, name: str) -> Iterator[Case]:
    """Cut and turned everywhere, and with numbers that lie in all of the header."""
    yield from damage(name, content, 1, 300, 300)
    head = content.rfind(b"lightpaint") + 600
    rng = random.Random(2)
    for _ in range(300):
        position, bit = rng.randrange(min(head, len(content))), rng.randrange(8)
        yield Case(name, f"bit {bit} of byte {position}", flip_bit(content, position, bit))


@pytest.mark.parametrize("fifth", FIFTHS)
def test_damage_of_bytes(path: Path, tmp_path: Path, fifth: int) -> None:
    content = path.read_bytes()
    cases = fifth_of(_cases(content, path.name), fifth)
    results = outcomes("basis", {path.name: content}, cases, tmp_path)
    # With checksums nothing but what was written is ever read.
    assert wrong_outcomes(results, ("same", "refused")) == []
    assert len(results) > 200
    assert sum(outcome == "same" for _, outcome in results) > 2


@pytest.mark.parametrize("fifth", FIFTHS)
def test_damage_of_light_groups(tmp_path: Path, fifth: int) -> None:
    rng = np.random.default_rng(0)
    channels = {
        f"{layer}.{c}": rng.random((8, 8)).astype(np.float32)
        for layer in ("Combined_key", "Combined_fill")
        for c in "RGB"
    }
    write_parts(tmp_path / "a.exr", [ExrPart("ViewLayer", channels)])
    content = (tmp_path / "a.exr").read_bytes()
    cases = fifth_of(damage("a.exr", content, 3, 150, 150), fifth)
    results = outcomes("groups", {"a.exr": content}, cases, tmp_path)
    assert wrong_outcomes(results) == []
    assert read_despite_cut(results) == []


def _edit(name: str) -> Callable[[list[ExrPart]], list[ExrPart]]:
    def edit(parts: list[ExrPart]) -> list[ExrPart]:
        if name == "one dropped":
            return [parts[0], *parts[2:]]
        if name == "one twice":
            return [*parts, replace(parts[1], name="again")]
        if name == "a pixel":
            red = parts[1].channels["R"].copy()
            red[2, 3] *= 1.001
            return [
                parts[0],
                replace(parts[1], channels={**parts[1].channels, "R": red}),
                *parts[2:],
            ]
        if name == "exchanged":
            one, two = parts[1], parts[2]
            return [
                parts[0],
                replace(one, channels=two.channels),
                replace(two, channels=one.channels),
                *parts[3:],
            ]
        if name == "float":
            return [
                replace(p, channels={k: c.astype(np.float32) for k, c in p.channels.items()})
                for p in parts
            ]
        if name == "smaller":
            return [
                replace(p, channels={k: c[::2, ::2] for k, c in p.channels.items()}, display=None)
                for p in parts[:4]
            ]
        if name == "one smaller":
            small = {k: c[:1, :1] for k, c in parts[1].channels.items()}
            return [parts[0], replace(parts[1], channels=small), *parts[2:]]
        if name == "no attributes":
            return [replace(p, attributes={}) for p in parts]
        assert name == "mask"
        return [
            *parts[:3],
            replace(parts[3], channels={"Y": parts[3].channels["Y"] * 0}),
            *parts[4:],
        ]

    return edit


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("one dropped", "lost the light 'fill'"),
        ("one twice", "'fill' more than once"),
        ("a pixel", "changed light 'fill'"),
        ("exchanged", "changed light 'fill'"),
        ("float", "changed light 'key'"),
        ("smaller", "changed light 'key'"),
        ("one smaller", "changed light 'fill'"),
        ("no attributes", "is not a basis"),
        ("mask", "changed mask of seen emitters"),
    ],
)
def test_what_another_program_changed(path: Path, name: str, words: str) -> None:
    write_parts(path, _edit(name)(read_parts(path)))
    with pytest.raises((BasisError, ImageError), match=words) as refusal:
        read_basis(path)
    assert str(path) in str(refusal.value)


def test_parts_in_another_order_are_the_same_basis(path: Path, basis: Basis) -> None:
    # The table has a data window of its own, which reading and writing again keeps.
    parts = read_parts(path)
    write_parts(path, [replace(p, display=SIZE) for p in parts[::-1]])
    reread = read_basis(path)
    assert reread.lights == basis.lights
    assert reread.images.tobytes() == basis.images.tobytes()
    assert read_origin(path) == (basis.origin, SIZE, ("",) * 3)


def test_a_table_that_is_not_as_it_was_is_left_out(path: Path, basis: Basis) -> None:
    parts = read_parts(path)
    table = {k: c * 2 for k, c in parts[-1].channels.items()}
    write_parts(path, [*parts[:-1], replace(parts[-1], channels=table)])
    reread = read_basis(path)
    assert reread.guide_table is None
    assert reread.images.tobytes() == basis.images.tobytes()


@pytest.mark.parametrize(
    ("key", "changes"),
    [
        (ORIGIN_KEY, {"halves": [0, -1]}),
        (ORIGIN_KEY, {"halves": [1e400, 1]}),
        (ORIGIN_KEY, {"halves": "12"}),
        (ORIGIN_KEY, {"passes": [1, 2, 3]}),
        (ORIGIN_KEY, {"seed": True}),
        (ORIGIN_KEY, {"scene": 7}),
        (ORIGIN_KEY, {"each_light": [[1, 2, 3, -4]] * 3}),
        (ORIGIN_KEY, {"each_light": [[1, 1, 1, 1]]}),
        (LIGHT_KEY, {"emission": [float("nan"), 1, 1]}),
        (LIGHT_KEY, {"emission": [-1, 1, 1]}),
        (LIGHT_KEY, {"emission": "123"}),
        (LIGHT_KEY, {"name": "x" * 10_000_000}),
        (LIGHT_KEY, {"name": "fill"}),
        (LIGHT_KEY, {"name": "\ud800"}),
        (LIGHT_KEY, {"plugin": 3}),
        (LIGHT_KEY, {"is_fixed": "yes"}),
        (LIGHT_KEY, {"members": [1]}),
        (CHECKSUMS_KEY, {"lights": []}),
        (CHECKSUMS_KEY, {"seen": None}),
        (CHECKSUMS_KEY, {"more": ""}),
        (CHECKSUMS_KEY, {"origin": "00000000"}),
    ],
)
def test_hostile_headers(path: Path, key: str, changes: dict[str, Any]) -> None:
    parts = read_parts(path)
    data = json.loads(parts[0].attributes[key]) | changes
    attributes = {**parts[0].attributes, key: json.dumps(data)}
    if key != CHECKSUMS_KEY:
        del attributes[CHECKSUMS_KEY]  # which would notice anyway
    write_parts(path, [replace(parts[0], attributes=attributes), *parts[1:]])
    with pytest.raises(BasisError) as refusal:
        read_basis(path)
    assert str(path) in str(refusal.value)
    assert len(str(refusal.value)) < 1000


def test_a_basis_in_the_place_of_another_is_not_taken(
    tmp_path: Path, basis: Basis, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path))
    origin = basis.origin
    assert basis_cache.keep(basis)
    request = (origin.scene_identity, origin.sensor, origin.seed, SIZE)
    assert basis_cache.find(*request) is not None
    (basis_file,) = tmp_path.glob("*.basis.exr")
    other = basis_cache.path_for("another", *request[1:])
    basis_file.rename(other)
    assert basis_cache.find("another", *request[1:]) is None
    other.unlink()
    (tmp_path / f"{'0a' * 16}.basis.exr").symlink_to("nowhere")
    assert basis_cache.entries() == []


def test_a_folder_of_very_many_files(tmp_path: Path) -> None:
    write_rgb(tmp_path / "0.exr", np.ones((2, 2, 3)))
    for k in range(MAX_FILES):
        (tmp_path / f"frame.{k}.exr").touch()
    assert is_light_groups(tmp_path)
    with pytest.raises(BasisError, match="a sequence of frames"):
        read_light_groups(tmp_path)
