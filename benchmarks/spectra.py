"""Measure the cost and the exactness of renders with spectra.

    python benchmarks/spectra.py [--rounds 3] [--spp 256] [--resolution 1/2] [SCENE …]

Bases: in RGB, and with spectra for lamps of one white emitter, and of four (red, green, blue,
white), in turns in one process. "time" is processor time for equal samples, "noise" the
variance of the picture's luminance with some emitters, "equal noise" their product: what as little
noise costs, all relative to RGB. Compilation and training are not counted.

Verifications: the variance of the relit scene by Mitsuba's own integrator at equal samples, with
wavelengths sampled as the eye sees them and as the lamps shine, relative to the basis; for lamps of
their red emitters alone, and of all four.

Wavelengths: the largest CIEDE2000 of 190 surfaces under four emitters, between the wavelengths that
some paths carry, and all. With --bias instead of all this: the same of scenes, mean and 99th
percentile over blocks of 4x4 pixels, between those that their paths carry and REFERENCE ones.
"""

import argparse
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from rows import add_csv, write_rows

from lightpaint import Basis, Scene, load_scene, relight, render_basis
from lightpaint.basis.render.basis_render import train_guide
from lightpaint.basis.render.render_parts import PartRenderer, plan_parts
from lightpaint.basis.render.tracer import wavelengths
from lightpaint.colour.color import ciede2000, lab, luminance
from lightpaint.colour.lamp import Lamp, LampEmitter
from lightpaint.colour.primaries import colour_science
from lightpaint.colour.spectrum import EYE, WAVELENGTHS, rgb_of_powers, spectrum_of
from lightpaint.images.estimate import Estimate
from lightpaint.images.pixel_blocks import block_mean
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.unknowns.lamp_parts import part_lamps
from lightpaint.scene.properties import film
from lightpaint.scene.properties.emission import MULTIPLE
from lightpaint.scene.scene_render import Stream, render

SCENES = ("scenes/cornell/scene.xml", "scenes/table/scene.xml")

#: LEDs, as Gaussians: peaks and standard deviations in nanometres, and a share of full. The white
#: one is a blue LED with a phosphor.
LEDS: dict[str, list[tuple[float, float, float]]] = {
    "red": [(632, 8, 1.0)],
    "green": [(523, 14, 1.0)],
    "blue": [(455, 10, 1.0)],
    "white": [(450, 9, 0.5), (575, 55, 1.0)],
}

#: Lamps and the emitters that shine in the picture of a row.
MIXES: dict[str, tuple[str, list[str]]] = {
    "RGB": ("RGB", []),
    "white": ("white", ["white"]),
    "RGBW, all on": ("RGBW", [*LEDS]),
    "RGBW, red": ("RGBW", ["red"]),
}

#: Wavelengths of a path that stand for all.
REFERENCE = 40


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", default=SCENES)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--resolution", default="1/2")
    parser.add_argument("--only-costs", action="store_true", help="leave the verifications out")
    parser.add_argument("--bias", action="store_true", help="measure the colours of pictures alone")
    add_csv(parser)
    options = parser.parse_args()
    rows: list[dict[str, str]] = []
    for path in options.scenes:
        scene = load_scene(path, use_lights_file=False).reduced(options.resolution)
        scene = scene.with_lights(*whole_lights(scene))
        print(f"{path}, {len(scene.lights)} lights, {scene.size[1]}x{scene.size[0]}", flush=True)
        if options.bias:
            print_bias(scene, options.spp)
            continue
        costs = print_costs(scene, options.spp, options.rounds)
        rows += [{"scene": str(path)} | cost for cost in costs]
        write_rows(options.csv, rows)
        if not options.only_costs:
            print_verifications(scene, options.spp)
    if not options.bias:
        print_wavelengths()


def whole_lights(scene: Scene) -> tuple[dict[str, tuple[str, ...]], list[str]]:
    """Return lights and those that stay: images and such cannot have emitters."""
    fixed = [x.name for x in scene.lights if x.is_fixed or x.unit == MULTIPLE]
    return {x.name: x.member_names for x in scene.lights}, fixed


