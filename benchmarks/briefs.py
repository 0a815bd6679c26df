"""How well an answer gives what a brief asks for: a mood of the whole picture, accents against it.

    python benchmarks/briefs.py [--scenes gallery stage table cornell] [--cases 12] [--first 0]
                                [--settings default own free ...]
                                [--flat] [--presets] [--sculptures] [--wall]

A brief means a lighting: two to five accent lamps go to 2700 to 3500 K and up by 0.3 to 1.5 stops,
all others to 6500 to 11,000 K and down by 0.5 to 2.5 stops; in a third of the cases there are no
accents, and all lamps follow one mood, warm or cool. Painted is what people say: over the region
that the accents light, and over the rest, "brighter by so many stops, warmer by so much", one flat
ratio each, the median of what the meant lighting does there, with soft edges, in 8 bits, over the
current look. The two are layers of the painting, or one flat painting with --flat.

Judged are, in this order: the mean ΔE2000 to the meant look; how much of the painted change of
colour and of lightness came (with N, A, G = Lab of now, painted, got, on pictures blurred by 4
pixels, Σ (A−N)(G−N) / Σ (A−N)² over a*b* or L*); the same of the worst zone in colour, and the
worst case of it; harm, the largest amount by which the ΔE of a case exceeds the ΔE of changing
nothing; and the greenest lamp with more than 3 % of the light: its Duv above the locus (in
thousandths), beyond what it has now and what is painted.

--presets asks for each preset over the whole picture instead, judged against what it asks, and
--sculptures for the three sculptures of the gallery, bright and warm in a cool dark room, beside
the lighting that somebody set by hand for it.

--wall asks for one warm wall of the gallery, all else as it is, with weaker and weaker holds, and
beside it shows lightings that were set by hand for it.

docs/benchmarks.md reports cases 60 to 71, run once; cases 0 to 47 chose the constants, and cases 48
to 59 were used for checks.
"""

import argparse
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter

import lightpaint as lp
from lightpaint.basis.cache.cached_render import obtain_basis
from lightpaint.basis.light_basis import meter_exposure
from lightpaint.colour.color import delta_e, kelvin_to_rgb, luminance
from lightpaint.errors import PaintError
from lightpaint.paint.presets.lighting_presets import PRESETS
from lightpaint.paint.protocol import ApplyPreset
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.session_file import MemoryStore
from lightpaint.pipeline.job.settings import Settings
from lightpaint.scene.lights.texels.texel import image_of
from lightpaint.target.painted_target import Wish

SCENES = Path(__file__).parent.parent / "scenes"
SIZES = {"gallery": "160x90", "stage": "160x90", "table": "160x90", "cornell": "64x64"}
SPP = 256

#: Blur of the pictures over which delivery is measured, in widths of the picture.
BLUR = 4 / 160

#: Mean change of a zone, in ΔE of a*b* or L*, below which nothing of that kind was asked for.
ASKED = 2.0

#: Holds of unpainted parts for the warm wall; 4 is the default.
WALL_HOLDS = (4, 2, 1, 0.5)

#: Share of the light of an answer above which a lamp's colour counts.
VISIBLE_SHARE = 0.03

SETTINGS: dict[str, dict[str, Any]] = {
    "default": {},
    "own": {"colors": "own"},
    "free": {"colors": "free"},
    "white": {"colors": "white"},
    "literal": {"literal": True},
}


@dataclass(frozen=True)
class Brief:
    """A painting, what was meant by it, and its zones.

    meant, current: (h, w, 3) linear. zones: (h, w) bool each.
    """

    meant: np.ndarray
    current: np.ndarray
    target: lp.Target
    zones: tuple[np.ndarray, ...]

    def shown(self, image: np.ndarray) -> np.ndarray:
        """A picture as the display shows it, linear at the exposure of the painting."""
        transform = self.target.transform
        assert transform is not None
        return np.asarray(transform.decode(transform.encode(image)) * 2**transform.stops)

    def error(self, image: np.ndarray) -> float:
        """Mean ΔE to what was meant."""
        return float(delta_e(self.shown(image), self.shown(self.meant)).mean())

    def delivered(self, image: np.ndarray, zone: np.ndarray | None = None) -> tuple[float, float]:
        """Shares of the painted change of colour and of lightness that came; NaN where none was
        asked.
        """
        now, asked, got = (
            lab_wash(self.shown(x)) for x in (self.current, self.target.image, image)
        )
        asked_change, got_change = asked - now, got - now
        where = np.ones(now.shape[:2], bool) if zone is None else zone
        shares = []
        for channels in ([1, 2], [0]):
            a, g = asked_change[where][:, channels], got_change[where][:, channels]
            amount = float(np.sqrt((a**2).sum(axis=1)).mean())
            shares.append(float((a * g).sum() / (a**2).sum()) if amount > ASKED else np.nan)
        return shares[0], shares[1]


