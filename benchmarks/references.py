"""How well *Look like this* finds the light of a reference, and presets that which they are called.

    python benchmarks/references.py [--scenes gallery stage] [--cases 4] [--first 0]
                                    [--methods whole regions parts pairs ...]
    python benchmarks/references.py --known [market] [--scenes gallery stage table cornell]

A reference is a picture of the scene, in 8 bits, under a lighting that is known: one that was found
for a painting in `targets/`, or one of those that `benchmarks/intent.py` means. It shows the view
that is painted, or that picture mirrored, or a part of it, or another view (of the stage, which has
two). Judged is the whole picture of the answer: its mean CIEDE2000 to the scene under that
lighting, after both have been exposed alike, since the exposure of a reference is unknown.

`pixels` paints the reference itself over the picture, which only a reference of the same view
allows. `pairs` are the places, at most five, in which the reference differs most.

A preset is judged by the lighting of a painting that somebody made of what it is called: before it,
what it asks for, and the answer.

With --known the references are of another place, of `known_places.py`, under six lightings. Its
light alone, on grey surfaces, says by how many stops lit parts are above shadows, by how many they
are warmer and how warm they are, as log2 of red over blue, and by how many stops of red over green
lit parts at the left differ from those at the right. Judged is whether the light of the scene, its
picture divided by its albedo where lamps reach it, moves there: before, as asked for, in the
answer, and in the reference; the mean distance of the four before and in the answer; and the share
of the way, by projection over all references.
"""

import argparse
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from intent import SCENES, SIZES, SPP, intentions
from known_places import PLACES, references
from scipy.ndimage import gaussian_filter

import lightpaint as lp
from lightpaint.basis.cache.cached_render import obtain_basis
from lightpaint.basis.light_basis import meter_exposure
from lightpaint.colour.color import delta_e, luminance
from lightpaint.paint.protocol import ApplyPreset, LookLike, PlacePair
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.session_file import MemoryStore
from lightpaint.pipeline.job.settings import Settings

#: Sensors by scene: that which is painted, and another one, if there is one.
SENSORS = {
    "gallery": ("camera", None),
    "stage": ("balcony", "box"),
    "table": ("guest", None),
    "cornell": ("camera", None),
}

#: What is asked for by each method; None paints the reference itself.
METHODS: dict[str, dict[str, Any] | None] = {
    "pixels": None,
    "whole": {"areas": "whole"},
    "regions": {"areas": "regions"},
    "parts": {"areas": "parts"},
    "pairs": {"areas": "pairs"},
}

#: Paintings of which lightings are found, by scene, and a preset that means such a one.
PAINTINGS = {
    "gallery": {
        "after-hours.png": "night",
        "evening.exr": None,
        "last-sun.png": "golden_hour",
        "morning.exr": None,
        "opening.png": None,
        "overcast.png": "overcast",
    },
    "stage": {"moonlight.exr": "moonlight", "sunset.exr": "golden_hour"},
}

#: Mean ΔE of the current picture, exposed alike, from which on a lighting is another one.
LEAST_CHANGE = 4.0

#: Share of each side of the picture that a part of it has.
PART = 0.65

#: Pairs of places, at most; and their least distance, in longer sides.
PAIRS, DISTANCE = 5, 0.15

#: What is measured of light: stops from shadows to lit parts, by which lit parts are warmer, of
#: warmth of the lit parts, and of their difference from left to right in red over green.
MEASURES = ("contrast", "warm-cool", "warmth", "left-right")

#: Share of the median of the light of all lamps, each as strong as the others, from which on they
#: reach a surface.
REACHED = 0.2

#: Shares of the picture that are lit parts and shadows.
LIT, SHADOWS = 0.1, 0.3

Places = list[tuple[tuple[float, float], tuple[float, float]]]


@dataclass(frozen=True)
class Case:
    """A lighting that is meant. meant: (h, w, 3) linear. references: light and places by kind."""

    meant: np.ndarray
    references: dict[str, tuple[np.ndarray, Places]]


