"""How well an answer guesses what somebody meant, who painted it the way people paint.

    python benchmarks/intent.py [--scenes gallery stage cornell] [--styles spot blob all full core]
                                [--cases 12] [--first 0] [--settings literal default ...] [--clean]
                                [--few 2 4]
    python benchmarks/intent.py --loosen [--scenes ...] [--styles ...] [--cases ...] [--first ...]

A case means a lighting: the current one with one to three lights changed by 1 to 2.5 stops, up or
down, most of them warmer or cooler, in a quarter of the cases everything else dimmed by 1 to 3
stops. Painted is only part of what that would do, and not exactly: the look times 2^(log ratio),
blurred, its strength wrong by a factor of 0.75 to 1.35, its hue off by 0.15 stops, with soft edges,
in 8 bits. Styles: `spot`, only the strongest part of the strongest region; `blob`, that region;
`all`, whatever changes clearly; `full`, the whole picture; `core`, the pixels of the strongest
change in `all` that have a third of it together: the bright middle of a pool of light. Judged is
the whole picture, painted or not: mean CIEDE2000 between the answer and what was meant, at the
exposure of the painting.

`off` counts lamps that an answer turns off, or down by two stops, though they were meant to stay as
they are or become brighter: lamps below 5 % and below a quarter of their present luminance.

Harm is how much worse than a lighting with nothing painted a case is at most. `now` is the current
lighting; `unpainted` is what the same settings give with nothing painted. Only whites differ in it:
somebody who asks for white lamps, of lamps that are none, has to lose their colours whatever he
paints, and the line `nothing, white` shows what that alone costs.

The next rows are of bases of few samples, as the painter has at first: painted over the denoised
look of that basis, judged by the one of many. The last of each table is of the same planes as a
file of light groups, which says nothing of noise, emitters in view, or the lamps' emission.

With --loosen only those cases count in which the hold keeps the lights from the paint, and what is
judged is how far it should be loosened: until it brings so much of what no hold would.

`lamps` are strokes over a lamp that the camera sees and what is around it: one light is meant that
much brighter and warmer, or a quarter of the times darker, and the brush goes over the lamp in the
colour of what is beside it.

Constants in lightpaint were chosen on cases 0 to 11; docs/benchmarks.md reports 12 to 23.
"""

import argparse
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import OpenEXR
from scipy.ndimage import gaussian_filter, label

import lightpaint as lp
from lightpaint.basis.cache.cached_render import obtain_basis
from lightpaint.basis.light_basis import meter_exposure
from lightpaint.colour.color import delta_e, kelvin_to_rgb, luminance
from lightpaint.images.denoiser import denoised
from lightpaint.lighting.analysis.appearance import limiting_reasons
from lightpaint.lighting.live.live_solver import LiveSolver
from lightpaint.lighting.live.live_view import LiveView

SCENES = Path(__file__).parent.parent / "scenes"
SIZES = {"gallery": "160x90", "stage": "160x90", "cornell": "64x64"}
SPP = 256

#: Of what no hold would bring, what a weaker one is to bring.
SHARES = (0.3, 0.5, 0.7, 0.9)

#: In this order: the number of a style chooses its cases.
STYLES = ("spot", "blob", "all", "full", "core")

#: Share of the visible change that a core has.
CORE_SHARE = 1 / 3

#: Shares of its present luminance below which a lamp is off, and down, and from which on it was
#: meant to stay.
OFF, DOWN, STAYING = 0.05, 0.25, 0.99

#: What is tried; the first is the paper's own reading, the last what nobody has to ask for.
SETTINGS: dict[str, dict[str, Any]] = {
    "literal": {"literal": True},
    "unpainted .1": {"literal": True, "unpainted": 0.1},
    "display": {"literal": True, "space": "display"},
    "display, hold": {"colors": "free"},
    "linear, hold, gentle": {"space": "linear"},
    "white": {"colors": "white"},
    "hold 1": {"hold": 1.0},
    "default": {},
}


#: ΔE of each case, by style.
Errors = dict[str, list[float]]


