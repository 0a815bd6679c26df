"""Texels that a painting does not show: they are smooth, keep their colours, or stay."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import BasisFactory
from texel_grid import texel_names

from lightpaint.arrays import Doubles
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.lights import BasisLight, Lights, joined_texels, light_images, texel_lights
from lightpaint.basis.planes import as_planes
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.loss import weight_penalty
from lightpaint.lighting.loss.weight_penalty import image_prior
from lightpaint.scene.lights.texels.image_domains import solid_angles
from lightpaint.scene.lights.texels.texel import TexelLayout, mirrored_pairs
from lightpaint.target.painted_target import Target

FREE = Fit(colors="free")


def sky_lights(size: tuple[int, int], current: Doubles | None = None) -> Lights:
    """Return the texels of a sky as lights. current: (rows, columns, 3), by default even white."""
    columns, rows = size
    now = np.ones((rows, columns, 3)) if current is None else current
    return Lights(
        tuple(
            BasisLight(name, "envmap", "radiance", "W/(m² sr)", tuple(map(float, rgb)))
            for name, rgb in zip(texel_names("sky", size), now.reshape(-1, 3), strict=True)
        )
    )


def even_power(size: tuple[int, int]) -> Doubles:
    """Return powers of planes whose amplitudes sum to one."""
    share = solid_angles(size).ravel() / (4 * np.pi)
    return np.repeat((share**2)[:, None], 3, axis=1)


def test_stiffness_is_that_of_the_sphere(monkeypatch: pytest.MonkeyPatch) -> None:
    size = (32, 33)
    monkeypatch.setattr(weight_penalty, "IMAGE_STAYING", 0.0)
    monkeypatch.setattr(weight_penalty, "IMAGE_COLOR", 0.0)
    prior = image_prior(sky_lights(size), even_power(size), FREE, 1.0)
    assert prior is not None
    polar = np.linspace(0, np.pi, size[1])
    height = np.repeat(np.cos(polar)[:, None, None], size[0], axis=1) * np.ones(3)
    # ∫ |∇ cos θ|² dω = 8π/3, and E is 1.
    expected = weight_penalty.SMOOTHNESS * (8 * np.pi / 3) / (4 * np.pi)
    value = prior.objective(height.reshape(-1, 3))
    np.testing.assert_allclose(value, expected, rtol=2e-3)


def test_an_even_image_in_its_own_colours_costs_nothing_and_others_do() -> None:
    size = (6, 4)
    prior = image_prior(sky_lights(size), even_power(size), FREE, 1.0)
    assert prior is not None
    even = np.ones((24, 3))
    assert prior.objective(even).sum() == pytest.approx(0, abs=1e-15)
    assert np.linalg.eigvalsh(prior.full_matrix).min() > 0
    other = np.random.default_rng(0).random((24, 3))
    assert prior.objective(other).sum() > 0


def test_the_expectation_does_not_depend_on_the_number_of_texels() -> None:
    def cost(size: tuple[int, int]) -> float:
        polar = np.linspace(0, np.pi, size[1])[:, None]
        azimuth = 2 * np.pi * (np.arange(size[0]) + 0.5) / size[0]
        values = 2 + np.sin(polar) * np.cos(azimuth)
        radiances = values[..., None] * np.array([1.0, 0.8, 0.5])
        prior = image_prior(sky_lights(size), even_power(size), FREE, 1.0)
        assert prior is not None
        return float(prior.objective(radiances.reshape(-1, 3)).sum())

    assert cost((16, 9)) == pytest.approx(cost((48, 25)), rel=0.05)


def test_lights_of_another_kind_or_name_are_no_image() -> None:
    lamps = Lights(tuple(replace(x, plugin="point") for x in sky_lights((2, 3))))
    assert image_prior(lamps, np.ones((6, 3)), FREE, 1.0) is None
    assert not texel_lights(lamps).any()
    incomplete = Lights(sky_lights((2, 3)).records[:-1])
    assert light_images(incomplete) == []


def test_sentences_count_the_texels_of_an_image() -> None:
    names = ["bulb", "sky.x0.y0", "sky.x1.y0", "dome.x0.y0"]
    assert joined_texels(names) == ["bulb", "2 texels of sky", "dome.x0.y0"]


def blurred_sky(
    make_basis: BasisFactory, size: tuple[int, int], seed: int
) -> tuple[Basis, Doubles]:
    """Return a basis whose pixels see a sky through wide lobes, and the sky behind a picture."""
    columns, rows = size
    generator = np.random.default_rng(seed)
    polar = np.pi * np.arange(rows)[:, None] / (rows - 1)
    azimuth = 2 * np.pi * (np.arange(columns) + 0.5) / columns
    texels = np.stack(
        np.broadcast_arrays(
            np.sin(polar) * np.cos(azimuth), np.cos(polar), np.sin(polar) * np.sin(azimuth)
        ),
        axis=-1,
    ).reshape(-1, 3)
    normals = generator.normal(size=(8 * 12, 3))
    normals[:, 1] = np.abs(normals[:, 1])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    lobes = np.maximum(texels @ normals.T, 0) * solid_angles(size).reshape(-1, 1) / np.pi
    images = np.repeat(lobes.reshape(-1, 8, 12, 1), 3, axis=3).astype(np.float32)
    sun = np.exp(4 * (texels @ np.array([0.6, 0.7, 0.39]) - 1))
    truth = np.array([0.3, 0.4, 0.6]) + sun[:, None] * np.array([4.0, 3.0, 2.0])
    return replace(make_basis(images=images), lights=sky_lights(size)), truth


@pytest.mark.parametrize("seed", range(3))
def test_a_sky_comes_back_nearer_with_the_expectation_than_without(
    make_basis: BasisFactory, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    size = (8, 5)
    basis, truth = blurred_sky(make_basis, size, seed)
    picture = np.einsum("nc,nhwc->hwc", truth, basis.images)
    picture *= 1 + 0.02 * np.random.default_rng(seed).normal(size=picture.shape)
    upper = np.s_[: 3 * size[0]]

    def miss() -> float:
        solution = solve(basis, Target.of(picture), colors="free", space="linear")
        weights = np.array([x.emission for x in solution.lighting.lights])
        error = (weights - truth)[upper]
        return float(np.linalg.norm(error) / np.linalg.norm(truth[upper]))

    with_expectation = miss()
    monkeypatch.setattr("lightpaint.lighting.loss.weight_penalty.image_prior", lambda *_: None)
    assert with_expectation < 0.7 * miss()
    assert with_expectation < 0.35


def test_what_no_pixel_sees_stays_as_it_is(make_basis: BasisFactory) -> None:
    size = (8, 5)
    basis, truth = blurred_sky(make_basis, size, 0)
    current = np.random.default_rng(1).random((5, 8, 3))
    images = np.array(basis.images)
    unseen = 4 * 8 + np.arange(8)
    images[unseen] = 0
    basis = replace(basis, lights=sky_lights(size, current), planes=as_planes(images))
    picture = np.einsum("nc,nhwc->hwc", truth, images)
    solution = solve(basis, Target.of(picture), colors="free", space="linear")
    weights = np.array([x.emission for x in solution.lighting.lights])
    np.testing.assert_allclose(weights[unseen], current.reshape(-1, 3)[unseen])


@pytest.mark.parametrize("size", [(6, 4), (5, 3)])
def test_a_symmetric_image_costs_as_much_as_one_that_happens_to_be(size: tuple[int, int]) -> None:
    """Where the picture of two texels is twice that of one, as if both were at one place."""
    columns, rows = size
    pairs = mirrored_pairs("sky", TexelLayout(size))
    lights = Lights(
        tuple(
            BasisLight(
                name, "envmap", "radiance", "W/(m² sr)", (1.0, 1.0, 1.0), members=(*members,)
            )
            for name, members in pairs.items()
        )
    )
    [image] = light_images(lights)
    assert image.is_whole
    np.testing.assert_array_equal(image.places, image.places[:, ::-1])
    assert texel_lights(lights).all()
    counts = np.array([len(members) for members in pairs.values()])
    power = even_power(size)
    even = power.reshape(rows, columns, 3)[:, : (columns + 1) // 2].reshape(-1, 3)
    prior = image_prior(lights, even * counts[:, None] ** 2, FREE, 1.0)
    whole = image_prior(sky_lights(size), power, FREE, 1.0)
    assert prior is not None
    assert whole is not None
    half = np.random.default_rng(3).uniform(0.2, 3, (len(pairs), 3))
    radiances = half[image.places].reshape(-1, 3)
    np.testing.assert_allclose(prior.objective(half), whole.objective(radiances), rtol=1e-12)
    np.testing.assert_allclose(image.mean(half), light_images(sky_lights(size))[0].mean(radiances))