def lab_wash(light: np.ndarray) -> np.ndarray:
    """CIE Lab of a blurred picture, (h, w, 3)."""
    import colour

    radius = BLUR * light.shape[1]
    wash = np.dstack([gaussian_filter(x, radius) for x in np.moveaxis(light, -1, 0)])
    xyz = wash @ colour.models.RGB_COLOURSPACE_sRGB.matrix_RGB_to_XYZ.T
    return np.asarray(colour.XYZ_to_Lab(xyz))


def main() -> None:
    """Print a table for each scene."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", nargs="+", default=list(SIZES), choices=SIZES)
    parser.add_argument("--settings", nargs="+", default=["default", "free"], choices=SETTINGS)
    parser.add_argument("--cases", type=int, default=12, metavar="N")
    parser.add_argument("--first", type=int, default=0, metavar="K", help="number of the first")
    parser.add_argument("--flat", action="store_true", help="one painting without layers")
    parser.add_argument("--presets", action="store_true", help="presets instead of briefs")
    parser.add_argument("--sculptures", action="store_true", help="of the gallery, instead")
    parser.add_argument("--wall", action="store_true", help="of the gallery, instead")
    options = parser.parse_args()
    is_of_gallery = options.sculptures or options.wall
    for name in options.scenes if not is_of_gallery else ["gallery"]:
        scene = lp.load_scene(SCENES / name / "scene.xml").reduced(SIZES[name])
        basis = obtain_basis(scene, spp=SPP)
        print(f"\n{name} {SIZES[name]}, {SPP} spp")
        if options.sculptures:
            show_sculptures(basis, options.settings)
            continue
        if options.wall:
            show_wall(basis)
            continue
        numbers = range(options.first, options.first + options.cases)
        briefs = (
            list(preset_briefs(basis))
            if options.presets
            else [(str(k), make_brief(basis, k, flat=options.flat)) for k in numbers]
        )
        head()
        row("doing nothing", basis, briefs, [basis.current_weights] * len(briefs))
        for setting in options.settings:
            start_s = time.perf_counter()
            answers = [weights(basis, brief.target, SETTINGS[setting]) for _, brief in briefs]
            taken_s = (time.perf_counter() - start_s) / len(briefs)
            row(setting, basis, briefs, answers, taken_s, each=options.presets)


def head() -> None:
    """Print the heads of the columns of `row`."""
    print(
        f"{'':24s}{'ΔE':>6s}{'colour':>8s}{'light':>7s}{'zone':>7s}{'worst':>7s}{'harm':>7s}",
        end="",
    )
    print(f"{'green':>7s}{'s':>6s}")


def row(
    name: str,
    basis: lp.Basis,
    briefs: Sequence[tuple[str, Brief]],
    answers: Sequence[np.ndarray],
    taken_s: float = 0.0,
    *,
    each: bool = False,
) -> None:
    """Print the means over cases, and the worst of some; each: also a line for each case."""
    lines = []
    for (title, brief), answer in zip(briefs, answers, strict=True):
        image = basis.mix(answer)
        colour, light = brief.delivered(image)
        zones = [share for zone in brief.zones for share in brief.delivered(image, zone)[:1]]
        worst = min((x for x in zones if not np.isnan(x)), default=np.nan)
        harm = brief.error(image) - brief.error(brief.current)
        values = brief.error(image), 100 * colour, 100 * light, 100 * worst, harm
        lines.append((*values, greenest(basis, brief, answer)[0]))
        if each:
            print(f"  {title:22s}{values[0]:6.2f}{values[1]:8.0f}{values[2]:7.0f}{values[3]:7.0f}")
    table = np.array(lines)
    error, colour, light, zone = (np.nanmean(table[:, k]) for k in range(4))
    print(
        f"{name:24s}{error:6.2f}{colour:8.0f}{light:7.0f}{zone:7.0f}{np.nanmin(table[:, 3]):7.0f}"
        f"{table[:, 4].max():7.2f}{table[:, 5].max():7.1f}{taken_s:6.2f}",
        flush=True,
    )


def weights(basis: lp.Basis, target: lp.Target, settings: dict[str, Any]) -> np.ndarray:
    """The answer as weights of the lights, (n, 3), noise taken out as the command line does."""
    solution = lp.solve(basis, target, **settings)
    if basis.knows_noise and not settings.get("literal"):
        solution = lp.correct_noise(solution)
    return solution.weights


def greenest(basis: lp.Basis, brief: Brief, answer: np.ndarray) -> tuple[float, str]:
    """Return the largest Duv of a visible lamp beyond its own, in thousandths, and its name."""
    power = np.asarray(luminance(np.sqrt(basis.power) * answer))
    worst, name = 0.0, ""
    for k in np.flatnonzero(power > VISIBLE_SHARE * power.sum()):
        if image_of(basis.names[k]) or basis.is_fixed[k]:
            continue
        now = duv(basis.current_weights[k]) if luminance(basis.current_weights[k]) > 0 else 0.0
        beyond = 1000 * (duv(answer[k]) - max(now, 0.0))
        if beyond > worst:
            worst, name = beyond, basis.names[k]
    return worst, name


def duv(rgb: np.ndarray) -> float:
    """Signed distance from Planck's locus in CIE 1960 (u, v): above 0 is green."""
    import colour

    xyz = colour.models.RGB_COLOURSPACE_sRGB.matrix_RGB_to_XYZ @ rgb
    uv = colour.UCS_to_uv(colour.XYZ_to_UCS(xyz))
    kelvins = np.geomspace(1500, 100_000, 400)
    locus = np.array([planck_uv(k) for k in kelvins])
    distance = np.hypot(*(locus - uv).T)
    k = int(np.argmin(distance))
    return float(np.copysign(distance[k], uv[1] - locus[k, 1]))


