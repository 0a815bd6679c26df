"""The delivery of wishes: how much came of each change of brightness, and of colour.

A wish asks for a change from the current look N to the painting A; the answer made G of it. All are
washes (`wish_parts.py`). Brightness is L*; colour is a*b* of all three at the luminance of A,
so that colour counts for itself where brightness is missing. Of the asked change A − N, the share

    Σ ω (A − N)·(G − N) / Σ ω |A − N|²

came, with the weight ω of the wish in each pixel: its projection. A subject, smaller than the rest
of the lit picture, may also stand out as was asked while all is darker or bluer, since eyes adapt:
for that, A, N and G are single values, the mean over the wish less s times the mean over the rest,
where s is the share of the rest in both. Of the two shares, the one nearer to 1 counts.

N and G are noisy. A wish of a few dark pixels may be little but noise, and so may what lacks in it:
the scatter of its shares shows that, over pictures with noise added, the half difference of each
pixel with either sign.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.basis import read_look
from lightpaint.colour import ViewTransform, ciede2000, lab, luminance
from lightpaint.display_text import visible
from lightpaint.images import grown
from lightpaint.keywords import keywords
from lightpaint.lighting.analysis.appearance.wish_parts import (
    AreaWashes,
    Washes,
    WishKind,
    WishPart,
    wish_parts,
)
from lightpaint.lighting.problem import display_transform
from lightpaint.lighting.solution import Solution
from lightpaint.target import Target, find_wishes

#: ΔE of a visible change: if a wish changes brightness by less, it asks for none.
MIN_ASKED = 2.0

#: Luminance, relative to white, below which the colour of light fades to grey: the luminance of L*
#: 4.
DARK = 0.0044

#: Share of the lit paint from which a wish is nearly all of it.
MOST = 0.95

#: The least share of a change that has to come for a wish to have come.
MIN_DELIVERED = 0.75

#: Pictures with noise added by which the scatter of shares is estimated, and the seed of its signs.
NOISY_PICTURES, SEED = 8, 1

#: Standard errors within which a share is not known to be too small.
NOISE_ERRORS = 2.0

#: The share from which too much came: it is then shown as a ratio, and not in percent.
OVERDONE = 1.25


@keywords()
@dataclass(frozen=True)
class Delivery:
    """The share of one wish that came.

    Attributes:
        name: The name of the wish for people, or of its layer or group.
        brightness: The share of the asked change of brightness that came: 1 if all of it did, more
            if too much did, below 0 if it went the other way. None if no visible one was asked.
        color: The same of the change of colour.
        delta_e: The mean CIEDE2000 of its lit parts against the painting, as washes.
        asked_brightness: The change of brightness that it asks for, as ΔE.
        asked_color: The change of colour that it asks for, as ΔE.
        lit_pixels: The size of its lit parts.
        layers: The ids of its layers in a painter's session; none for a painting without layers.
        group: The name of its group of layers; "" without one.
        kind: `group` for all layers of a group; `layer` for a whole layer; `wish` for a part of a
            layer or of a painting without layers.
        is_darker: Whether it asks for less light, and not for more.
        brightness_error: The standard error of `brightness` by noise of the samples; 0 where three
            quarters or more came.
        color_error: The same of `color`.

    Examples:
        >>> [delivery] = lp.compare_appearance(lp.solve(basis, target)).deliveries
        >>> delivery.is_met
        True
    """

    name: str
    brightness: float | None
    color: float | None
    delta_e: float = 0.0
    asked_brightness: float = 0.0
    asked_color: float = 0.0
    lit_pixels: float = 1.0
    layers: tuple[int, ...] = ()
    group: str = ""
    kind: WishKind = "wish"
    is_darker: bool = False
    brightness_error: float = 0.0
    color_error: float = 0.0

    def __repr__(self) -> str:
        return f"Delivery({self.spoken})"

    @property
    def least(self) -> float | None:
        """The smaller of both shares; None if it asks for nothing visible."""
        shares = [share for share in (self.brightness, self.color) if share is not None]
        return min(shares, default=None)

    @property
    def is_met(self) -> bool:
        """True if at least three quarters of each asked change came, as far as noise tells."""
        return not (self.lacks_color or self.lacks_brightness)

    @property
    def lacks_color(self) -> bool:
        """True if less than three quarters of the asked change of colour came."""
        return _is_too_little(self.color, self.color_error)

    @property
    def lacks_brightness(self) -> bool:
        """True if less than three quarters of the asked change of brightness came."""
        return _is_too_little(self.brightness, self.brightness_error)

    @property
    def spoken(self) -> str:
        """`Moonlight: brightness 98 %, colour 43 %`; only the number if it asks for one of both."""
        return f"{visible(self.name)}: {self.spoken_shares}"

    @property
    def spoken_shares(self) -> str:
        """The same without the name."""
        brightness, color = self.brightness, self.color
        is_overdone = self.is_overdone
        if is_overdone or (brightness is not None and color is not None):
            parts = (("brightness", brightness), ("colour", color))
            return ", ".join(self._spoken_part(part, x) for part, x in parts if x is not None)
        share = brightness if color is None else color
        return "no visible change" if share is None else spoken_share(share)

    @property
    def is_overdone(self) -> bool:
        """True if much more came than it asks for."""
        return max(self.brightness or 0.0, self.color or 0.0) >= OVERDONE

    def _spoken_part(self, part: str, share: float) -> str:
        """Return `brightness 98 %` or, of too much, `darkened 1.4 times as much as painted`."""
        if share < OVERDONE:
            return f"{part} {spoken_share(share)}"
        times = "twice" if round(share, 1) == 2 else f"{share:.1f} times"
        if part == "colour":
            return f"coloured {times} as much as painted"
        return f"{'darkened' if self.is_darker else 'brightened'} {times} as much as painted"


def _is_too_little(share: float | None, error: float) -> bool:
    return share is not None and share + NOISE_ERRORS * error < MIN_DELIVERED


def spoken_share(share: float) -> str:
    """Return a delivered share as text, `43 %`; `0 %` if it went the other way."""
    return f"{max(round(100 * share), 0)} %"


def main_deliveries(deliveries: Sequence[Delivery]) -> list[Delivery]:
    """Return the entries that people name: groups as a whole, and strokes for themselves."""
    split = {layer for x in deliveries if x.kind == "wish" for layer in x.layers}
    return [
        x
        for x in deliveries
        if x.kind == "group"
        or (not x.group and (x.kind == "wish" or not split.intersection(x.layers)))
    ]


def worst_delivery(deliveries: Sequence[Delivery]) -> Delivery | None:
    """Return the entry of which least came, if less than three quarters did.

    A part of a group counts if the group as a whole came.
    """
    for entries in (main_deliveries(deliveries), deliveries):
        unmet = [
            (x.least, k) for k, x in enumerate(entries) if x.least is not None and not x.is_met
        ]
        if unmet:
            return entries[min(unmet)[1]]
    return None


def has_come(deliveries: Sequence[Delivery]) -> bool:
    """Return whether three quarters or more came of each wish that asks for something visible."""
    known = [x.least for x in main_deliveries(deliveries) if x.least is not None]
    return min(known, default=0.0) >= MIN_DELIVERED


class MeanShares(NamedTuple):
    """The shares of all wishes together, as `Delivery` has them; None if none was asked for."""

    brightness: float | None
    color: float | None


def mean_shares(deliveries: Sequence[Delivery]) -> MeanShares:
    """Return the mean shares of the entries that people name, from 0 to 1.

    Each counts alike, whatever its size, and more than was asked counts as all of it.
    """
    entries = main_deliveries(deliveries)
    return MeanShares(
        _mean_share([x.brightness for x in entries]), _mean_share([x.color for x in entries])
    )


def _mean_share(shares: Sequence[float | None]) -> float | None:
    known = [min(max(share, 0.0), 1.0) for share in shares if share is not None]
    return float(np.mean(known)) if known else None


def newest_delivery(deliveries: Sequence[Delivery]) -> Delivery | None:
    """Return the entry of the newest layer; None for a painting without layers."""
    layered = [x for x in main_deliveries(deliveries) if x.layers]
    return max(layered, key=lambda x: max(x.layers), default=None)


@dataclass(frozen=True)
class DeliveryReport:
    """The delivery of each wish, and the distance of all lit paint from the painting.

    deliveries: the lowest wish first; a layer follows its parts, and a group its layers. areas: of
    each of them, (h, w) from 0 to 1; none for several views. lit_delta_e: the mean CIEDE2000 of lit
    painted parts, as washes. lit_pixels: their size.
    """

    deliveries: tuple[Delivery, ...]
    areas: tuple[Floats, ...]
    lit_delta_e: float
    lit_pixels: float

    def name_of_part(self, delivery: Delivery | None) -> str:
        """Return the name of a wish that is a part of the paint; "" if it is nearly all of it."""
        is_part = delivery is not None and delivery.lit_pixels < MOST * self.lit_pixels
        return delivery.name if delivery is not None and is_part else ""


class ViewPictures(NamedTuple):
    """The pictures of a view from which deliveries are measured.

    target: its painting. emitters_seen: (h, w), where an emitter is in view. now, got: (h, w, 3)
    linear, the scene as it is and the answer.
    """

    target: Target
    emitters_seen: Bools
    now: Floats
    got: Floats


def have_wishes_come(views: Sequence[ViewPictures], transform: ViewTransform) -> bool:
    """Return whether the wishes of all views came, as in `has_come`. transform: of the display."""
    parts = [wish_parts(find_wishes(view.target, view.now), None) for view in views]
    return has_come(_measure_parts(views, parts, transform).deliveries)


def painted_views(solution: Solution, look: Floats, picture: Floats) -> list[ViewPictures]:
    """Return what deliveries are measured from in each view of a solution.

    look, picture: of the scene as it is now and of the answer, in the shape of the joint basis.
    """
    views = solution.problem.views
    pairs = enumerate(zip(views.bases, views.targets, strict=True))
    return [
        ViewPictures(target, basis.emitters_seen, views.part(look, k), views.part(picture, k))
        for k, (basis, target) in pairs
    ]


def measure_deliveries(solution: Solution, picture: Floats) -> DeliveryReport:
    """Measure how much of each wish came, in all views of `solution` together.

    picture: of the answer, in the shape of the joint basis.
    """
    basis, transform = solution.basis, display_transform(solution.problem)
    views = painted_views(solution, basis.current_look, picture)
    parts = [
        wish_parts(find_wishes(view.target, read_look(own_basis)), own_basis.objects)
        for view, own_basis in zip(views, solution.problem.views.bases, strict=True)
    ]
    report = _measure_parts(views, parts, transform)
    if worst_delivery(report.deliveries) is None or not basis.knows_noise:
        return report
    return replace(report, deliveries=_with_errors(solution, parts, report.deliveries, picture))


def _with_errors(
    solution: Solution,
    parts: Sequence[Sequence[WishPart]],
    deliveries: Sequence[Delivery],
    picture: Floats,
) -> tuple[Delivery, ...]:
    """Return deliveries, with the standard errors of their shares where too little came.
    For the others see `_measure_parts`.
    """
    places, measured = list(range(len(deliveries))), parts
    if len(parts) == 1:  # entries of several views are merged
        unmet = {x.name for x in deliveries if not x.is_met}
        places = [k for k in places if deliveries[k].name in unmet]
        measured = [[part for part in parts[0] if part.name in unmet]]
    basis, rng = solution.basis, np.random.default_rng(SEED)
    transform = display_transform(solution.problem)
    look_noise, noise = basis.current_noise, basis.noise.mix(solution.weights)
    changes = []
    for _ in range(NOISY_PICTURES):
        # The same samples made both pictures.
        signs = rng.choice(np.array([-1, 1], np.float32), picture.shape[:2])[..., None]
        look = np.maximum(basis.current_look + signs * look_noise, 0)
        got = np.maximum(picture + signs * noise, 0)
        views = painted_views(solution, look, got)
        noisy = _measure_parts(views, measured, transform).deliveries
        if len(noisy) == len(places):
            pairs = zip((deliveries[k] for k in places), noisy, strict=True)
            changes.append([_changes_of_shares(*pair) for pair in pairs])
    result = list(deliveries)
    errors = np.sqrt(np.square(changes).mean(axis=0)).tolist() if changes else []
    for k, (brightness, color) in zip(places, errors, strict=bool(errors)):
        result[k] = replace(result[k], brightness_error=brightness, color_error=color)
    return tuple(result)


def _changes_of_shares(measured: Delivery, noisy: Delivery) -> tuple[float, float]:
    """Return by how much noise changes the shares of brightness and of colour of a wish.

    Of a change that noise makes invisible nothing lacks.
    """
    pairs = (measured.brightness, noisy.brightness), (measured.color, noisy.color)
    brightness, color = (
        0.0 if share is None else (1.0 if other is None else other) - share
        for share, other in pairs
    )
    return brightness, color


def _measure_parts(
    views: Sequence[ViewPictures], parts: Sequence[Sequence[WishPart]], transform: ViewTransform
) -> DeliveryReport:
    """Measure the delivery of wishes that are known. parts: the wishes of each view."""
    found: list[Delivery] = []
    areas: list[Floats] = []
    painted: list[AreaWashes] = []
    for (target, seen, now, got), own_parts in zip(views, parts, strict=True):
        is_painted = target.importance > 0
        counts = (is_painted | ~seen) & ~_rims(seen & ~is_painted)
        asked = _asked_light(target, now, got)
        washes = Washes.of(now, asked, got, counts=counts, transform=transform)
        painted.append(washes.of_area(np.minimum(target.importance, 1))[0])
        for part in own_parts:
            wish, rest = washes.of_area(part.area * is_painted)
            if wish.lit_pixels > 0:
                found.append(_delivery(part, wish, rest))
                areas.append(part.area)
    pixels = [part.lit_pixels for part in painted]
    differences = [_mean_delta_e(part) for part in painted]
    mean = float(np.average(differences, weights=pixels)) if any(pixels) else 0.0
    if len(views) > 1:
        return DeliveryReport(merge_views(found), (), mean, sum(pixels))
    return DeliveryReport(tuple(found), tuple(areas), mean, sum(pixels))


def _rims(emitters: Bools) -> Bools:
    """Return the pixels around emitters that do not count, (h, w).

    Part of such a pixel may be the emitter, of which a painting has more or less than the samples.
    """
    return grown(emitters) & ~emitters


def _asked_light(target: Target, now: Floats, got: Floats) -> Floats:
    """Return the painted light (h, w, 3): where brighter is as good, also that of the answer; the
    current look where nothing is painted.
    """
    asked = target.image
    if target.at_least is not None:
        asked = np.where(target.at_least, np.maximum(asked, got), asked)
    return np.where((target.importance > 0)[..., None], asked, now)


def _delivery(part: WishPart, wish: AreaWashes, rest: AreaWashes) -> Delivery:
    """Measure one wish. rest: the washes of the rest of the picture."""
    brightness, asked_brightness = _share_delivered(_brightness(wish), _brightness(rest))
    color, asked_color = _share_delivered(_color(wish), _color(rest))
    return Delivery(
        part.name,
        brightness,
        color,
        delta_e=_mean_delta_e(wish),
        asked_brightness=asked_brightness,
        asked_color=asked_color,
        lit_pixels=wish.lit_pixels,
        layers=part.layers,
        group=part.group,
        kind=part.kind,
        is_darker=bool(_mean_luminance(wish.asked, wish) < _mean_luminance(wish.now, wish)),
    )


def _mean_luminance(light: Floats, washes: AreaWashes) -> float:
    return float(washes.weight.ravel() @ luminance(light.reshape(-1, 3)))


class _Colors(NamedTuple):
    """Current, painted and reached colours, L*a*b* (p, 3) each, and their weight, (p,)."""

    now: Doubles
    asked: Doubles
    got: Doubles
    weight: Doubles

    def mean(self) -> tuple[Doubles, Doubles, Doubles]:
        """Return the three weighted means, (3,); 0 without weight."""
        total = max(float(self.weight.sum()), 1e-12)
        now, asked, got = (self.weight @ x / total for x in self[:3])
        return now, asked, got


def _brightness(washes: AreaWashes) -> _Colors:
    """Return lit colours that differ in L* alone: all have the painted a*b*."""
    is_lit = washes.weight > 0
    asked = lab(washes.asked[is_lit])

    def at_asked_color(light: Doubles) -> Doubles:
        return np.concatenate([lab(light)[:, :1], asked[:, 1:]], axis=1)

    now, got = (at_asked_color(x[is_lit]) for x in (washes.now, washes.got))
    return _Colors(now, asked, got, washes.weight[is_lit])


def _color(washes: AreaWashes) -> _Colors:
    """Return lit colours that differ in a*b* alone: all have the painted luminance."""
    is_lit = washes.weight > 0
    level = luminance(washes.asked[is_lit])

    def at_asked_level(light: Doubles) -> Doubles:
        return lab((light + DARK) * (level / (luminance(light) + DARK))[:, None])

    now, asked, got = (at_asked_level(x[is_lit]) for x in (washes.now, washes.asked, washes.got))
    return _Colors(now, asked, got, washes.weight[is_lit])


def _share_delivered(wish: _Colors, rest: _Colors) -> tuple[float | None, float]:
    """Return the share of the asked change that came, None if it is invisible, and that change as
    ΔE.

    By pixels or, of a subject, against the rest of the picture, whichever is nearer to 1.
    """
    changes = [_change_by_pixels(wish)]
    if wish.weight.sum() < rest.weight.sum():
        changes.append(_change_by_contrast(wish, rest))
    candidates = []
    for change in changes:
        energy = float(change.weight @ np.square(change.asked).sum(axis=1))
        if change.delta_e >= MIN_ASKED and energy > 0:
            along = float(change.weight @ (change.asked * change.got).sum(axis=1))
            candidates.append((along / energy, change.delta_e))
    return min(candidates, key=lambda share: abs(1 - share[0]), default=(None, 0.0))


class _Change(NamedTuple):
    """The asked change of colours, and the change that came, (p, 3) each, with their weight, (p,).

    delta_e: the asked change, root mean square.
    """

    asked: Doubles
    got: Doubles
    weight: Doubles
    delta_e: float


def _change_by_pixels(wish: _Colors) -> _Change:
    square = np.square(ciede2000(wish.now, wish.asked))
    delta_e = float(np.sqrt(np.average(square, weights=wish.weight)))
    return _Change(wish.asked - wish.now, wish.got - wish.now, wish.weight, delta_e)


def _change_by_contrast(wish: _Colors, rest: _Colors) -> _Change:
    """Return the change of the mean over a wish, relative to that over the rest."""
    total = wish.weight.sum() + rest.weight.sum()
    share = rest.weight.sum() / total
    means = wish.mean()
    now, asked, got = (
        mean - share * of_rest for mean, of_rest in zip(means, rest.mean(), strict=True)
    )
    delta_e = float(ciede2000(means[1], means[1] - (asked - now)))
    return _Change((asked - now)[None], (got - now)[None], np.ones(1), delta_e)


def _mean_delta_e(washes: AreaWashes) -> float:
    if not washes.lit_pixels:
        return 0.0
    difference = ciede2000(lab(washes.got), lab(washes.asked))
    return float(np.average(difference, weights=washes.weight))


def merge_views(deliveries: Sequence[Delivery]) -> tuple[Delivery, ...]:
    """Merge the entries of each layer, and of each group, in several views.

    Shares are weighted by the change that a view asks for, ΔE by pixels.
    """
    entries: dict[object, list[Delivery]] = {}
    for k, delivery in enumerate(deliveries):
        key: object = k
        if delivery.kind != "wish":
            key = delivery.name if delivery.kind == "group" else delivery.layers
        entries.setdefault(key, []).append(delivery)
    return tuple(_merged(same) for same in entries.values())


def _merged(same: Sequence[Delivery]) -> Delivery:
    if len(same) == 1:
        return same[0]
    pixels = np.array([delivery.lit_pixels for delivery in same])
    brightness, asked_brightness = _merged_share(
        [x.brightness for x in same], pixels, [x.asked_brightness for x in same]
    )
    color, asked_color = _merged_share(
        [x.color for x in same], pixels, [x.asked_color for x in same]
    )
    return replace(
        same[0],
        brightness=brightness,
        color=color,
        delta_e=float(np.average([x.delta_e for x in same], weights=pixels)),
        asked_brightness=asked_brightness,
        asked_color=asked_color,
        lit_pixels=float(pixels.sum()),
        layers=tuple(dict.fromkeys(layer for x in same for layer in x.layers)),
    )


def _merged_share(
    shares: Sequence[float | None], pixels: Doubles, asked: Sequence[float]
) -> tuple[float | None, float]:
    """Return the share of several views, and their asked change as ΔE."""
    known = [
        (x, n * e * e, n) for x, n, e in zip(shares, pixels, asked, strict=True) if x is not None
    ]
    if not known:
        return None, 0.0
    values, energies, counts = (np.array(column) for column in zip(*known, strict=True))
    return float(np.average(values, weights=energies)), float(
        np.sqrt(energies.sum() / counts.sum())
    )
