"""Texels that are split again: hats that are never negative and sum to one, and their names."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpaint.scene.lights.texels.image_domains import Sky
from lightpaint.scene.lights.texels.texel import (
    CHILDREN,
    MAX_LEVEL,
    TexelLayout,
    coarse_name,
    image_of,
    images_of,
    layouts_of,
    node_name,
)


@st.composite
def layouts(draw: st.DrawFn) -> TexelLayout:
    """Layouts of which up to four texels are split, some of them again."""
    layout = TexelLayout(draw(st.tuples(st.integers(3, 8), st.integers(3, 6))))
    for _ in range(draw(st.integers(0, 4))):
        # Among the finest ones if there are any, so that these are split again.
        nodes = [x for x in layout.nodes if x[0] < MAX_LEVEL - 1]
        node = nodes[draw(st.integers(len(nodes) // 2, len(nodes) - 1))]
        layout = layout.split_again(node)
    return layout


def hats(layout: TexelLayout) -> np.ndarray:
    """Return the hat of each texel, (rows, columns, nodes) of the finest grid."""
    return layout.image(np.eye(len(layout.nodes)))


@given(layouts())
def test_hats_are_never_negative_and_sum_to_one(layout: TexelLayout) -> None:
    of_each = hats(layout)
    assert of_each.min() >= -1e-12
    np.testing.assert_allclose(of_each.sum(axis=2), 1, atol=1e-12)
    np.testing.assert_allclose(of_each.max(axis=(0, 1)), 1, atol=1e-12)  # at its own place


@given(layouts(), st.integers(0, 100))
def test_finer_texels_show_a_coarse_image_unchanged(layout: TexelLayout, seed: int) -> None:
    columns, rows = layout.size
    coarse = np.random.default_rng(seed).random((rows, columns, 3))
    shown = layout.image(layout.values(coarse))
    np.testing.assert_allclose(shown, Sky().interpolated(coarse, layout.finest), atol=1e-12)


@given(layouts(), st.integers(0, 100))
def test_sums_are_those_under_the_hats(layout: TexelLayout, seed: int) -> None:
    columns, rows = layout.finest
    pixels = np.random.default_rng(seed).random((rows, columns))
    expected = np.einsum("hw,hwn->n", pixels, hats(layout))
    np.testing.assert_allclose(layout.sums(pixels), expected, rtol=1e-10)


@given(layouts())
def test_names_tell_the_layout(layout: TexelLayout) -> None:
    names = [node_name("a.sky", node) for node in layout.nodes]
    assert layouts_of(names) == {"a.sky": layout}
    assert images_of(names) == {"a.sky": layout.size}
    assert {image_of(name) for name in names} == {"a.sky"}
    if layout.splits:
        assert layouts_of(names[:-1]) == {}


@given(layouts())
def test_the_texels_that_finer_ones_change_are_known(layout: TexelLayout) -> None:
    of_each, columns = hats(layout), layout.finest[0]
    for k, node in enumerate(layout.nodes):
        if node[0] == 0 and node not in layout.finer_under:
            plain = np.zeros((layout.size[1], layout.size[0], 1))
            plain[node[2], node[1]] = 1
            whole = Sky().interpolated(plain, layout.finest)[..., 0]
            np.testing.assert_allclose(of_each[..., k], whole, atol=1e-12)
    assert columns >= layout.size[0]


def test_a_split_texel_is_replaced_by_all_in_its_place() -> None:
    layout = TexelLayout((8, 5)).split_again((0, 2, 2))
    assert len(layout.nodes) == 40 - 1 + CHILDREN
    assert (0, 2, 2) not in layout.number_of
    assert layout.texel_at((0, 2, 2)) == (1, 7, 6)
    assert layout.finest == (24, 13)
    deeper = layout.split_again((1, 7, 6))
    assert deeper.texel_at((0, 2, 2)) == (2, 22, 18)
    # At a pole there are only those below.
    assert len(TexelLayout((8, 5)).split_again((0, 0, 0)).nodes) == 40 - 1 + 15


@pytest.mark.parametrize(
    ("name", "coarse"),
    [
        ("sky.sun1.x7.y6", "sky.x2.y2"),
        ("sky.sun1.x9.y8", "sky.x3.y3"),
        ("sky.sun2.x22.y18", "sky.x2.y2"),
        ("sky.x2.y2", "sky.x2.y2"),
        ("bulb", ""),
    ],
)
def test_a_finer_texel_is_in_the_place_of_a_coarse_one(name: str, coarse: str) -> None:
    assert coarse_name(name) == coarse