def main() -> None:
    """Print a table for each scene."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", nargs="+", default=list(SENSORS), choices=SENSORS)
    parser.add_argument(
        "--known", nargs="?", const="market", choices=PLACES, help="references of another place"
    )
    parser.add_argument("--methods", nargs="+", default=list(METHODS), choices=METHODS)
    parser.add_argument("--cases", type=int, default=4, metavar="N")
    parser.add_argument("--first", type=int, default=0, metavar="K", help="number of the first")
    options = parser.parse_args()
    if options.known:
        for name in options.scenes:
            judge_known(name, options.known, render(name, SENSORS[name][0]))
        return
    for name in (name for name in options.scenes if name in PAINTINGS):
        basis, other = (
            None if sensor is None else render(name, sensor) for sensor in SENSORS[name]
        )
        assert basis is not None
        transform = lp.ViewTransform("srgb", meter_exposure(basis.current_look, basis))
        lightings = {file: found_lighting(name, file, basis) for file in PAINTINGS[name]}
        cases = [
            make_case(basis, other, weights, np.random.default_rng([78, k]))
            for k, weights in enumerate(lightings.values())
        ]
        compare_methods(f"{name}, lightings of paintings", basis, cases, transform, options.methods)
        numbers = range(options.first, options.first + options.cases)
        generators = [np.random.default_rng([77, k]) for k in numbers]
        cases = [
            make_case(basis, other, random_lighting(basis, transform, rng), rng)
            for rng in generators
        ]
        title = f"{name}, random lightings {numbers[0]} to {numbers[-1]}"
        compare_methods(title, basis, cases, transform, options.methods)
        judge_presets(name, basis, lightings, transform)


def compare_methods(
    title: str,
    basis: lp.Basis,
    cases: Sequence[Case],
    transform: lp.ViewTransform,
    methods: Sequence[str],
) -> None:
    """Print the mean ΔE of each method, by kind of reference."""
    kinds = list(cases[0].references)
    print(f"\n{title}: mean ΔE of {len(cases)}")
    print(f"{'':16s}" + "".join(f"{kind:>12s}" for kind in kinds) + f"{'s':>8s}")
    idle = np.mean([judged(basis.current_look, x.meant, transform) for x in cases])
    print(f"{'doing nothing':16s}" + f"{idle:12.2f}" * len(kinds), flush=True)
    for method in methods:
        start_s = time.perf_counter()
        errors = [list(errors_of(basis, x, method, transform)) for x in cases]
        taken_s = (time.perf_counter() - start_s) / sum(map(len, errors))
        columns = "".join(f"{x:12.2f}" for x in np.mean(errors, axis=0))
        print(f"{method:16s}{columns}{taken_s:8.2f}", flush=True)


def judge_presets(
    name: str, basis: lp.Basis, lightings: dict[str, np.ndarray], transform: lp.ViewTransform
) -> None:
    """Print the ΔE of presets to the lightings of paintings of what they are called."""
    print(f"\n{name}, presets{'before':>24s}{'asked for':>12s}{'answer':>12s}")
    for file, preset in PAINTINGS[name].items():
        if preset is None:
            continue
        session = open_session(basis, transform)
        session.handle(ApplyPreset(preset), {})
        target, meant = session.target(), basis.mix(lightings[file])
        assert target is not None
        images = basis.current_look, target.image, answer_to(basis, target)
        columns = "".join(f"{judged(x, meant, transform):12.2f}" for x in images)
        print(f"{preset:14s}{file:16s}{columns}", flush=True)


def judge_known(name: str, place: str, basis: lp.Basis) -> None:
    """Print how far the light of a scene moves to the known light of references of a place."""
    transform = lp.ViewTransform("srgb", meter_exposure(basis.current_look, basis))
    assert basis.features is not None
    albedo = np.maximum(basis.features.albedo, 0.05)
    usable = reached(basis, albedo)
    before = measures(basis.current_look / albedo, usable)
    ways = []
    print(f"\n{name}, references of the {place}: before, asked for, answer, reference")
    print(f"{'':14s}" + "".join(f"{x:>28s}" for x in MEASURES) + f"{'distance':>16s}")
    for title, known in references(place).items():
        shown = np.round(255 * lp.ViewTransform().encode(known.picture)).astype(np.uint8)
        target = asked_target(basis, shown, {"areas": "regions"}, transform)
        asked = basis.current_look if target is None else target.image
        answer = basis.current_look if target is None else answer_to(basis, target)
        after = [measures(x / albedo, usable) for x in (asked, answer)]
        theirs = measures(known.grey, known.is_surface)
        rows = np.array([before, *after, theirs])
        ways.append(rows - before)
        columns = "".join("".join(f"{x:7.2f}" for x in column) for column in rows.T)
        first, last = (np.abs(x - theirs).mean() for x in (before, after[1]))
        print(f"{title:14s}{columns}{first:9.2f} ->{last:5.2f}", flush=True)
    way = np.array(ways)
    power = np.maximum((way[:, 3] ** 2).sum(axis=0), 1e-9)
    shares = [(way[:, k] * way[:, 3]).sum(axis=0) / power for k in (1, 2)]
    for title, share in zip(("asked for", "answer"), shares, strict=True):
        print(f"{title:14s}" + "".join(f"{100 * x:26.0f} %" for x in share), flush=True)


def reached(basis: lp.Basis, albedo: np.ndarray) -> np.ndarray:
    """Return the surfaces (h, w) that lamps reach: others stay black under any lighting."""
    assert basis.features is not None
    usable = ~basis.emitters_seen & basis.features.normal.any(axis=-1)
    even = np.zeros(basis.size)
    for k in range(len(basis.lights)):
        plane = luminance(basis.planes.plane(k) * np.float32(1))
        even += plane / max(float(plane.mean()), 1e-9)
    even /= luminance(albedo)
    return np.asarray(usable & (even > REACHED * np.median(even[usable])))


def measures(light: np.ndarray, usable: np.ndarray) -> np.ndarray:
    """Return `MEASURES` of light that arrives at surfaces, (h, w, 3). usable: (h, w)."""
    smooth = np.maximum(gaussian_filter(light, (1, 1, 0)), 1e-9)
    pixels = smooth[usable]
    order = np.argsort(luminance(pixels))
    count = len(order)
    lit = pixels[order[-round(LIT * count) :]].mean(axis=0)
    shadows = pixels[order[: round(SHADOWS * count)]].mean(axis=0)
    warmth, in_shadows = (_stops(x[0], x[2]) for x in (lit, shadows))
    contrast = float(np.log2(luminance(lit) / luminance(shadows)))
    third = light.shape[1] // 3
    sides = [smooth[:, x][usable[:, x]] for x in (slice(third), slice(-third, None))]
    bright = [x[np.argsort(luminance(x))[-round(3 * LIT * len(x)) :]].mean(axis=0) for x in sides]
    left, right = (_stops(x[0], x[1]) for x in bright)
    return np.array([contrast, warmth - in_shadows, warmth, left - right])


def _stops(one: float, other: float) -> float:
    return float(np.log2(max(one, 0.01 * other) / max(other, 0.01 * one)))


def open_session(basis: lp.Basis, transform: lp.ViewTransform) -> Session:
    """Return a new session of a view."""
    store, look = MemoryStore(Identity.of([basis])), basis.current_look
    return Session([basis], [look], store, settings=Settings(), transform=transform)


def found_lighting(scene: str, file: str, basis: lp.Basis) -> np.ndarray:
    """Return the weights (n, 3) that are found for a painting."""
    target = lp.read_target(SCENES.parent / "targets" / scene / file)
    return lp.correct_noise(lp.solve(basis, target.resized(basis.size))).weights


def random_lighting(
    basis: lp.Basis, transform: lp.ViewTransform, rng: np.random.Generator
) -> np.ndarray:
    """Return the weights (n, 3) of another lighting."""
    current = basis.current_look
    return next(
        weights
        for weights, image, _ in intentions(basis, current, rng)
        if judged(current, image, transform) > LEAST_CHANGE
    )


def render(scene: str, sensor: str) -> lp.Basis:
    """Return the basis of a view of a scene."""
    loaded = lp.load_scene(SCENES / scene / "scene.xml", sensor=sensor)
    return obtain_basis(loaded.reduced(SIZES.get(scene, "160x90")), spp=SPP)


def errors_of(
    basis: lp.Basis, case: Case, method: str, transform: lp.ViewTransform
) -> Iterator[float]:
    """Yield the ΔE of the answers to a case's references."""
    request = METHODS[method]
    for light, places in case.references.values():
        reference = np.round(255 * transform.encode(light)).astype(np.uint8)
        if request is None:
            target = painted(reference, basis, transform)
        else:
            pairs = tuple(PlacePair(*pair) for pair in places)
            target = asked_target(basis, reference, {"pairs": pairs, **request}, transform)
        answer = basis.current_look if target is None else answer_to(basis, target)
        yield judged(answer, case.meant, transform)