def lamp_of(names: list[str]) -> Lamp:
    """Return a lamp of some LEDs, each of luminance 1."""
    waves, emitters = np.arange(380, 781.0), []
    for name in names:
        power = sum(share * np.exp(-0.5 * ((waves - nm) / sd) ** 2) for nm, sd, share in LEDS[name])
        spectrum = spectrum_of(waves, np.asarray(power))
        red, green, blue = rgb_of_powers(spectrum).tolist()
        emitters.append(LampEmitter(name, (red, green, blue), spectrum=spectrum))
    return Lamp(tuple(emitters))


def with_lamps(scene: Scene, lamp: Lamp) -> Scene:
    """Return the scene with that lamp in each light that does not stay."""
    return scene.with_lamps({x.name: lamp for x in scene.lights if not x.is_fixed})


def print_costs(scene: Scene, spp: int, rounds: int) -> list[dict[str, str]]:
    """Print time, noise and both of bases, relative to RGB. Returns the rows."""
    rows: list[dict[str, str]] = []
    scenes = {
        "RGB": scene,
        "white": with_lamps(scene, lamp_of(["white"])),
        "RGBW": with_lamps(scene, lamp_of([*LEDS])),
    }
    renderers = {name: PartRenderer(x, 1, train_guide(x, 1)) for name, x in scenes.items()}
    times: dict[str, list[float]] = {name: [] for name in scenes}
    for k in range(rounds + 1):
        for name, renderer in renderers.items():
            [*parts] = plan_parts(scenes[name], spp)
            start_s = time.process_time()
            for part in parts:
                renderer.render(part)
            if k:  # the first compiles
                times[name].append(time.process_time() - start_s)
    for renderer in renderers.values():
        renderer.close()
    first = 0.0
    print("lamps         time  noise  equal noise")
    for label, (name, lit) in MIXES.items():
        noise = variance(picture(render_basis(scenes[name], spp=spp, seed=2), lit))
        ratio = float(np.median(np.array(times[name]) / np.array(times["RGB"])))
        first = first or noise
        both = ratio * noise / first
        print(f"{label:12s}  {ratio:4.2f}   {noise / first:4.2f}         {both:4.2f}", flush=True)
        shown = (ratio, noise / first, both)
        columns = ("time", "variance", "for equal noise")
        rows.append({"lamps": label} | {x: f"{y:.2f}" for x, y in zip(columns, shown, strict=True)})
    return rows


def picture(basis: Basis, lit: Sequence[str]) -> Estimate:
    """Return the picture with those emitters of all lamps; of lights in RGB with all."""
    names = [x.name.rpartition("/")[2] if x.lamp else "" for x in basis.lights]
    weights = np.array([[float(not name or name in lit)] * 3 for name in names])
    return Estimate(basis.mix(weights), basis.noise.mix(weights))


def variance(estimate: Estimate) -> float:
    """Return the relative variance of the luminance of a picture without stray pixels."""
    noise = np.square(luminance(estimate.half_difference))
    kept = np.sort(noise.ravel())[: int(0.999 * noise.size)]
    return float(kept.mean() / np.square(luminance(estimate.image)).mean())


def print_verifications(scene: Scene, spp: int) -> None:
    """Print the noise of verifications, relative to the noise of their bases."""
    lamp = lamp_of([*LEDS])
    basis = render_basis(with_lamps(scene, lamp), spp=spp, seed=2)
    print("verification   by the eye  by the lamps")
    mixes: Mapping[str, Callable[[str], float]] = {
        "red": lambda name: float(name.endswith("/red")),
        "all four": lambda name: 1.0,
    }
    for label, drive in mixes.items():
        weights = np.array([[drive(x.name) if x.lamp else 1.0] * 3 for x in basis.lights])
        parts = dict(zip(lamp.names, part_lamps(lamp), strict=True))
        lamps = {k: parts[x.name.rpartition("/")[2]] for k, x in enumerate(basis.lights) if x.lamp}
        lighting = Lighting.of_weights(basis, weights, lamps=lamps)
        with tempfile.TemporaryDirectory() as folder:
            relit = relight(scene, lighting, Path(folder) / "relit.xml")
            height, width = scene.size
            relit = relit if relit.size == scene.size else relit.reduced(f"{width}x{height}")
            ratios = [noise_by_share(relit, share, spp) for share in (1.0, film.EVEN_SHARE)]
        of_basis = variance(combine(basis, lighting))
        print(f"{label:14s} {ratios[0] / of_basis:10.1f} {ratios[1] / of_basis:13.1f}", flush=True)