@dataclass(frozen=True)
class Case:
    """A lighting that was meant, and how it was painted.

    meant, current: (h, w, 3) linear. kept: (n,), the luminance of each lamp that was meant,
    relative to its present one.
    """

    meant: np.ndarray
    current: np.ndarray
    target: lp.Target
    kept: np.ndarray

    def judged(self, image: np.ndarray) -> float:
        """Mean ΔE of a picture against what was meant, as the display shows both."""
        transform = self.target.transform
        assert transform is not None
        displayed = (transform.decode(transform.encode(x)) for x in (image, self.meant))
        return float(delta_e(*(x * 2**transform.stops for x in displayed)).mean())

    def over(self, few: lp.Basis) -> "Case":
        """The same strokes over the look of a basis of few samples, without its grain."""
        transform = self.target.transform
        assert transform is not None
        dark = 0.01 * self.current.mean()
        ratio = (self.target.image.astype(np.float64) + dark) / (self.current + dark)
        look = denoised(few.current_look, few.features) * ratio
        codes = np.round(255 * transform.encode(look)) / 255
        image = transform.decode(codes).astype(np.float32)
        return replace(self, target=replace(self.target, image=image, at_least=codes >= 1))


def main() -> None:
    """Print a table for each scene."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", nargs="+", default=list(SIZES), choices=SIZES)
    parser.add_argument("--styles", nargs="+", default=list(STYLES), choices=STYLES)
    parser.add_argument("--settings", nargs="+", default=list(SETTINGS), choices=SETTINGS)
    parser.add_argument("--cases", type=int, default=12, metavar="N", help="of each style")
    parser.add_argument("--first", type=int, default=0, metavar="K", help="number of the first")
    parser.add_argument(
        "--clean", action="store_true", help="painted over the denoised look, as in template.png"
    )
    parser.add_argument(
        "--few", nargs="*", type=int, default=[2, 4], metavar="N", help="samples of noisy bases"
    )
    parser.add_argument(
        "--loosen", action="store_true", help="judge weaker holds, where the hold is in the way"
    )
    options = parser.parse_args()
    for name in options.scenes:
        if options.loosen:
            loosened(name, options)
            continue
        scene = lp.load_scene(SCENES / name / "scene.xml").reduced(SIZES[name])
        basis = obtain_basis(scene, spp=SPP)
        print(f"\n{name} {SIZES[name]}, {SPP} spp, cases {options.first} to ", end="")
        print(f"{options.first + options.cases - 1}: mean and worst ΔE")
        cases = {
            style: [
                painted(
                    basis,
                    style,
                    np.random.default_rng([STYLES.index(style), k]),
                    is_clean=options.clean,
                )
                for k in range(options.first, options.first + options.cases)
            ]
            for style in options.styles
        }
        head(cases)
        idle_errors = judged_alike(cases, basis.mix(basis.current_weights))
        row("doing nothing", idle_errors, idle_errors, idle_errors)
        for setting in options.settings:
            own = judged_alike(cases, basis.mix(unpainted(basis, SETTINGS[setting])))
            if own != idle_errors:
                row(f"nothing, {setting}", own, idle_errors, own)
            start_s = time.perf_counter()
            answers = {
                style: [weights(basis, x, SETTINGS[setting]) for x in cases_of_style]
                for style, cases_of_style in cases.items()
            }
            taken_s = (time.perf_counter() - start_s) / (options.cases * len(cases))
            errors = {
                style: [x.judged(basis.mix(w)) for x, w in zip(cases[style], found, strict=True)]
                for style, found in answers.items()
            }
            row(setting, errors, idle_errors, own, taken_s, darkened(basis, cases, answers))
        for spp in options.few:
            few = obtain_basis(scene, spp=spp, seed=1, use_cache=False)
            errors = {
                style: [x.judged(basis.mix(weights(few, x.over(few), {}))) for x in cases_of_style]
                for style, cases_of_style in cases.items()
            }
            row(f"default, {spp} spp", errors, idle_errors, idle_errors)
        groups = as_light_groups(basis)
        errors = {
            style: [x.judged(answer(groups, x, {})) for x in cases_of_style]
            for style, cases_of_style in cases.items()
        }
        row("default, light groups", errors, idle_errors, idle_errors)
        numbers = range(options.first, options.first + options.cases)
        lamps = [over_lamp(basis, np.random.default_rng([99, k])) for k in numbers]
        lamps = {"lamps": [x for x in lamps if x is not None]}
        if lamps["lamps"]:
            head(lamps)
            none = judged_alike(lamps, basis.current_look)
            row("doing nothing", none, none, none)
            for setting in options.settings:
                own = judged_alike(lamps, basis.mix(unpainted(basis, SETTINGS[setting])))
                lamp_errors = [
                    x.judged(answer(basis, x, SETTINGS[setting])) for x in lamps["lamps"]
                ]
                row(setting, {"lamps": lamp_errors}, none, own)


def loosened(name: str, options: argparse.Namespace) -> None:
    """Print the mean ΔE of the advised hold, and of what other shares would have advised."""
    scene = lp.load_scene(SCENES / name / "scene.xml").reduced(SIZES[name])
    basis = obtain_basis(scene, spp=SPP)
    differences = []
    for style in options.styles:
        for k in range(options.first, options.first + options.cases):
            case = painted(basis, style, np.random.default_rng([STYLES.index(style), k]))
            solution = lp.solve(basis, case.target)
            appearance = lp.compare_appearance(solution)
            if not any(reason.kind == "hold" for reason in appearance.causes):
                continue
            holds = [solution.problem.fit.hold]
            for share in SHARES:
                limiting_reasons.LOOSENED_SHARE = share
                reasons = limiting_reasons.reasons_of(solution)
                weaker = [x.loosening.hold for x in reasons if x.loosening is not None]
                holds.append(weaker[0] if weaker else holds[0])
            answers = [answer(basis, case, {"hold": hold}) for hold in [*holds, 0.0]]
            differences.append([case.judged(x) for x in (case.current, *answers)])
    names = ("doing nothing", "held", *(f"{100 * share:.0f} %" for share in SHARES), "let go")
    mean_differences = zip(names, np.mean(differences, axis=0), strict=True)
    print(
        f"{name}, {len(differences)} cases: "
        + ", ".join(f"{n} {x:.2f}" for n, x in mean_differences),
        flush=True,
    )


def head(styles: Collection[str]) -> None:
    """Print the heads of the columns of `row`."""
    columns = "".join(f"{style:>14s}" for style in styles)
    print(f"{'':22s}{columns}{'mean':>8s}   harm: now unpainted{'s':>6s}   off, down")


def row(
    name: str,
    errors: Errors,
    present: Errors,
    own: Errors,
    taken_s: float = 0,
    lamps: tuple[int, int] | None = None,
) -> None:
    """Print a line: errors by style, their mean, and how much worse than either lighting with
    nothing painted a case is at most. lamps: see `darkened`.
    """
    columns = "".join(f"{np.mean(x):8.2f} {max(x):5.1f}" for x in errors.values())
    mean = np.mean([np.mean(x) for x in errors.values()])
    harm = (
        max(np.max(np.subtract(errors[x], baseline[x])) for x in errors)
        for baseline in (present, own)
    )
    harm_text = "".join(f"{x:10.2f}" for x in harm)
    lamps_text = "" if lamps is None else f"{lamps[0]:6d}{lamps[1]:6d}"
    print(f"{name:22s}{columns}{mean:8.2f}  {harm_text}{taken_s:6.2f}{lamps_text}", flush=True)


def darkened(
    basis: lp.Basis, cases: Mapping[str, Sequence[Case]], answers: Mapping[str, Sequence[Any]]
) -> tuple[int, int]:
    """Return how many lamps that were meant to stay or be brighter are off, and down.

    answers: weights (n, 3) for each case.
    """
    counts = [0, 0]
    for style, found in answers.items():
        for case, w in zip(cases[style], found, strict=True):
            stays = case.kept >= STAYING
            for k, level in enumerate((OFF, DOWN)):
                counts[k] += int((stays & (levels(basis, w) < level)).sum())
    return counts[0], counts[1]


def judged_alike(cases: Mapping[str, Sequence[Case]], image: np.ndarray) -> Errors:
    """Judge one picture (h, w, 3) in all cases."""
    return {
        style: [x.judged(image) for x in cases_of_style] for style, cases_of_style in cases.items()
    }


def unpainted(basis: lp.Basis, settings: dict[str, Any]) -> np.ndarray:
    """Return the weights (n, 3) that the painter shows with these settings and nothing painted."""
    view = LiveView(basis, np.zeros_like(basis.current_look), np.zeros(basis.size, np.float32))
    solver = LiveSolver([view], fit=lp.Fit(**settings), constraints=lp.Constraints())
    return solver.answer(basis.current_weights)


def as_light_groups(basis: lp.Basis) -> lp.Basis:
    """Return the lights' present pictures as another renderer's light groups would give them."""
    channels = {
        f"Light_{name}.{c}": np.ascontiguousarray(image[..., k])
        for name, image in zip(basis.names, current_pictures(basis), strict=True)
        for k, c in enumerate("RGB")
    }
    header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}
    with TemporaryDirectory() as folder:
        path = Path(folder) / "groups.exr"
        OpenEXR.File(header, channels).write(str(path))
        return lp.read_light_groups(path, pattern="Light_{name}").basis


def current_pictures(basis: lp.Basis) -> np.ndarray:
    """Return the picture of each light in the current lighting, (n, h, w, 3) float32."""
    return (basis.images * basis.current_weights[:, None, None]).astype(np.float32)


def answer(basis: lp.Basis, case: Case, settings: dict[str, Any]) -> np.ndarray:
    """What the solve makes of the painting, noise taken out as the command line does."""
    return basis.mix(weights(basis, case, settings))


def weights(basis: lp.Basis, case: Case, settings: dict[str, Any]) -> np.ndarray:
    """The same as weights of the lights, (n, 3)."""
    solution = lp.solve(basis, case.target, **settings)
    if basis.knows_noise and not settings.get("literal"):
        solution = lp.correct_noise(solution)
    return solution.weights


def painted(
    basis: lp.Basis, style: str, rng: np.random.Generator, *, is_clean: bool = False
) -> Case:
    """A lighting that somebody means, and a painting of it in that style.

    is_clean: whether it is painted over the denoised look.
    """
    current = basis.mix(basis.current_weights)
    weights, intended, ratio = next(
        (weights, image, ratio)
        for weights, image, ratio in intentions(basis, current, rng)
        if (np.abs(ratio).max(axis=-1) > 0.5).mean() > 0.005
    )
    soft = basis.size[1] / 80
    ratio = np.dstack([gaussian_filter(plane, soft) for plane in np.moveaxis(ratio, -1, 0)])
    strong = np.abs(ratio).max(axis=-1)
    scatter = rng.normal(0, 0.15, 3) * (strong > 0.2)[..., None]
    look = denoised(current, basis.features, quality="high") if is_clean else current
    image = look * 2 ** (ratio * rng.uniform(0.75, 1.35) + scatter)
    mask = np.ones(basis.size)
    if style != "full":
        mask = gaussian_filter(region(strong, style).astype(float), soft)
        mask[mask < 0.02] = 0
    transform = lp.ViewTransform("srgb", meter_exposure(current, basis))
    codes = np.round(255 * transform.encode(image)) / 255
    target = lp.Target(
        style,
        transform.decode(codes).astype(np.float32),
        mask.astype(np.float32),
        everything=style == "full",
        at_least=codes >= 1,
        transform=transform,
        through_view=True,
        over_look=True,
    )
    return Case(intended, current, target, levels(basis, weights))


def levels(basis: lp.Basis, weights: np.ndarray) -> np.ndarray:
    """Return the luminance (n,) of lamps of weights (n, 3), relative to the present one."""
    return np.asarray(luminance(weights) / np.maximum(luminance(basis.current_weights), 1e-12))


def over_lamp(basis: lp.Basis, rng: np.random.Generator) -> Case | None:
    """A stroke over a lamp in view and what is around it; None where no lamp is in view."""
    current, emitter_mask = basis.current_look, basis.emitters_seen
    brightest_lights = np.argmax(luminance(current_pictures(basis)), axis=0)
    lamps = [k for k in np.unique(brightest_lights[emitter_mask]) if not basis.is_fixed[k]]
    if not lamps:
        return None
    k = int(rng.choice(lamps))
    rows, columns = np.nonzero(emitter_mask & (brightest_lights == k))
    pixel = int(rng.integers(rows.size))
    y, x = np.mgrid[: basis.size[0], : basis.size[1]]
    away = np.hypot(y - rows[pixel], x - columns[pixel]) / basis.size[0]
    mask = gaussian_filter((away < rng.uniform(0.06, 0.2)).astype(float), basis.size[1] / 80)
    mask[mask < 0.02] = 0
    weights = basis.current_weights.copy()
    weights[k] *= 2 ** (rng.uniform(1, 2.5) * (1 if rng.random() < 0.75 else -1))
    tint = kelvin_to_rgb(rng.uniform(2400, 5000)) / kelvin_to_rgb(6500)
    weights[k] *= tint / luminance(tint)
    intended = basis.mix(weights)
    unseen = ~emitter_mask[..., None]
    neighbours = (intended * mask[..., None] * unseen).sum((0, 1)) / (mask[..., None] * unseen).sum(
        (0, 1)
    )
    image = np.where(emitter_mask[..., None], neighbours, intended) * rng.uniform(0.75, 1.35)
    transform = lp.ViewTransform("srgb", meter_exposure(current, basis))
    codes = np.round(255 * transform.encode(image)) / 255
    target = lp.Target(
        "lamp",
        transform.decode(codes).astype(np.float32),
        mask.astype(np.float32),
        everything=False,
        at_least=codes >= 1,
        transform=transform,
        through_view=True,
        over_look=True,
    )
    return Case(intended, current, target, levels(basis, weights))


def intentions(
    basis: lp.Basis, current: np.ndarray, rng: np.random.Generator
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Weights (n, 3) of lightings that one may mean, their pictures (h, w, 3), and the log₂ ratios
    of these to the current one.
    """
    lights = np.flatnonzero(~basis.is_fixed)
    dark = 0.01 * current.mean()
    while True:
        weights = basis.current_weights.copy()
        if rng.random() < 0.25:
            weights[lights] *= 2 ** -rng.uniform(1, 3)
        for k in rng.choice(lights, size=rng.integers(1, 4), replace=False):
            stops = rng.choice([-1, 1]) * rng.uniform(1, 2.5)
            weights[k] = basis.current_weights[k] * 2**stops
            if rng.random() < 0.6:
                tint = kelvin_to_rgb(rng.uniform(2800, 9500)) / kelvin_to_rgb(6500)
                weights[k] *= tint / luminance(tint)
        image = basis.mix(weights)
        yield weights, image, np.log2((image + dark) / (current + dark))


def region(strong: np.ndarray, style: str) -> np.ndarray:
    """(h, w) bool, where somebody paints who sees a change of so many stops, (h, w)."""
    visible = strong > max(0.35, 0.25 * strong.max())
    if style == "all":
        return visible
    if style == "core":
        return core(strong, visible)
    parts, count = label(strong > (0.5 if style == "blob" else 0.75) * strong.max())
    sums = [strong[parts == k].sum() for k in range(1, count + 1)]
    return parts == 1 + int(np.argmax(sums))


def core(strong: np.ndarray, visible: np.ndarray) -> np.ndarray:
    """(h, w) bool, the pixels of the strongest change that have a third of all that is visible."""
    descending = np.sort(strong[visible])[::-1]
    amounts = np.cumsum(descending)
    least = descending[np.searchsorted(amounts, CORE_SHARE * amounts[-1])]
    return visible & (strong >= least)


if __name__ == "__main__":
    main()
