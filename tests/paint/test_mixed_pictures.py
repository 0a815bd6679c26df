"""Pictures that a session mixes for pages, of lights too many for a page to hold their planes."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from studio_client import StudioClient

import lightpaint as lp
from lightpaint.colour import ACESCG
from lightpaint.errors import PaintError
from lightpaint.images import resampled
from lightpaint.lighting.live.live_sums import DRAFTS_PER_SUM, SmallFilm
from lightpaint.paint import protocol
from lightpaint.paint.session import picture_table
from lightpaint.paint.session.picture_table import FLOOR

H, W, N, BLOCK = 24, 36, 5, 4

#: Pixels of the small picture that follows the brush.
BLOCKS = (H // BLOCK) * (W // BLOCK)


@pytest.fixture
def basis(make_basis: Any) -> lp.Basis:
    """Lights that are even in each block of a textured wall, so that drafts have no shadow to
    miss.
    """
    rng = np.random.default_rng(4)
    even = np.ones((BLOCK, BLOCK, 1))
    lights = np.kron(rng.uniform(0.2, 1, (N, H // BLOCK, W // BLOCK, 3)), even)
    texture = np.tile(rng.uniform(0.5, 1, (BLOCK, BLOCK, 1)), (H // BLOCK, W // BLOCK, 1))
    images = lights * texture
    return make_basis(  # type: ignore[no-any-return]
        images=images, half_differences=0 * images, emission=[[0.5, 0.5, 0.5]] * N
    )


@pytest.fixture
def client(
    basis: lp.Basis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, without_reasons: None
) -> Any:
    monkeypatch.setattr(picture_table, "MIN_MIXED_LIGHTS", N)
    monkeypatch.setattr(picture_table, "MAX_OPENING_VALUES", 0)
    monkeypatch.setattr("lightpaint.lighting.live.live_solver.MAX_FILM_PIXELS", BLOCKS)
    # Without the denoiser's own errors, which the picture of now has.
    clean_look = "lightpaint.paint.studio.session_bases._clean_look"
    monkeypatch.setattr(clean_look, lambda one: one.current_look)
    studio_client = StudioClient(tmp_path, basis)
    yield studio_client
    studio_client.studio.close()


def mixed(client: StudioClient, weights: Any, **fields: Any) -> protocol.MixedPicture:
    request = protocol.MixLights(**{"slot": 0, "number": 7, **fields})
    [answer] = client.studio.handle(request, {"weights": weights})
    assert isinstance(answer, protocol.MixedPicture)
    assert (answer.slot, answer.number, answer.is_exact) == (request.slot, request.number, False)
    return answer


def test_a_page_is_told_of_mixes_and_no_plane_is_denoised(client: StudioClient) -> None:
    [view] = client.studio.state().fields["views"]
    assert view["has_mixes"]
    assert tuple(view["plane_size"]) == (H, W)
    client.wait(lambda m: m.kind == "progress" and m.fields["task"] == "basis")
    names = client.studio.publisher.pictures.generations
    assert "plane/0" in names
    assert not any(name.startswith("clean/") for name in names)


def test_few_lights_have_their_planes_in_the_page(basis: lp.Basis) -> None:
    assert not picture_table.has_mixes(basis)


def test_lights_that_a_renderer_multiplies_in_its_own_primaries_are_mixed(
    make_basis: Any, tmp_path: Path, without_reasons: None
) -> None:
    plain = make_basis(3, size=(H, W))
    basis = replace(plain, origin=replace(plain.origin, primaries=ACESCG))
    client = StudioClient(tmp_path, basis)
    weights = np.array([[2.0, 0.5, 0.1], [0.1, 1.0, 2.0], [0.5, 0.5, 0.5]])
    try:
        assert client.studio.state().fields["views"][0]["has_mixes"]
        mixed(client, weights, is_clean=False)
        exact = client.wait(lambda m: m.kind == "mixed" and m.is_exact).data.astype(np.float32)
        # Halves have eleven bits.
        np.testing.assert_allclose(exact, basis.mix(weights), rtol=2.0**-10)
        apart = np.abs(plain.mix(weights) - exact)
        assert apart.mean() > 0.03 * exact.mean()
        live = client.studio.session.views[0].live
        for average in (live.small_picture(weights), live.draft(weights)):
            np.testing.assert_allclose(average, live.averaged(basis.mix(weights)), rtol=1e-4)
    finally:
        client.studio.close()


def test_a_draft_of_lights_without_edges_is_their_sum(
    client: StudioClient, basis: lp.Basis
) -> None:
    """Within a block only the texture changes, which the current look has."""
    look = client.studio.session.views[0].current
    now = mixed(client, basis.current_weights).data.astype(np.float32)
    floor = 4 * FLOOR * look.mean()  # its error at a light of the mean
    np.testing.assert_allclose(now, look, rtol=2.0**-10, atol=floor)
    weights = np.random.default_rng(0).uniform(0, 2, (N, 3))
    # Blocks are enlarged by interpolation: in their middle it changes nothing.
    draft = mixed(client, weights).data.astype(np.float32)
    means = [
        x.reshape(H // BLOCK, BLOCK, W // BLOCK, BLOCK, 3).mean(axis=(1, 3))
        for x in (draft, basis.planes.mix(weights))
    ]
    assert abs(means[0] / means[1] - 1).mean() < 0.1
    total = means[0].sum() / means[1].sum()
    np.testing.assert_allclose(total, 1, atol=0.02)
    every_second = mixed(client, weights, step=2).data
    assert every_second.shape == (H // 2, W // 2, 3)


def test_the_exact_picture_follows_a_draft_at_rest(client: StudioClient, basis: lp.Basis) -> None:
    weights = np.random.default_rng(1).uniform(0, 2, (N, 3))
    mixed(client, weights, is_live=True, number=1)
    mixed(client, weights / 2, slot=1, number=2, is_clean=False)
    mixed(client, weights, number=3, is_clean=False)
    exact = {
        number: client.wait(lambda m, n=number: m.kind == "mixed" and m.number == n)
        for number in (2, 3)
    }
    for number, factor in ((2, 0.5), (3, 1.0)):
        message = exact[number]
        assert message.is_exact
        expected = basis.planes.mix(factor * weights)
        # Halves have eleven bits.
        np.testing.assert_allclose(message.data.astype(np.float32), expected, rtol=2.0**-11)
    assert not any(m.kind == "mixed" and m.number == 1 for m in client.messages)


def test_paint_is_answered_with_its_draft(client: StudioClient, basis: lp.Basis) -> None:
    """The one that a page would ask for afterwards, under the master dimmer."""
    image, importance = np.full((6, 6, 3), 0.7, np.float32), np.ones((6, 6), np.float32)
    client.studio.handle(protocol.SetMaster(level=0.5), {})
    request = protocol.Paint(stroke=1, region=(4, 10, 8, 14), with_draft=True)
    [answer] = client.studio.handle(request, {"image": image, "importance": importance})
    assert isinstance(answer, protocol.AnswerUpdate)
    assert answer.draft is not None
    assert answer.draft.shape == (H // BLOCK, W // BLOCK, 3)
    assert not np.allclose(answer.weights, basis.current_weights)
    asked_for = mixed(client, 0.5 * answer.weights, is_live=True).data.astype(float)
    detail = client.studio.resource("detail").astype(float)
    # Halves have eleven bits, and there are three of them.
    enlarged = resampled(answer.draft.astype(np.float32), (H, W))
    np.testing.assert_allclose(enlarged * detail, asked_for, rtol=3 * 2.0**-11)
    plain = client.studio.handle(
        replace(request, with_draft=False), {"image": image, "importance": importance}
    )
    assert plain[0].arrays.keys() == {"weights"}


def test_paint_stops_the_exact_picture_of_an_earlier_answer(
    client: StudioClient, basis: lp.Basis, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(client.studio._mixes, "_begin", lambda: None)
    for slot in (protocol.ANSWER_SLOT, 1):
        mixed(client, basis.current_weights, slot=slot)
    image, importance = np.full((6, 6, 3), 0.7, np.float32), np.ones((6, 6), np.float32)
    request = protocol.Paint(stroke=1, region=(4, 10, 8, 14), with_draft=True)
    client.studio.handle(request, {"image": image, "importance": importance})
    assert [slot for _, slot in client.studio._mixes._wanted] == [1]


@pytest.mark.parametrize("step", [0, 9])
def test_the_step_of_a_draft_is_checked(step: int) -> None:
    with pytest.raises(ValueError, match="the step of a draft is 1 to 8"):
        protocol.MixLights(slot=0, number=1, step=step)


def test_denoised_pictures_are_of_the_same_light(client: StudioClient, basis: lp.Basis) -> None:
    weights = np.random.default_rng(2).uniform(0.5, 1, (N, 3))
    mixed(client, weights)
    message = client.wait(lambda m: m.kind == "mixed")
    light = message.data.astype(np.float32)
    np.testing.assert_allclose(light.mean(), basis.planes.mix(weights).mean(), rtol=0.05)


def test_large_pictures_are_reduced(
    client: StudioClient, basis: lp.Basis, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(picture_table, "MAX_MIXED_PIXELS", H * W // 4)
    weights = np.ones((N, 3))
    client.studio._mixes._drafts.clear()
    assert mixed(client, weights, is_clean=False).data.shape == (H // 2, W // 2, 3)
    exact = client.wait(lambda m: m.kind == "mixed").data.astype(np.float32)
    blocks = basis.planes.mix(weights).reshape(H // 2, 2, W // 2, 2, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(exact, blocks, rtol=2.0**-11)


@pytest.mark.parametrize(
    "weights", [np.ones((N + 1, 3)), np.ones(3), np.full((N, 3), np.nan), None]
)
def test_weights_of_other_lights_are_refused(client: StudioClient, weights: Any) -> None:
    arrays = {} if weights is None else {"weights": weights}
    with pytest.raises(PaintError, match=rf"weights: expected finite numbers of shape \({N}, 3\)"):
        client.studio.handle(protocol.MixLights(slot=0, number=1), arrays)


def test_shares_around_a_pixel_are_of_its_block(client: StudioClient, basis: lp.Basis) -> None:
    lights = client.studio.resource("lights_at/5,9")
    block = basis.planes.rows(BLOCK, 2 * BLOCK)[:, :, 2 * BLOCK : 3 * BLOCK].mean(axis=(1, 2))
    np.testing.assert_allclose(lights, block, rtol=1e-5)
    for name in ("lights_at/5", "lights_at/-1,2", "lights_at/a,b@0"):
        with pytest.raises(PaintError, match="there is no picture"):
            client.studio.resource(name)


def test_drafts_add_up_to_the_picture(basis: lp.Basis) -> None:
    """However many follow each other, and also when planes are replaced in between."""
    rng, weights = np.random.default_rng(3), np.ones((N, 3))
    film = SmallFilm(basis, basis.current_look.copy(), np.zeros((H, W), np.float32), BLOCKS)
    for k in range(2 * DRAFTS_PER_SUM):
        weights = weights.copy()
        weights[rng.integers(N, size=1 + k % N)] = rng.uniform(0, 2, 3)
        # Each adds a few roundings to float32.
        np.testing.assert_allclose(film.draft(weights), film.mix(weights), rtol=1e-4)
    replaced = basis.planes.replaced({1: 3 * basis.planes.plane(1)})
    film.replace_planes(replace(basis, planes=replaced), [1])
    np.testing.assert_allclose(film.draft(weights), film.mix(weights), rtol=1e-5)