def planck_uv(kelvin: float) -> np.ndarray:
    """(u, v) of a black body."""
    import colour

    xyz = colour.models.RGB_COLOURSPACE_sRGB.matrix_RGB_to_XYZ @ kelvin_to_rgb(kelvin)
    return np.asarray(colour.UCS_to_uv(colour.XYZ_to_UCS(xyz)))


def warmer(mired: float) -> np.ndarray:
    """Gains (3,) of luminance 1 that make a white of 5000 K warmer, or cooler below 0."""
    gains = kelvin_to_rgb(1e6 / (200 + mired)) / kelvin_to_rgb(5000)
    return np.asarray(gains / luminance(gains))


def adjustable(basis: lp.Basis) -> list[list[int]]:
    """Return the numbers of the lights of each lamp; all texels of an image are one."""
    lamps: dict[str, list[int]] = {}
    for k in np.flatnonzero(~basis.is_fixed).tolist():
        lamps.setdefault(image_of(basis.names[k]) or basis.names[k], []).append(k)
    return list(lamps.values())


def changed(now: np.ndarray, kelvin: float, stops: float) -> np.ndarray:
    """Weights (m, 3) of one lamp at that white: a lamp takes it, an image is tinted."""
    if len(now) > 1:
        tint = kelvin_to_rgb(kelvin) / kelvin_to_rgb(6500)
        tinted = now * tint
        return np.asarray(tinted * 2**stops * luminance(now).sum() / luminance(tinted).sum())
    white = kelvin_to_rgb(kelvin)
    return np.asarray(2**stops * luminance(now)[:, None] * white / luminance(white))


