"""The page shows the pictures of lightings that the session mixes: drafts, and then exact ones."""

from typing import Any

import numpy as np
import pytest

from lightpaint.images import resampled

#: Mixes over a host that keeps what it is sent, and a view that keeps what it is given.
MIXES = """
  const { SessionMixes, SOLUTION_SLOT } = await import('/engine/session_mixes.js');
  const sent = [], planes = [];
  const host = {
    on: () => {},
    send: (kind, fields) => { sent.push({ kind, ...fields }); return new Promise(() => {}); },
  };
  const view = {
    setPlane: (index, halves, scale, step) => planes.push([index, [...halves], step]),
  };
  const screen = { view, count: 9, planeSize: [2, 2], size: [2, 2], requestDraw: () => {},
    isBrushDown: false, draftStep: null };
  const mixes = new SessionMixes(host, screen);
  const weights = (x) => Float64Array.of(x, x, x);
  const mixed = (number, value, isExact = false) => mixes.take({ view: 0, slot: 0, number, step: 1,
    is_exact: isExact, arrays: { data: { data: new Uint16Array(12).fill(value) } } });
  mixes.setDetail(new Uint16Array(12).fill(0x3c00));
  const draft = (value) => ({ halves: Uint16Array.of(value, value, value), size: [1, 1] });
"""


def run(page: Any, script: str) -> Any:
    return page.evaluate(f"async () => {{ {MIXES} {script} }}")


def test_a_draft_that_comes_with_the_weights_is_not_asked_for(page: Any) -> None:
    sent, planes, light = run(
        page,
        """
        mixes.show(SOLUTION_SLOT, weights(1), draft(0x3c00));
        while (!sent.length) await new Promise((done) => setTimeout(done, 20));
        return [sent, planes, [...mixes.lightOf(SOLUTION_SLOT)]];
        """,
    )
    assert planes == [[0, [0x3C00] * 12, 1]]
    assert light == [1.0] * 12
    # After a pause the exact picture is.
    assert [message["is_live"] for message in sent] == [False]


def test_a_draft_without_details_is_asked_for(page: Any) -> None:
    """As after another view has been chosen, while an answer was on its way."""
    sent, planes = run(
        page,
        """
        mixes.setDetail(null);
        mixes.show(SOLUTION_SLOT, weights(1), draft(0x3c00));
        return [sent, planes];
        """,
    )
    assert planes == []
    assert [message["is_live"] for message in sent] == [True]


@pytest.mark.parametrize(("size", "step"), [((13, 18), 2), ((12, 20), 1)])
def test_a_small_picture_gets_the_details_of_the_look_back(
    page: Any, size: tuple[int, int], step: int
) -> None:
    """As the session makes drafts: Pillow interpolates, and the page has halves of eleven bits."""
    rng, blocks = np.random.default_rng(0), (3, 5)
    detail = rng.uniform(0, 4, (*size, 3)).astype(np.float16)
    small = (rng.uniform(0, 1, (*blocks, 3)) ** 4 * 100).astype(np.float16)
    small[0, 0], small[2, 4] = 0, 3e4  # black, and more than halves hold
    halves = page.evaluate(
        """async ([detail, size, step, small, blocks]) => {
            const { DraftDetail } = await import('/engine/draft_detail.js');
            const halves = Uint16Array.from(small);
            const whole = new DraftDetail(Uint16Array.from(detail), size, step);
            return [...whole.enlarge({ halves, size: blocks })];
        }""",
        [bits(detail), size, step, bits(small), blocks],
    )
    draft = np.array(halves, np.uint16).view(np.float16).reshape(detail[::step, ::step].shape)
    whole = resampled(small.astype(np.float32), size) * detail.astype(np.float32)
    expected = np.minimum(whole[::step, ::step], np.finfo(np.float16).max)
    # Below the least normal half they are multiples of 2^-24.
    np.testing.assert_allclose(draft.astype(np.float32), expected, rtol=2.0**-10, atol=2.0**-24)


def bits(halves: Any) -> list[int]:
    return np.ravel(halves).view(np.uint16).tolist()


@pytest.mark.parametrize("is_exact", [False, True])
def test_no_picture_follows_that_of_a_later_lighting(page: Any, is_exact: bool) -> None:
    planes = run(
        page,
        f"""
        mixes.show(SOLUTION_SLOT, weights(1));
        mixes.show(SOLUTION_SLOT, weights(2), draft(7));
        mixed(1, 5, {str(is_exact).lower()});
        mixed(2, 9, {str(is_exact).lower()});
        return planes.map(([, halves]) => halves[0]);
        """,
    )
    assert planes == [7, 9]


def test_a_draft_of_a_moment_ago_is_better_than_none(page: Any) -> None:
    planes = run(
        page,
        """
        mixes.show(SOLUTION_SLOT, weights(1));
        mixes.show(SOLUTION_SLOT, weights(2));
        mixed(1, 5);
        mixed(1, 6, true);
        return planes.map(([, halves]) => halves[0]);
        """,
    )
    assert planes == [5]
