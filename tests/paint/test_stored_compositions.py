"""A session file keeps what its layers come to, and nobody reads it once it is stale."""

import sqlite3
import zlib
from contextlib import closing
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from layered_sessions import RandomEditor, bases_of, identity_of, open_session

from lightpaint.errors import PaintError
from lightpaint.paint import protocol
from lightpaint.paint.layers.composed_layers import accent
from lightpaint.paint.layers.composition import compose_layer
from lightpaint.paint.layers.layer_stack import Layer
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.store.compression import ZEROS_LENGTH, pack, pack_patches, unpack_patches
from lightpaint.paint.store.history_steps import Patch, Pixels
from lightpaint.paint.store.session_file import (
    COMPOSITION_VERSION,
    Store,
    StoredComposition,
    _digest,
)


def keep(session: Session) -> None:
    """Let the file keep the compositions, as while the brush rests."""
    if (compositions := session.compositions()) is not None:
        session.store.put_compositions(*compositions)


def made(path: Path, seed: int, *, acts: int = 8, further: int = 0) -> None:
    """A session file with compositions, and steps after these."""
    with Store.open(path, identity_of()) as store:
        hand = RandomEditor(seed, store)
        for _ in range(acts):
            hand.act()
        keep(hand.session)
        for _ in range(further):
            hand.act()


def execute(path: Path, *statement: Any) -> None:
    with closing(sqlite3.connect(path)) as database, database:
        database.execute(*statement)


def loaded(session: Session) -> list[bool]:
    """Of each layer in each view, whether its pixels were read."""
    return [v.layer(n).is_loaded for v in session.views for n in session.views.layers.ids]


@pytest.mark.nightly
@settings(max_examples=3, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 10**6), further=st.integers(0, 3))
def test_what_is_opened_from_compositions_goes_on_as_what_is_built_afresh(
    tmp_path: Path, seed: int, further: int
) -> None:
    path, plain = tmp_path / "kept.db", tmp_path / "plain.db"
    for file in tmp_path.iterdir():
        file.unlink()
    made(path, seed, further=further)
    plain.write_bytes(path.read_bytes())
    execute(plain, "DROP TABLE IF EXISTS composition")
    with Store.open(path, identity_of()) as store, Store.open(plain, identity_of()) as other:
        kept, afresh = RandomEditor(seed, store), RandomEditor(seed, other)
        assert kept.state() == afresh.state()
        assert kept.session.views.next_layer == afresh.session.views.next_layer
        for _ in range(store.position):
            for hand in (kept, afresh):
                hand.session.handle(protocol.Undo(), {})
            assert kept.state() == afresh.state()
            keep(kept.session)
        with patch.object(kept.session, "compositions", lambda: None):
            for _ in range(6):
                kept.act()
                afresh.act()
                assert kept.state() == afresh.state()
    with Store.open(path, identity_of()) as store:  # of an undone state, or of one before it
        assert afresh.state(open_session(store)) == afresh.state()


def three_layers(path: Path) -> Any:
    """A session of paint below an adjustment of all, and a stroke on top; its state."""
    with Store.open(path, identity_of(1)) as store:
        hand = RandomEditor(3, store, views=1)
        hand.paint(Layer(1, "paint"))
        properties = Layer(2, "adjust", gain=2.0)
        arrays = {"importance": np.ones((12, 70), np.float32)}
        hand.session.handle(
            protocol.Paint(9, (0, 12, 0, 70), True, layer=2, properties=properties), arrays
        )
        hand.strokes = 9
        hand.paint(Layer(3, "paint"))
        keep(hand.session)
        return hand.state()


def test_pixels_of_layers_are_read_when_they_are_needed(tmp_path: Path) -> None:
    path = tmp_path / "kept.db"
    state = three_layers(path)
    with Store.open(path, identity_of(1)) as store:
        hand = RandomEditor(0, store, views=1)
        assert hand.state() == state
        assert loaded(hand.session) == [False] * 4
        hand.change(layers=(Layer(2, "adjust", "named", gain=2.0),))
        assert loaded(hand.session) == [False] * 4  # a name moves no pixel
        hand.session.handle(protocol.Undo(), {})
        hand.change(layers=(Layer(3, "paint", is_visible=False),))
        assert loaded(hand.session) == [False, True, True, False]
        hand.session.handle(protocol.Undo(), {})
        assert hand.state() == state


def test_stale_and_damaged_compositions_are_not_used(tmp_path: Path) -> None:
    path = tmp_path / "kept.db"
    state = three_layers(path)
    content = path.read_bytes()
    looks = [basis.current_look for basis in bases_of(1)]
    with Store.open(path, identity_of(1)) as store:
        assert store.compositions(looks) is not None
        assert store.compositions([2 * looks[0]]) is None
        assert store.compositions([*looks, *looks]) is None
        with patch("lightpaint.paint.store.session_file.COMPOSITION_VERSION", 0):
            assert store.compositions(looks) is None
    for change in (
        "UPDATE composition SET step = step + 1",
        "UPDATE composition SET step = step - 1",
        "UPDATE composition SET about = replace(about, '0', '1')",
        "UPDATE composition SET pixels = substr(pixels, 1, 80) || x'00' || substr(pixels, 82)",
        "UPDATE composition SET pixels = NULL",
        "UPDATE composition SET digest = x'00'",
        "ALTER TABLE composition RENAME COLUMN about TO other",
    ):
        path.write_bytes(content)
        execute(path, change)
        with Store.open(path, identity_of(1)) as store:
            assert store.compositions(looks) is None, change
            hand = RandomEditor(0, store, views=1)
            assert hand.state() == state
            keep(hand.session)  # in the place of the wrong one, where the table can hold it