def asked_target(
    basis: lp.Basis, reference: np.ndarray, request: dict[str, Any], transform: lp.ViewTransform
) -> lp.Target | None:
    """Return the painting after *Look like this*; None if it asks for nothing."""
    session = open_session(basis, transform)
    number = session.references.add("reference", reference).id
    try:
        session.handle(LookLike(number, **request), {})
    except lp.LightpaintError:
        return None
    return session.target()


def painted(reference: np.ndarray, basis: lp.Basis, transform: lp.ViewTransform) -> lp.Target:
    """Return the reference itself as a painting of the whole picture, as bright as it is now."""
    height, width = basis.size
    rows = (np.arange(height) + 0.5) * reference.shape[0] / height
    columns = (np.arange(width) + 0.5) * reference.shape[1] / width
    pixels = reference[rows.astype(int)][:, columns.astype(int)]
    image = transform.decode(pixels / 255)
    return lp.Target(
        "reference",
        image.astype(np.float32),
        np.ones(basis.size, np.float32),
        everything=True,
        at_least=pixels >= 255,
        transform=transform,
        through_view=True,
        over_look=True,
    )


def answer_to(basis: lp.Basis, target: lp.Target) -> np.ndarray:
    """Return the picture of the lighting that is found, as `lightpaint solve` finds it."""
    return basis.mix(lp.correct_noise(lp.solve(basis, target)).weights)


