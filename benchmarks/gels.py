"""Whether lamps that hang beside each other keep the colours of their gels.

    python benchmarks/gels.py [--rigs 12] [--first 0] [--settings default own free]

Draws stages with pairs of spots on bars, a warm and a cool gel at each place, and three washes of
a cyclorama, red, blue and amber. A rig is meant with the gels that it has: each lamp off, dimmer or
brighter. Painted is the whole picture of that, blurred by a fiftieth of its width, its hue off by
0.15 stops, in 8 bits. Judged are mean CIEDE2000 to the painting and to what was meant, and the
share of the light that comes from lamps that an answer gives another colour than their gel's, by
more than a stop between channels. With another version on PYTHONPATH the same is printed for it.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.ndimage import gaussian_filter

import lightpaint as lp
from lightpaint.colour.color import delta_e, luminance
from lightpaint.colour.display.exposure import choose_exposure

WIDTH, HEIGHT, SPP = 160, 90, 64
WARM, COOL = (1.0, 0.78, 0.5), (0.45, 0.6, 1.0)
WASHES = {"red": (8.0, 0.4, 0.3), "blue": (0.3, 0.8, 8.0), "amber": (8.0, 4.0, 0.6)}

#: Error of the painter's hue, and range between channels from which a colour is another, in stops.
HUE_STOPS, OTHER_STOPS = 0.15, 1.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rigs", type=int, default=12)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--settings", nargs="+", default=["default", "own", "free"])
    options = parser.parse_args()
    found: dict[str, list[tuple[float, float, float]]] = {name: [] for name in options.settings}
    for seed in range(options.first, options.first + options.rigs):
        with TemporaryDirectory() as folder:
            path = Path(folder) / "stage.xml"
            path.write_text("\n".join(stage(np.random.default_rng(seed))), encoding="utf-8")
            basis = lp.render_basis(lp.load_scene(path), spp=SPP, seed=seed)
        rng = np.random.default_rng([seed, 1])
        meant = basis.current_weights * 2.0 ** rng.uniform(-4, 1.5, (len(basis.lights), 1))
        meant[rng.random(len(meant)) < 0.4] = 0
        target = painting(basis, meant, rng)
        for name in options.settings:
            colors = {} if name == "default" else {"colors": name}
            found[name].append(judged(basis, target, meant, lp.solve(basis, target, **colors)))
    print("colours    ΔE to paint  ΔE to meant  other colours")
    for name, rows in found.items():
        paint, aim, other = np.mean(rows, axis=0)
        print(f"{name:10} {paint:11.2f}  {aim:11.2f}  {100 * other:11.1f} %")


def painting(basis: lp.Basis, meant: np.ndarray, rng: np.random.Generator) -> lp.Target:
    """Return the picture of a lighting, (n, 3), as somebody paints it over the look."""
    transform = lp.ViewTransform("srgb", choose_exposure(basis.current_look))
    light = gaussian_filter(basis.mix(meant), (WIDTH / 50, WIDTH / 50, 0))
    shown = transform.encode(light * 2.0 ** rng.uniform(-HUE_STOPS / 2, HUE_STOPS / 2, 3))
    image = transform.decode(np.round(255 * shown) / 255).astype(np.float32)
    everywhere = np.ones(basis.size, np.float32)
    return lp.Target(
        "painted",
        image,
        everywhere,
        everything=True,
        transform=transform,
        through_view=True,
        over_look=True,
    )


def judged(
    basis: lp.Basis, target: lp.Target, meant: np.ndarray, solution: lp.Solution
) -> tuple[float, float, float]:
    """Return ΔE to painting and meant picture, and the share of light of other colours."""
    assert target.transform is not None
    pictures = (basis.mix(solution.weights), target.image, basis.mix(meant))
    got, painted, aim = (target.transform.encode(np.asarray(x)) for x in pictures)
    light = luminance(basis.planes.array().mean(axis=(1, 2)) * solution.weights)
    dark = 1e-3 * basis.current_weights.max(axis=1, keepdims=True)
    stops = np.log2((solution.weights + dark) / (basis.current_weights + dark))
    share = light @ (np.ptp(stops, axis=1) > OTHER_STOPS) / light.sum()
    return float(delta_e(got, painted).mean()), float(delta_e(got, aim).mean()), float(share)


def stage(rng: np.random.Generator) -> Iterator[str]:
    """Yield the lines of a stage with pairs of spots on two bars, and washes of its back."""
    yield (
        '<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="5"/>'
        '</integrator><sensor type="perspective"><float name="fov" value="48"/><transform '
        'name="to_world"><lookat origin="0, 3, 13" target="0, 2, 0" up="0, 1, 0"/></transform>'
        f'<film type="hdrfilm"><integer name="width" value="{WIDTH}"/><integer name="height" '
        f'value="{HEIGHT}"/></film></sensor>'
    )
    yield _square("floor", '<scale x="7" y="6"/><rotate x="1" angle="-90"/>', _diffuse(0.15))
    yield _square("back", '<scale x="7" y="3.5"/><translate y="3.5" z="-4"/>', _diffuse(0.7))
    for k in range(int(rng.integers(2, 5))):
        x, z, height = rng.uniform((-4, -2, 0.8), (4, 2, 1.8))
        yield (
            f'<shape type="cylinder" id="actor_{k}"><point name="p0" value="{x}, 0, {z}"/>'
            f'<point name="p1" value="{x}, {height}, {z}"/><float name="radius" value="0.3"/>'
            f"{_diffuse(rng.uniform(0.2, 0.6))}</shape>"
        )
    for place in range(int(rng.integers(4, 9))):
        x, aim, is_front = rng.uniform(-5, 5), rng.uniform(-3.5, 3.5), place % 2 == 0
        power, angle = 60 * 2.0 ** rng.uniform(-1, 1), rng.uniform(12, 24)
        for k, (gel, color) in enumerate((("warm", WARM), ("cool", COOL))):
            emission = ", ".join(str(power * c) for c in color)
            side, depth = x + rng.uniform(0.1, 0.3) * k, 5 if is_front else -2.5
            yield (
                f'<emitter type="spot" id="{gel}_{place}"><transform name="to_world"><lookat '
                f'origin="{side}, 7, {depth}" target="{aim}, 1, 0" up="0, 0, 1"/></transform>'
                f'<rgb name="intensity" value="{emission}"/>'
                f'<float name="cutoff_angle" value="{angle}"/></emitter>'
            )
    for k, (name, color) in enumerate(WASHES.items()):
        level = 2.0 ** rng.uniform(-1.5, 0.5)
        emission = ", ".join(str(level * c) for c in color)
        pose = '<scale x="6" y="0.08"/><rotate x="1" angle="130"/>'
        pose += f'<translate y="6.9" z="{-3.2 + 0.2 * k}"/>'
        light = f'<emitter type="area"><rgb name="radiance" value="{emission}"/></emitter>'
        yield _square(f"wash_{name}", pose, light)
    yield "</scene>"


def _square(name: str, pose: str, inside: str) -> str:
    transform = f'<transform name="to_world">{pose}</transform>'
    return f'<shape type="rectangle" id="{name}">{transform}{inside}</shape>'


def _diffuse(grey: float) -> str:
    return f'<bsdf type="diffuse"><rgb name="reflectance" value="{grey}"/></bsdf>'


if __name__ == "__main__":
    main()
