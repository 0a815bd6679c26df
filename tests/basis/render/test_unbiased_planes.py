"""Planes of one pass against plain Mitsuba: equal means, for each kind of light and surface."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy
from nightly import nightly
from renderer import LIGHTS, PLASTIC, write_room

from lightpaint.arrays import Doubles
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render import basis_render
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.basis.render.rendered_basis import ONE_PASS
from lightpaint.basis.render.separate_renders import BLACK, WHITE
from lightpaint.images.estimate import Estimate
from lightpaint.images.formats.exr import write_rgb
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.scene.scene_reader import load_scene
from lightpaint.scene.scene_render import Stream, render

#: Samples per pixel of the basis and of the renders that it is compared with.
BASIS_SPP, SPP = 2048, 4096

#: Blocks along each side of the picture, over which light is summed.
BLOCKS = 4

#: What a sum over a block may differ by, in standard errors: of 96 sums without bias one in 1500
#: does so by chance, and the seeds are fixed.
LARGEST_Z = 4.5

ENVIRONMENT = """<emitter type="envmap" id="dome"><string name="filename" value="dome.exr"/>
    </emitter>"""
PROJECTOR = """<emitter type="projector" id="slide"><transform name="to_world">
    <lookat origin="-0.6 1.6 1.8" target="0.2 0.6 -0.5" up="0 1 0"/></transform>
    <texture type="bitmap" name="irradiance"><string name="filename" value="slide.exr"/>
    <boolean name="raw" value="true"/></texture><float name="fov" value="40"/></emitter>"""

#: A vertical panel close to the wall, which the wall's glossy lobe finds as often as a choice does.
NEAR = """<shape type="rectangle" id="near"><transform name="to_world"><scale value="0.25"/>
    <rotate y="1" angle="60"/><translate x="-0.7" y="0.7" z="-0.7"/></transform>
    <bsdf type="twosided"><bsdf type="diffuse"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="4 3 2"/></emitter></shape>"""

MASK = """<shape type="rectangle" id="leaf"><transform name="to_world"><scale value="0.6"/>
    <translate z="1.2" y="1.2"/></transform><bsdf type="mask"><float name="opacity" value="0.4"/>
    <bsdf type="twosided"><bsdf type="diffuse"/></bsdf></bsdf></shape>"""
PANE = """<shape type="rectangle" id="pane"><transform name="to_world"><scale value="0.7"/>
    <translate z="1.6" x="-0.3" y="0.9"/></transform><bsdf type="thindielectric"/></shape>"""

ROUGH = '<bsdf type="roughconductor"><float name="alpha" value="0.15"/></bsdf>'


def integrator(plugin: str = "path", **booleans: bool) -> str:
    flags = "".join(
        f'<boolean name="{name}" value="{str(value).lower()}"/>' for name, value in booleans.items()
    )
    return f'<integrator type="{plugin}"><integer name="max_depth" value="4"/>{flags}</integrator>'


ROOMS: dict[str, dict[str, str]] = {
    "every kind": {"lights": "".join(LIGHTS.values()) + NEAR + PROJECTOR},
    "envmap": {"lights": ENVIRONMENT + NEAR + LIGHTS["beam"], "wall": ROUGH},
    "rough plastic": {"lights": ENVIRONMENT + NEAR + PROJECTOR, "wall": PLASTIC},
    "masks and thin glass": {
        "lights": MASK + PANE + LIGHTS["panel"] + LIGHTS["bulb"] + LIGHTS["sun"] + ENVIRONMENT
    },
    "hidden emitters": {
        "lights": NEAR + LIGHTS["beam"] + LIGHTS["sky"],
        "integrator": integrator(hide_emitters=True),
    },
    "volpath": {
        "lights": NEAR + LIGHTS["bulb"] + LIGHTS["sun"] + PROJECTOR + ENVIRONMENT,
        "integrator": integrator("volpath"),
        "wall": ROUGH,
    },
}


@pytest.fixture(autouse=True)
def short_training(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(basis_render, "TRAINING_SAMPLES", (2**13,))


def room(folder: Path, **options: str) -> Scene:
    """A test room, with the pictures that its lights refer to beside it."""
    rng = np.random.default_rng(0)
    for name in ("dome", "slide"):
        write_rgb(folder / f"{name}.exr", rng.random((8, 16, 3)).astype(np.float32) ** 3)
    return load_scene(write_room(folder, **{"integrator": integrator(), **options}))


def light_alone(scene: Scene, name: str) -> Estimate:
    """Render one light alone with Mitsuba's own integrator."""
    emission = {x.name: WHITE if x.name == name else BLACK for x in scene.lights}
    return render(scene, emission, spp=SPP, stream=Stream.VERIFICATION)


def block_sums(image: np.ndarray) -> Doubles:
    """Sums over blocks of a picture and its channels, (BLOCKS², )."""
    rows = np.array_split(image.sum(axis=-1, dtype=np.float64), BLOCKS)
    return np.array([x.sum() for row in rows for x in np.array_split(row, BLOCKS, axis=1)])