def test_undone_steps_take_their_compositions_along(tmp_path: Path) -> None:
    path = tmp_path / "kept.db"
    three_layers(path)
    with Store.open(path, identity_of(1)) as store:
        hand = RandomEditor(0, store, views=1)
        hand.session.handle(protocol.Undo(), {})
        state = hand.state()
    with Store.open(path, identity_of(1)) as store:  # the file was not told
        looks = [basis.current_look for basis in bases_of(1)]
        assert store.compositions(looks) is None
        assert RandomEditor(0, store, views=1).state() == state


def test_a_composition_that_its_layers_contradict_is_composed_again(tmp_path: Path) -> None:
    path = tmp_path / "kept.db"
    state = three_layers(path)
    with Store.open(path, identity_of(1)) as store:
        hand = RandomEditor(0, store, views=1)
        [stored] = (hand.session.compositions() or (0, [], []))[2]
        image = np.zeros_like(stored.pixels.image)
        wrong = StoredComposition(
            {**stored.layers, 3: ((0, 12, 0, 64), 0.5, 0.0)}, stored.pixels._replace(image=image)
        )
        looks = [basis.current_look for basis in bases_of(1)]
        store.put_compositions(store.last_id, looks, [wrong])
    with Store.open(path, identity_of(1)) as store:
        hand = RandomEditor(0, store, views=1)
        assert hand.state() != state
        hand.change(layers=(Layer(3, "paint", is_visible=False),))
        hand.session.handle(protocol.Undo(), {})
        assert hand.state() == state


def test_pixels_that_turn_out_to_be_damaged_are_named_and_the_rest_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "kept.db"
    three_layers(path)
    execute(path, "UPDATE pixels SET before = x'00' WHERE step = 1")
    with Store.open(path, identity_of(1)) as store:
        hand = RandomEditor(0, store, views=1)
        hide = protocol.ChangeLayers(layers=(Layer(3, "paint", is_visible=False),))
        with pytest.raises(PaintError, match=r"was damaged: 1 step could not be read"):
            hand.session.handle(hide, {})
        state = hand.state()
        assert hand.session.views.layers.ids == (0, 2, 3)
        hand.session.handle(hide, {})
        hand.session.handle(protocol.Undo(), {})
        assert hand.state() == state
        assert hand.state(open_session(store, 1)) == state


def test_other_bits_of_a_composition_need_another_version() -> None:
    """Compare a composition with its digest: other bits need another COMPOSITION_VERSION."""
    rng = np.random.default_rng(0)  # without libraries whose last bits differ between machines
    target = Pixels.unpainted(rng.random((40, 30, 3), np.float32))
    for layer in (
        *(Layer(1, "paint"), Layer(2, "adjust", gain=4.0, tint=(1.1, 1.0, 0.9))),
        *(Layer(3, "weigh", times=3.0), Layer(4, "pixels", strength=0.5)),
        *(Layer(5, "adjust", gain=0.5, strength=2.0), Layer(6, "paint", strength=0.25)),
    ):
        mask = np.maximum(rng.random((40, 30), np.float32) - np.float32(0.3), 0)
        pixels = Pixels(2 * rng.random((40, 30, 3), np.float32), mask)
        target = compose_layer(layer, pixels, target, accent(0.05 * layer.id))
    digest = _digest(target.image.data, target.importance.data).hex()
    assert digest == "6daa597fe1c54c7e9b591f816f000d6f"
    assert COMPOSITION_VERSION == 1


def test_zeros_of_masks_are_packed_as_other_numbers_are() -> None:
    """Though they are never made: the streams say the same, and `unpack` reads them."""
    rng, shape = np.random.default_rng(2), (600, 700)
    assert ZEROS_LENGTH < 3 * 600 * 700
    coverage = rng.random(shape, np.float32)
    black = np.broadcast_to(np.float32(0), (*shape, 3))
    empty = Pixels.unpainted(np.zeros((*shape, 3), np.float32))
    patches = [
        Patch((0, 600, 0, 700), empty, Pixels(black, coverage), 0, 3),
        Patch((5, 7, 0, 2), Pixels(black[:2, :2], coverage[:2, :2]), empty.part((0, 2, 0, 2))),
    ]
    before, change = pack_patches(patches)
    places = [(entry.region, False) for entry in patches]
    pairs = unpack_patches(places, before, change)
    for entry, (first, last) in zip(patches, pairs, strict=True):
        assert first.equals(entry.before)
        assert last.equals(entry.after)
    numbers = [np.r_[np.zeros(3 * 600 * 700), coverage.ravel()], coverage[:2, :2].ravel()]
    plain = np.concatenate([numbers[0], np.zeros(12), numbers[1]]).astype(np.float32)
    assert zlib.decompress(change) == zlib.decompress(pack(plain))
