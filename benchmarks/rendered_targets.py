"""How often do 95 % intervals of lights hold if the painting is a render of the scene?

    python benchmarks/rendered_targets.py [--rooms cornell glass] [--seeds 12] [--filter gaussian]

The levels of all lights are changed by chance, and Mitsuba renders the scene so: a picture that
the lights make exactly, but for its noise. Each seed renders basis and painting anew and solves in
linear light. Printed is how often intervals hold the levels, on average and least, and how often
they would without the noise of the painting. A painting that was rendered with another filter than
a box is another picture: `--filter gaussian`, Mitsuba's default, shows what that does.
`--eight-bits` makes a PNG of it, which is read as a sketch. The last column is the RMS error of the
levels, relative to each.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from display_coverage import ROOMS, in_eight_bits, make_scene

import lightpaint as lp
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.scene.scene_render import Stream, render


def main() -> None:
    """Print a line for each room."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rooms", nargs="+", default=["cornell", "glass"])
    parser.add_argument("--seeds", type=int, default=12, metavar="N")
    parser.add_argument("--spp", type=int, default=256, help="samples of the basis")
    parser.add_argument("--target-spp", type=int, default=1024)
    parser.add_argument("--filter", choices=("box", "gaussian"), default="box")
    parser.add_argument("--eight-bits", action="store_true", help="a PNG, read as a sketch")
    options = parser.parse_args()
    use_variant()
    print(f"{'':12s}{'held':>8s}{'least':>8s}{'blind':>8s}{'error':>8s}")
    with tempfile.TemporaryDirectory() as folder:
        for room in options.rooms:
            scene = make_scene(room, Path(folder), "40x24" if room in ROOMS else "1/8")
            measure(room, scene, Path(folder), options)


def measure(room: str, scene: lp.Scene, folder: Path, options: argparse.Namespace) -> None:
    """Render, solve and print a line."""
    import mitsuba as mi  # after lightpaint, which finds its LLVM

    first, levels = lp.render_basis(scene, spp=16, seed=0), np.random.default_rng(4)
    weights = first.current_weights * np.exp(levels.normal(0, 0.5, (len(first.names), 1)))
    lighting = lp.solve(first, lp.Target.of(first.mix(weights)), literal=True).lighting
    weights = lighting.weights_for(first)
    relit = lp.relight(scene, lighting, folder / f"{room}_relit.xml")
    loaded = mi.load_file(str(relit.path))
    held, blind, errors, is_on = [], [], [], weights > 0
    for seed in range(options.seeds):
        basis = lp.render_basis(scene, spp=options.spp, seed=seed + 1)
        side = relit.size[0] // basis.size[0]
        spp = max(2, options.target_spp // side**2)
        if options.filter == "box":
            image = render(
                relit, spp=spp, seed=seed, stream=Stream.VERIFICATION, label="target"
            ).image
        else:
            image = np.array(mi.render(loaded, spp=spp, seed=seed))[..., :3]
        height, width = basis.size
        image = image.reshape(height, side, width, side, 3).mean(axis=(1, 3))
        target = in_eight_bits(image) if options.eight_bits else lp.Target.of(image)
        answer = lp.correct_noise(lp.solve(basis, target, literal=not options.eight_bits))
        errors.append(answer.weights[is_on] / weights[is_on] - 1)
        for kept, with_painting in ((held, True), (blind, False)):
            bars = lp.error_bars(answer, with_painting=with_painting)
            assert bars is not None
            low, high = bars.interval
            kept.append((low <= weights) & (weights <= high))
    shares = np.mean(held, axis=0)[is_on]
    without = np.mean(blind, axis=0)[is_on].mean()
    error = np.square(errors).mean() ** 0.5
    line = f"{room:12s}{shares.mean():8.3f}{shares.min():8.2f}{without:8.3f}{error:8.3f}"
    print(line, flush=True)


if __name__ == "__main__":
    main()
