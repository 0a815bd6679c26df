"""The page shows the pictures of lightings that the session mixes: drafts, and then exact ones."""

from typing import Any

import pytest

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
  const draft = (value) => ({ halves: Uint16Array.of(value, value, value), step: 2 });
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
    assert planes == [[0, [0x3C00] * 3, 2]]
    assert light == [1.0] * 12
    # After a pause the exact picture is.
    assert [message["is_live"] for message in sent] == [False]


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
