"""Lamps whose pools a wish in numbers outlines."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import lightpaint as lp
from lightpaint.colour.color import delta_e, luminance
from lightpaint.lighting.loss import weight_penalty
from lightpaint.lighting.loss.expected_lights import Wash
from lightpaint.lighting.loss.footprints import Footprint, find_footprint, footprint_term
from lightpaint.target.painted_target import Wish

H, W = 36, 64

#: Gains of the lamps that are meant: a spot that is brighter and warmer, all others dim and cool.
MEANT = np.array([[0.3, 0.4, 0.6], [2.6, 2.0, 1.2], [0.3, 0.4, 0.6]])


def room(make_basis: Any) -> lp.Basis:
    """A wash over everything, a spot with a soft pool, and another one that overlaps it."""
    y, x = np.mgrid[:H, :W]
    pools = [np.exp(-((x - c) ** 2 + (y - 18) ** 2) / (2 * 9**2)) for c in (22, 36)]
    images = np.array([0.2 + x / (4 * W), *pools])[..., None] * np.ones(3)
    basis: lp.Basis = make_basis(
        images=images, names=["wash", "spot", "other"], emission=[(0.4, 0.4, 0.4)] * 3
    )
    return basis


def meant_weights(basis: lp.Basis) -> np.ndarray:
    return np.asarray(basis.current_weights * MEANT)


def outshone(basis: lp.Basis) -> np.ndarray:
    """Where the spot gives more than half of the light that is meant, (h, w)."""
    weights = meant_weights(basis)
    spot = luminance(basis.planes.plane(1) * weights[1])
    return np.asarray(spot > 0.5 * luminance(basis.mix(weights)))


def painting(basis: lp.Basis, area: np.ndarray, image: np.ndarray) -> lp.Target:
    areas = area.astype(np.float32), 1 - area.astype(np.float32)
    return lp.Target(
        "painting",
        image.astype(np.float32),
        np.ones((H, W), np.float32),
        everything=False,
        transform=lp.ViewTransform("srgb", 0.0),
        through_view=True,
        over_look=True,
        wishes=tuple(Wish(str(k), x) for k, x in enumerate(areas)),
    )


def flat(basis: lp.Basis, area: np.ndarray) -> lp.Target:
    """The median change of the lighting that is meant, within an area and outside."""
    look, meant = basis.current_look, basis.mix(meant_weights(basis))
    ratio = np.ones((H, W, 3))
    for zone in (area, ~area):
        ratio[zone] = np.median((meant / look)[zone], axis=0)
    return painting(basis, area, look * ratio)


def footprint_of(basis: lp.Basis, target: lp.Target) -> Footprint | None:
    return find_footprint(Wash.of(basis, target), basis.current_weights)


def test_the_lamp_of_a_pool_is_found_with_its_change(make_basis: Any) -> None:
    basis = room(make_basis)
    found = footprint_of(basis, flat(basis, outshone(basis)))
    assert found is not None
    assert found.lamps.tolist() == [False, True, False]
    assert found.confidence == 1
    # Medians come out to some hundredths of a stop, and light next to black counts less.
    np.testing.assert_allclose(
        np.log2(found.emission / basis.current_weights), np.log2(MEANT), atol=0.1
    )


def test_an_answer_is_nearer_to_what_was_meant(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    basis = room(make_basis)
    target, meant = flat(basis, outshone(basis)), basis.mix(meant_weights(basis))

    def missed() -> float:
        return float(delta_e(basis.mix(lp.solve(basis, target).weights), meant).mean())

    with_footprint = missed()
    monkeypatch.setattr(weight_penalty, "find_footprint", lambda *_: None)
    assert with_footprint < 0.7 * missed()


def test_a_brush_that_paints_the_pool_itself_outlines_none(make_basis: Any) -> None:
    basis = room(make_basis)
    target = painting(basis, outshone(basis), basis.mix(meant_weights(basis)))
    assert footprint_of(basis, target) is None


def test_outlines_that_are_found_in_a_painting_are_none(make_basis: Any) -> None:
    basis = room(make_basis)
    target = replace(flat(basis, outshone(basis)), wishes=())
    assert footprint_of(basis, target) is None


@pytest.mark.parametrize("kind", ["stripes", "one wish"])
def test_an_outline_that_no_lamp_follows_has_none(make_basis: Any, kind: str) -> None:
    basis = room(make_basis)
    area = np.zeros((H, W), bool)
    area[:, ::4] = area[:, 1::4] = True
    look = basis.current_look
    if kind == "one wish":
        area[:] = True
    target = painting(basis, area, look * np.where(area, 2.0, 0.5)[..., None])
    assert footprint_of(basis, target) is None


def test_the_term_is_zero_at_its_own_picture(make_basis: Any) -> None:
    basis = room(make_basis)
    target = flat(basis, outshone(basis))
    wash = Wash.of(basis, target)
    found = find_footprint(wash, basis.current_weights)
    assert found is not None
    term = footprint_term(wash, found, target.transform, 7.0)
    scale = term.target_norm2.max()
    assert abs(term.objective(found.emission)).max() < 1e-12 * scale  # float64
    assert term.objective(basis.current_weights).min() > 1e-3 * scale
