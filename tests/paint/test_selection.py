"""A selection is a step of the session, and keeps its mask to the bit."""

from functools import partial
from typing import Any

import numpy as np
import pytest
from layered_sessions import SIZES, RandomEditor, open_session

from lightpaint.errors import PaintError
from lightpaint.paint import protocol
from lightpaint.paint.layers.layer_pixels import selection_mask
from lightpaint.paint.session.picture_table import PictureTable
from lightpaint.paint.session.session_state import offer_layers
from lightpaint.paint.store.history_steps import Region

H, W = SIZES[0]


def select(hand: RandomEditor, region: Region, mask: Any, view: int = 0) -> Any:
    request = protocol.Select(region, "ellipse", view=view)
    return hand.session.handle(request, {"mask": np.asarray(mask, np.uint8)})[0]


def test_a_mask_is_fetched_as_it_was_sent_and_changes_no_light() -> None:
    hand = RandomEditor(0)
    version, pixels = hand.session.version, hand.pixels()
    mask = np.random.default_rng(0).integers(0, 256, (5, 60), np.uint8)
    answer = select(hand, (2, 7, 8, 68), mask)
    assert answer.kind == "selected"
    assert answer.history.undo == ("ellipse, view 0",)
    assert (hand.session.version, hand.pixels()) == (version, pixels)
    table = PictureTable()
    offer_layers(table, hand.session.views)
    top, bottom, left, right = answer.selection.regions[0]
    picture = table["selection/0"]
    assert picture.dtype == np.uint8
    assert picture.shape == (bottom - top, right - left)
    np.testing.assert_array_equal(picture[2 - top : 7 - top, 8 - left : 68 - left], mask)
    assert picture.sum() == mask.sum()
    assert table["selection/1"].size == 0
    # The same once more is not a step, and a part replaces it.
    assert select(hand, (2, 7, 8, 68), mask).selection.revision == answer.selection.revision
    select(hand, (3, 4, 9, 10), [[7]])
    select(hand, (0, 3, 0, 8), np.full((3, 8), 255), view=1)
    assert [step.kind for step in hand.session.store.steps] == ["selection"] * 3
    masks = partial(map, lambda view: int(selection_mask(view.selection).sum()))
    assert [*masks(open_session(hand.session.store).views)] == [7, 24 * 255]
    for total in ([7, 0], [int(mask.sum()), 0], [0, 0]):
        hand.session.handle(protocol.Undo(), {})
        assert [*masks(hand.session.views)] == total


@pytest.mark.parametrize(
    ("region", "arrays", "text"),
    [
        ((0, H + 1, 0, 2), {}, r"a selection at \[0, 13, 0, 2\], and the picture is 70x12"),
        ((0, 2, 0, 2), {}, "is none: expected bytes"),
        ((0, 2, 0, 2), {"mask": np.zeros((2, 3), np.uint8)}, r"is uint8 \[2, 3\]"),
        ((0, 2, 0, 2), {"mask": np.zeros((2, 2), np.float32)}, r"is float32 \[2, 2\]"),
    ],
)
def test_what_is_no_mask_is_refused(region: Region, arrays: Any, text: str) -> None:
    hand = RandomEditor(0)
    with pytest.raises(PaintError, match=text):
        hand.session.handle(protocol.Select(region), arrays)
    assert not hand.session.store.steps


def test_an_open_stroke_is_kept_before_a_selection() -> None:
    hand = RandomEditor(0)
    hand.paint(hand.session.views.layers[0], is_final=False)
    painted = hand.pixels()
    select(hand, (0, 1, 0, 1), [[255]])
    assert [step.kind for step in hand.session.store.steps] == ["stroke", "selection"]
    assert hand.pixels() == painted