def noise_by_share(relit: Scene, share: float, spp: int) -> float:
    """Return the variance where that share of wavelengths is sampled as the eye sees them."""
    shipped, film.EVEN_SHARE = film.EVEN_SHARE, share
    try:
        return variance(render(relit, spp=spp, seed=3, stream=Stream.VERIFICATION))
    finally:
        film.EVEN_SHARE = shipped


def print_bias(scene: Scene, spp: int) -> None:
    """Print how far pictures are off by the wavelengths that their paths carry."""
    print("lamps         mean    99 %")
    for lamp in (["white"], [*LEDS]):
        lit = with_lamps(scene, lamp_of(lamp))
        shipped = render_basis(lit, spp=spp, seed=2)
        with reference_wavelengths():
            reference = render_basis(lit, spp=spp, seed=2)
        for label in (x for x, (_, on) in MIXES.items() if on and (len(lamp) > 1) == ("RGBW" in x)):
            pictures = (picture(basis, MIXES[label][1]) for basis in (shipped, reference))
            found, expected = (block_mean(x.image, 4) for x in pictures)
            white = np.percentile(luminance(expected), 95)
            errors = ciede2000(lab(found / white), lab(expected / white))
            far = np.quantile(errors, 0.99)
            print(f"{label:12s}  {errors.mean():4.2f}    {far:4.2f}", flush=True)


@contextmanager
def reference_wavelengths() -> Iterator[None]:
    """Have paths carry REFERENCE wavelengths within the block."""
    names = ("BROAD_PACKETS", "NARROW_PACKETS")
    shipped = {name: getattr(wavelengths, name) for name in names}
    for name in names:
        setattr(wavelengths, name, REFERENCE // 4)
    try:
        yield
    finally:
        for name, value in shipped.items():
            setattr(wavelengths, name, value)


def print_wavelengths() -> None:
    """Print how far surfaces are off by the wavelengths of few paths."""
    training = colour_science().characterisation.read_training_data_rawtoaces_v1()
    fine = np.arange(380.5, 780)
    surfaces = np.array(
        [np.interp(fine, WAVELENGTHS, x) for x in np.array(training.values, np.float64).T]
    )
    print("wavelengths  paths  " + "  ".join(f"{name:>6s}" for name in LEDS))
    for packets in (8, 12, 16):
        spacing = len(fine) // packets
        for paths in (1, 4, 16):
            shifts = (np.arange(paths) + 0.5) / paths * spacing
            bins = (shifts.astype(int)[:, None] + spacing * np.arange(packets)).ravel()
            errors = [surface_error(surfaces, fine, bins, name) for name in LEDS]
            print(f"{packets:11d}  {paths:5d}  " + "  ".join(f"{x:6.2f}" for x in errors))


def surface_error(surfaces: np.ndarray, waves: np.ndarray, bins: np.ndarray, name: str) -> float:
    """Return the largest CIEDE2000 of surfaces under an LED, by some of the wavelengths."""
    [emitter] = lamp_of([name]).emitters
    light = np.interp(waves, WAVELENGTHS, np.array(emitter.spectrum))[:, None] * EYE.response(waves)
    light = light / luminance(light.sum(axis=0))
    few = surfaces[:, bins] @ light[bins] * (len(waves) / len(bins))
    return float(ciede2000(lab(few), lab(surfaces @ light)).max())


if __name__ == "__main__":
    main()