def judged(image: np.ndarray, meant: np.ndarray, transform: lp.ViewTransform) -> float:
    """Mean ΔE of a picture against what was meant, once it is exposed like that."""
    scale = 1.0
    for _ in range(8):
        scale *= brightness(meant, transform) / brightness(scale * image, transform)
    shown = [transform.encode(x) for x in (scale * image, meant)]
    plain = lp.ViewTransform(transform.name)
    return float(delta_e(*(plain.decode(x) for x in shown)).mean())


def brightness(image: np.ndarray, transform: lp.ViewTransform) -> float:
    """Return the geometric mean of the luminance of a picture, with a floor where it is black."""
    return float(np.exp(np.log(luminance(image) * 2**transform.stops + 0.02).mean()))


def make_case(
    basis: lp.Basis, other: lp.Basis | None, weights: np.ndarray, rng: np.random.Generator
) -> Case:
    """Return references that show a lighting. weights: (n, 3)."""
    current, meant = basis.current_look, basis.mix(weights)
    dark = 0.01 * current.mean()
    ratio = np.log2((meant + dark) / (current + dark))
    change = np.abs(ratio).sum(axis=-1)
    places = striking(gaussian_filter(change, 0.02 * max(basis.size)))
    left, top = rng.uniform(0, 1 - PART, 2)
    height, width = basis.size
    rows = slice(round(top * height), round((top + PART) * height))
    columns = slice(round(left * width), round((left + PART) * width))
    references = {
        "same": (meant, [(place, place) for place in places]),
        "mirrored": (meant[:, ::-1], [((1 - x, y), (x, y)) for x, y in places]),
        "part": (
            meant[rows, columns],
            [
                (((x - left) / PART, (y - top) / PART), (x, y))
                for x, y in places
                if left < x < left + PART and top < y < top + PART
            ],
        ),
    }
    if other is not None:
        references["other view"] = (other.mix(weights), seen_in_both(other, basis, change))
    return Case(meant, references)


def striking(change: np.ndarray) -> list[tuple[float, float]]:
    """Return the places (x, y), 0 to 1, at which a picture changes most."""
    height, width = change.shape
    y, x = np.mgrid[:height, :width]
    left, places = change.copy(), []
    while len(places) < PAIRS and left.max() > 0.25 * change.max():
        row, column = np.unravel_index(np.argmax(left), left.shape)
        places.append(((column + 0.5) / width, (row + 0.5) / height))
        left[np.hypot(y - row, x - column) < DISTANCE * width] = 0
    return places


def seen_in_both(other: lp.Basis, basis: lp.Basis, change: np.ndarray) -> Places:
    """Return the middles of the objects that change most, in the other view and in this one."""
    assert basis.objects is not None
    assert other.objects is not None
    shares = {
        name: float(change[basis.objects.mask(name)].mean())
        for name in dict.fromkeys(basis.objects.names)
        if basis.objects.mask(name).mean() > 0.004 and other.objects.mask(name).mean() > 0.004
    }
    names = sorted(shares, key=lambda name: -shares[name])[:PAIRS]
    return [(middle(other.objects.mask(x)), middle(basis.objects.mask(x))) for x in names]


def middle(mask: np.ndarray) -> tuple[float, float]:
    """Return the pixel of a mask nearest to its middle, as shares of width and height."""
    rows, columns = np.nonzero(mask)
    nearest = int(np.argmin(np.hypot(rows - rows.mean(), columns - columns.mean())))
    height, width = mask.shape
    return (columns[nearest] + 0.5) / width, (rows[nearest] + 0.5) / height


if __name__ == "__main__":
    main()