def make_brief(basis: lp.Basis, number: int, *, flat: bool) -> Brief:
    """A brief of that number and its painting. flat: whether it has no layers."""
    rng = np.random.default_rng([48, number])
    lamps = adjustable(basis)
    current, now = basis.mix(basis.current_weights), basis.current_weights
    intended = now.copy()
    accents: list[int] = []
    if number % 3:
        most = min(5, len(lamps) - 2)
        count = int(rng.integers(min(2, most), most + 1))
        accents = rng.choice(len(lamps), size=count, replace=False).tolist()
    is_warm_mood = rng.random() < 0.5
    mood_kelvin = rng.uniform(6500, 11_000)
    mood_stops = -rng.uniform(0.5, 2.5)
    if not accents and is_warm_mood:
        mood_kelvin, mood_stops = rng.uniform(2400, 3500), rng.uniform(-1.5, 0.5)
    for k, lamp in enumerate(lamps):
        if k in accents:
            intended[lamp] = changed(now[lamp], rng.uniform(2700, 3500), rng.uniform(0.3, 1.5))
        else:
            spread = rng.uniform(0.9, 1.1), rng.uniform(-0.3, 0.3)
            intended[lamp] = changed(now[lamp], mood_kelvin * spread[0], mood_stops + spread[1])
    meant = basis.mix(intended)
    lit_by_accents = np.zeros(basis.size)
    for k in accents:
        for light in lamps[k]:
            lit_by_accents += luminance(basis.planes.plane(light) * intended[light])
    share = lit_by_accents / np.maximum(luminance(meant), 1e-9)
    accent_zone = gaussian_filter(share, basis.size[1] / 160) > 0.5
    zones = [accent_zone, ~accent_zone] if 0.004 < accent_zone.mean() < 0.97 else [share > -1]
    return paint_zones(basis, current, meant, zones, flat=flat)


def paint_zones(
    basis: lp.Basis,
    current: np.ndarray,
    meant: np.ndarray,
    zones: Sequence[np.ndarray],
    *,
    flat: bool,
) -> Brief:
    """Paint one flat ratio over each zone."""
    dark, soft = 0.01 * current.mean(), basis.size[1] / 80
    log_ratio = np.log2((meant + dark) / (current + dark))
    lit = luminance(current) > 0.02 * np.percentile(luminance(current), 95)
    masks = [gaussian_filter(zone.astype(float), soft) for zone in zones]
    total = sum(masks)
    flat_ratios = [
        np.median(log_ratio[zone & lit] if (zone & lit).any() else log_ratio[zone], axis=0)
        for zone in zones
    ]
    painted = (
        sum(m[..., None] * r for m, r in zip(masks, flat_ratios, strict=True)) / total[..., None]
    )
    return brief_of(basis, current, meant, current * 2**painted, zones, masks, flat=flat)


def brief_of(
    basis: lp.Basis,
    current: np.ndarray,
    meant: np.ndarray,
    image: np.ndarray,
    zones: Sequence[np.ndarray],
    masks: Sequence[np.ndarray],
    *,
    flat: bool = False,
) -> Brief:
    """A brief whose painting is `image`, in 8 bits, over the whole picture."""
    transform = lp.ViewTransform("srgb", meter_exposure(current, basis))
    codes = np.round(255 * transform.encode(image)) / 255
    wishes = (
        ()
        if flat
        else tuple(
            Wish(f"zone {k}", np.clip(mask, 0, 1).astype(np.float32))
            for k, mask in enumerate(masks)
        )
    )
    target = lp.Target(
        "brief",
        transform.decode(codes).astype(np.float32),
        np.ones(basis.size, np.float32),
        everything=False,
        at_least=codes >= 1,
        transform=transform,
        through_view=True,
        over_look=True,
        wishes=wishes,
    )
    return Brief(meant, current, target, tuple(np.asarray(zone, bool) for zone in zones))


def preset_briefs(basis: lp.Basis) -> Iterator[tuple[str, Brief]]:
    """Yield what each preset asks of the whole picture, as the painter's layers."""
    current = basis.mix(basis.current_weights)
    transform = lp.ViewTransform("srgb", meter_exposure(current, basis))
    whole = np.ones(basis.size, bool)
    for preset in PRESETS.values():
        store = MemoryStore(Identity.of([basis]))
        session = Session([basis], [current], store, settings=Settings(), transform=transform)
        with suppress(PaintError):  # a preset that finds nothing to be about
            session.handle(ApplyPreset(preset.name), {})
            target = session.target()
            if target is not None:
                yield preset.title, Brief(target.image, current, target, (whole,))


