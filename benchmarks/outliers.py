"""Do error bars hold the truth where a light is little but stray bright pixels?

    python benchmarks/outliers.py [--seeds 200] [--kinds plain fireflies ...]

Five lights of a synthetic basis, 64 x 36 pixels, of which the last is made difficult: `fireflies`,
all of its light by paths that a sample meets with a chance of .003; `rarer`, ten times less;
`partly`, half of it so; `dense`, by paths that every pixel meets once or twice; `highlight`,
`glints`, `specks`: half of its energy and more in one, three, thirty pixels, each met by a few
paths. `plain` is as the others are. Printed is how often the intervals hold the weights without
noise, of the last light and of the others, how often the last is said not to be told, and the
median width of its interval beside its truth.
"""

import argparse

import numpy as np

import lightpaint as lp
from lightpaint.basis.light_basis import Basis, Origin
from lightpaint.basis.lights import BasisLight

SIZE = (36, 64)

#: Samples per pixel and half.
SPP = 8

#: Chance that a sample meets the rare light.
RARE = {"fireflies": 3e-3, "rarer": 3e-4, "partly": 1e-2, "dense": 0.1}

#: Pixels that stand out, and how much of the pool's energy each has.
BRIGHT = {"highlight": (1, 0.7), "glints": (3, 0.4), "specks": (30, 1 / 30)}

KINDS = ("plain", *RARE, *BRIGHT)


def main() -> None:
    """Print a line for each kind, without the noise correction and with it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=200, metavar="N")
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=KINDS)
    options = parser.parse_args()
    print(f"{'':24s}{'last':>7s}{'others':>8s}{'untold':>8s}{'width':>8s}")
    for kind in options.kinds:
        for corrected in (False, True):
            row(kind, corrected, options.seeds)


def row(kind: str, corrected: bool, seeds: int) -> None:
    """One line of the table."""
    clean = lights(kind, np.random.default_rng(0))[0]
    image = painting(kind, clean).astype(np.float32)
    target = lp.Target("painted", image, np.ones(SIZE, np.float32), everything=True)
    truth = lp.solve(basis_of(clean, np.zeros_like(clean)), target, literal=True).weights
    coverages, untold, widths = [], [], []
    for seed in range(seeds):
        _, a, b = lights(kind, np.random.default_rng(1000 + seed))
        solution = lp.solve(basis_of((a + b) / 2, (a - b) / 2), target, literal=True)
        bars = lp.error_bars(lp.correct_noise(solution) if corrected else solution)
        assert bars is not None
        low, high = bars.interval
        coverages.append((low <= truth + 1e-9) & (truth <= high + 1e-9))
        untold.append(bars.untold[-1])
        widths.append((high - low)[-1, 0] / truth[-1, 0])
    last, others = np.mean(coverages, axis=0)[-1].mean(), np.mean(coverages, axis=0)[:-1].mean()
    name = f"{kind}{', corrected' if corrected else ''}"
    text = f"{last:7.3f}{others:8.3f}{np.mean(untold):8.2f}{np.median(widths):8.2f}"
    print(f"{name:24s}{text}", flush=True)


def basis_of(images: np.ndarray, halves: np.ndarray) -> Basis:
    """Images and half differences, (n, h, w, 3) each, as a basis."""
    lights_of_basis = tuple(
        BasisLight(f"l{k}", "area", "radiance", "", (1, 1, 1)) for k in range(len(images))
    )
    origin = Origin("synthetic", "", "", 0, "", (SPP, SPP), (1, 1))
    return Basis(
        lights_of_basis,
        *(x.astype(np.float32) for x in (images, halves)),
        np.zeros(SIZE, bool),
        origin,
    )


def lights(kind: str, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What five lights do, (5, h, w, 3), and two halves of its samples."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] / SIZE[0]
    places = np.random.default_rng(0).random((5, 2)) * [SIZE[1] / SIZE[0], 1]
    pools = np.stack([np.exp(-((x - a) ** 2 + (y - b) ** 2) / 0.15) for a, b in places])
    clean = pools[..., None] * np.ones(3)
    a, b = (ordinary(clean, rng) for _ in range(2))
    if kind in RARE:
        rare = 0.02 * (clean[4] + 0.2)
        usual = 0.05 * clean[4] if kind == "partly" else 0 * rare
        clean[4] = rare + usual
        for half in (a, b):
            half[4] = ordinary(usual, rng) + hits(rare, RARE[kind], rng)
    if kind in BRIGHT:
        count, energy = BRIGHT[kind]
        bright = np.zeros((SIZE[0] * SIZE[1], 3))
        indices = np.random.default_rng(7).integers(0, len(bright), count)
        bright[indices] = np.sqrt(energy * np.square(clean[4, ..., 0]).sum())
        bright = bright.reshape(*SIZE, 3)
        clean[4] += bright
        for half in (a, b):
            half[4] += hits(bright, 0.25, rng)
    return clean, a, b


def ordinary(clean: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """With skewed noise in every pixel, the same in all channels."""
    noise = rng.exponential(1, (*clean.shape[:-1], 1)) - 1
    return clean * (1 + 0.2 * np.sqrt(2) * noise)


def hits(clean: np.ndarray, chance: float, rng: np.random.Generator) -> np.ndarray:
    """As paths find it that a sample meets with `chance`, and that are not all as bright."""
    hit_counts = rng.poisson(chance * SPP, SIZE)
    samples = rng.gamma(3.0 * hit_counts + 1e-12) / 3 * (hit_counts > 0)
    return clean * (samples / (chance * SPP))[..., None]


def painting(kind: str, clean: np.ndarray) -> np.ndarray:
    """Something that no mix of the lights is, (h, w, 3)."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1], :1][:2]
    last = {"partly": 6.0}.get(kind, 20.0 if kind in RARE else 0.8)
    image = np.einsum("n,nhwc->hwc", [1, 0.5, 0.3, 0.3, last], clean)
    return image * (0.6 + 0.4 * (x > 30)) * np.array([1, 0.7, 0.3]) + 0.1 * y / SIZE[0]


if __name__ == "__main__":
    main()