def deviations(image: np.ndarray, half_difference: np.ndarray, truth: Estimate) -> Doubles:
    """How far sums over blocks lie apart, as values of the normal distribution if nothing is wrong.

    Of t = gap / error, with Student's distribution: where few pixels have most of a block's noise,
    their half differences, of one degree of freedom each, do not tell it well (Satterthwaite's
    degrees of freedom; h⁴ is 3σ⁴ in the mean). Blocks without light are left out.
    """
    # One path carries all channels.
    noises = (half_difference, truth.half_difference)
    squares = [np.square(x.sum(axis=-1, dtype=np.float64))[..., None] for x in noises]
    variance, fourth = block_sums(sum(squares)), block_sums(sum(x**2 for x in squares))
    lit_blocks = variance > 1e-12 * block_sums(truth.image) ** 2
    gap = (block_sums(image) - block_sums(truth.image))[lit_blocks]
    freedom = 3 * variance[lit_blocks] ** 2 / fourth[lit_blocks]
    tail = scipy.stats.t.sf(np.abs(gap) / np.sqrt(variance[lit_blocks]), freedom)
    return np.asarray(np.sign(gap) * scipy.stats.norm.isf(tail))


def check_means(z: Doubles) -> None:
    """Check that sums differ by noise alone: none by much, and all together by no more than usual.

    z² has the mean 1 and the variance 2: five standard errors of its mean.
    """
    assert np.abs(z).max() <= LARGEST_Z
    assert np.mean(z**2) <= 1 + 5 * np.sqrt(2 / z.size)
    assert abs(z.sum()) <= LARGEST_Z * np.sqrt(z.size)


def plane_deviations(scene: Scene, basis: Basis) -> Doubles:
    """Deviations of all planes from the renders of each light alone."""
    return np.concatenate(
        [
            deviations(basis.images[k], basis.half_differences[k], light_alone(scene, name))
            for k, name in enumerate(basis.names)
        ]
    )


@pytest.mark.nightly
@pytest.mark.parametrize(
    "kind", [kind if kind == "every kind" else nightly(kind) for kind in ROOMS]
)
def test_each_plane_is_the_render_of_its_light_alone(tmp_path: Path, kind: str) -> None:
    scene = room(tmp_path, **ROOMS[kind])
    basis = render_basis(scene, spp=BASIS_SPP)
    assert basis.origin.method == ONE_PASS
    z = plane_deviations(scene, basis)
    assert z.size >= 12 * len(basis.names)
    check_means(z)


def mutation(name: str) -> Any:
    """A replacement of a function of the paths, by which light is counted twice or too little."""
    from lightpaint.basis.render.tracer import path_tracer

    mis, count = path_tracer._mis, path_tracer.Rules.emitter_samples_at
    calls = iter(range(10**6))
    return {
        # The ray that hits an emitter forgets that several samples could have found it.
        "one sample by chance": (
            path_tracer.Rules,
            "emitter_samples_at",
            lambda rules, depth: count(rules, depth) if next(calls) % 2 else 1,
        ),
        "weights that do not add up": (path_tracer, "_mis", lambda a, b: mis(1.2 * a, b)),
    }[name]


@pytest.mark.nightly
@pytest.mark.parametrize("fault", ["one sample by chance", nightly("weights that do not add up")])
def test_a_wrong_weight_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: str
) -> None:
    use_variant()
    scene = room(tmp_path, **ROOMS["hidden emitters"])
    monkeypatch.setattr(*mutation(fault))
    z = plane_deviations(scene, render_basis(scene, spp=BASIS_SPP))
    with pytest.raises(AssertionError):
        check_means(z)


@pytest.mark.nightly
@pytest.mark.parametrize("lights", [33, nightly(129)])
def test_many_lights_have_the_mean_of_their_render(tmp_path: Path, lights: int) -> None:
    """Four emitters at later vertices from 32 on, eight from 128 on."""
    rng = np.random.default_rng(lights)
    texts = [NEAR]
    for k in range(lights - 1):
        x, y, z = rng.uniform((-0.9, 0.2, -0.8), (0.9, 1.9, 1.5))
        if k % 2:
            texts.append(
                f'<emitter type="point" id="p{k}"><point name="position" x="{x}" y="{y}" z="{z}"/>'
                '<rgb name="intensity" value="0.1 0.1 0.1"/></emitter>'
            )
        else:
            texts.append(
                f'<shape type="sphere" id="s{k}"><point name="center" x="{x}" y="{y}" z="{z}"/>'
                '<float name="radius" value="0.05"/><emitter type="area">'
                '<rgb name="radiance" value="3 3 3"/></emitter></shape>'
            )
    scene = room(tmp_path, lights="".join(texts))
    basis = render_basis(scene, spp=BASIS_SPP)
    z = []
    for seed in range(3):
        # At weights as unlike as these, only if every plane has its mean has their mix.
        weights = np.random.default_rng(seed).exponential(1, lights) ** 2
        emission = {name: (w, w, w) for name, w in zip(basis.names, weights.tolist(), strict=True)}
        truth = render(scene, emission, spp=SPP, seed=seed, stream=Stream.VERIFICATION)
        weights = np.repeat(weights[:, None], 3, axis=1)
        mixes = (planes.mix(weights) for planes in (basis.planes, basis.noise))
        z.append(deviations(*mixes, truth))
    for z_of_light in z:
        check_means(z_of_light)