def show_sculptures(basis: lp.Basis, settings: Sequence[str]) -> None:
    """Print answers to bright warm sculptures in a cool dark room, and one set by hand."""
    assert basis.objects is not None
    current = basis.mix(basis.current_weights)
    subject = np.zeros(basis.size, bool)
    for name in ("knot", "figure", "vase"):
        subject |= basis.objects.mask(name)
    painted = current * 2**-1.5 * warmer(-40)
    painted = np.where(subject[..., None], current * 2**-0.1 * warmer(30), painted)
    brief = brief_of(basis, current, painted, painted, [subject, ~subject], [subject, ~subject])
    by_hand = basis.current_weights.copy()
    for k, name in enumerate(basis.names):
        is_spot = name in ("spot_figure", "spot_knot", "spot_vase")
        stops, mired = (0.5, 150) if is_spot else (-1.5, -150)
        by_hand[k] *= 2**stops * warmer(mired)
    print(f"{'':24s}{'ΔE':>6s}{'contrast of L*, b*':>22s}{'b* of the rest':>16s}")
    rows = [("asked", brief.target.image), ("now", current), ("by hand", basis.mix(by_hand))]
    rows += [(s, basis.mix(weights(basis, brief.target, SETTINGS[s]))) for s in settings]
    for name, image in rows:
        lab = np.array(lab_pixels(brief.shown(image)))
        inside, outside = lab[subject].mean(axis=0), lab[~subject].mean(axis=0)
        light, _, blue = inside - outside
        print(f"{name:24s}{brief.error(image):6.2f}{light:12.1f}{blue:10.1f}{outside[2]:16.1f}")


#: Changes of lamps of the gallery by hand, in stops and mireds, that make its back wall warm.
WALL_BY_HAND: dict[str, dict[str, tuple[float, float]]] = {
    "one spot": {"spot_field": (2, 150)},
    "and the sky": {"spot_field": (2, 150), "sky": (0.5, 60)},
    "others less": {
        "spot_field": (2, 150),
        "sky": (0.7, 100),
        "sun": (-1, 0),
        "skylight": (-0.4, -30),
    },
    "the sky alone": {"sky": (1, 100)},
}


def show_wall(basis: lp.Basis) -> None:
    """Print answers to a warm back wall, a stop brighter, and lightings that were set by hand."""
    assert basis.objects is not None
    current, wall = basis.mix(basis.current_weights), basis.objects.mask("back_wall")
    painted = np.where(wall[..., None], current * 2 * warmer(120), current)
    zones, masks = [wall, ~wall], [wall.astype(float), np.zeros(basis.size)]
    whole = brief_of(basis, current, painted, painted, zones, masks)
    target = replace(
        whole.target, importance=wall.astype(np.float32), wishes=whole.target.wishes[:1]
    )
    brief = replace(whole, target=target)
    print(f"{'':16s}{'light':>7s}{'colour':>8s}{'ΔE of the wall':>16s}{'of the rest':>13s}")
    rows = [("nothing", current)]
    rows += [(f"hold {h:g}", basis.mix(weights(basis, target, {"hold": h}))) for h in WALL_HOLDS]
    for name, changes in WALL_BY_HAND.items():
        by_hand = basis.current_weights.copy()
        for lamp, (stops, mired) in changes.items():
            by_hand[basis.names.index(lamp)] *= 2**stops * warmer(mired)
        rows.append((name, basis.mix(by_hand)))
    for name, image in rows:
        colour, light = brief.delivered(image, wall)
        off = delta_e(brief.shown(image), brief.shown(painted))
        print(
            f"{name:16s}{100 * light:7.0f}{100 * colour:8.0f}{off[wall].mean():16.1f}"
            f"{off[~wall].mean():13.1f}"
        )


def lab_pixels(light: np.ndarray) -> np.ndarray:
    """CIE Lab of a picture, (h, w, 3)."""
    import colour

    xyz = light @ colour.models.RGB_COLOURSPACE_sRGB.matrix_RGB_to_XYZ.T
    return np.asarray(colour.XYZ_to_Lab(xyz))


if __name__ == "__main__":
    main()
