"""Lights as users adjust them: one emitter, or several sharing one weight."""

import itertools
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import RGB
from lightpaint.colour import Lamp, Spectrum, luminance
from lightpaint.display_text import some_names
from lightpaint.errors import SceneError
from lightpaint.scene.lights.emitters import Emitter
from lightpaint.scene.lights.image_split import with_texels
from lightpaint.scene.plane_identity import combined_identity
from lightpaint.scene.properties.emission import AS_AUTHORED, MULTIPLE, EmitterSetting, Scaling
from lightpaint.sentences import Hint

#: Parameter of a light whose emission is a multiple of that in the scene.
WHOLE_EMISSION = "emission"

BLACK: RGB = (0.0, 0.0, 0.0)


def free_names(stem: str, count: int, taken: Collection[str]) -> list[str]:
    """Return the first `count` of `stem_1`, `stem_2` … that are not taken."""
    numbered = (f"{stem}_{k}" for k in itertools.count(1))
    return list(itertools.islice((name for name in numbered if name not in taken), count))


@dataclass(frozen=True)
class Light:
    """A light as users adjust it: one emitter, or several sharing one weight.

    parameter, unit: what a weight means. With the unit MULTIPLE the weight multiplies each member's
    own emission; with any other unit it is the emission of each member.
    emission: current RGB emission in `unit`.
    is_scalar: whether it has one weight for all channels instead of three. is_fixed: whether it is
    the light of all emitters that stay as they are, with weight 1. is_found: whether its members
    were grouped automatically because they are many, similar and unnamed. lamp, spectrum: of an
    emitter of a lamp in a render with spectra, the name of the lamp's light and its spectrum; the
    weight is then the luminance of its emission.
    """

    name: str
    members: tuple[Emitter, ...]
    parameter: str
    unit: str
    emission: RGB
    is_scalar: bool = False
    is_fixed: bool = False
    is_found: bool = False
    lamp: str = ""
    spectrum: Spectrum | None = None

    def __repr__(self) -> str:
        emission = " ".join(f"{v:.4g}" for v in self.emission)
        note = ", fixed" if self.is_fixed else ""
        count_text = "" if len(self.members) == 1 else f", {len(self.members)} emitters"
        description = f"{self.plugin} {self.parameter} {emission} {self.unit}"
        return f"Light({self.name!r}, {description}{count_text}{note})"

    @property
    def member_names(self) -> tuple[str, ...]:
        """Names of its emitters."""
        return tuple(member.name for member in self.members)

    @property
    def plugin(self) -> str:
        """Mitsuba's name of the emitter plugin; `area + point` if its members differ."""
        return " + ".join(dict.fromkeys(member.plugin for member in self.members))

    @property
    def form(self) -> str:
        """Position and size as text; for several emitters, their names."""
        if len(self.members) == 1:
            return self.members[0].form
        return f"{len(self.members)} emitters: {some_names(self.member_names)}"

    @property
    def unit_flux(self) -> RGB | None:
        """Watts per channel of all members together at an emission of 1.

        None if the flux of any member is unknown, or if a channel is negative.
        """
        total = [0.0, 0.0, 0.0]
        for member in self.members:
            if member.unit_flux is None:
                return None
            for k, emission in enumerate(self.emission_of(member, (1.0, 1.0, 1.0))):
                total[k] += emission * member.unit_flux
        return None if min(total) < 0 else (total[0], total[1], total[2])

    def identity(self, unlit_content: str) -> str:
        """Return the identity of its image at unit emission, in a scene with this `unlit_content`.

        Lights whose images are equal up to noise have equal identities, whatever their names and
        brightness. "" if a member is not in a file.
        """
        if self.is_fixed:
            digests = [m.digest and m.digest.as_is for m in self.members]
        elif self.unit == MULTIPLE:
            own = [self.emission_of(member, AS_AUTHORED) for member in self.members]
            digests = [
                m.digest and f"{m.digest.unit} {x}" for m, x in zip(self.members, own, strict=True)
            ]
        else:
            digests = [m.digest and m.digest.unit for m in self.members]
        if None in digests:
            return ""
        own_digests = sorted(map(str, digests))
        facts = () if self.spectrum is None else ("spectrum", self.spectrum)
        return combined_identity(unlit_content, self.is_fixed, self.unit, own_digests, *facts)

    def with_emission(self, emission: RGB) -> "Light":
        """Return this light with another current emission, which its members have."""
        members = tuple(replace(m, emission=self.emission_of(m, emission)) for m in self.members)
        return replace(self, members=members, emission=emission)

    def emission_of(self, member: Emitter, emission: RGB) -> RGB:
        """Return the emission of `member` in its own unit when this light has `emission`."""
        if self.unit != MULTIPLE:
            return emission
        # One that is dark now beside others that are not keeps that proportion.
        own = BLACK if member.is_dark and any(self.emission) else member.emission
        r, g, b = (w * factor for w, factor in zip(emission, own, strict=True))
        return r, g, b


def tie(name: str, members: Sequence[Emitter]) -> Light:
    """Return a light called `name` whose emitters share one weight.

    If all have the same colour in the same unit, or all are black, the weight is that colour.
    Otherwise it is a factor, and the emitters keep their proportions; those that are dark beside
    others stay dark. Raises SceneError if all are
    black and of different kinds, so that their proportions are undefined.
    """
    kinds = {member.kind for member in members}
    first = members[0]
    is_colour = len(kinds) == 1 and first.kind is not None and _is_colour(first)
    if is_colour and len({member.emission for member in members}) == 1:
        assert first.kind is not None
        return Light(name, tuple(members), first.kind.parameter, first.kind.unit, first.emission)
    if not any(any(member.emission) for member in members):
        members_text = some_names(f"{m.name} ({m.plugin})" for m in members)
        raise SceneError(
            f"group {name!r} has only black lights of different kinds, {members_text}, so their "
            "relative brightness is unknown: give one of them a colour"
        )
    parameters = {member.kind.parameter for member in members if member.kind is not None}
    return Light(
        name,
        tuple(members),
        parameters.pop() if len(parameters) == 1 else WHOLE_EMISSION,
        MULTIPLE,
        BLACK if all(member.is_dark for member in members) else AS_AUTHORED,
        is_scalar=any(kind is not None and kind.is_scalar for kind in kinds),
    )


def _is_colour(emitter: Emitter) -> bool:
    return emitter.kind is not None and emitter.kind.scaling is Scaling.COLOUR


def keep(name: str, emitters: Sequence[Emitter]) -> Light:
    """Return a fixed light called `name` with all `emitters` that stay as they are."""
    return Light(name, tuple(emitters), WHOLE_EMISSION, MULTIPLE, AS_AUTHORED, is_fixed=True)


def lights_of(
    emitters: Sequence[Emitter], members: Mapping[str, Sequence[str]], fixed: Collection[str]
) -> tuple[Light, ...]:
    """Return the lights `members`, emitters by the name of their light; those in `fixed` are fixed.

    Raises SceneError if a light to adjust has an emitter that cannot be scaled.
    """
    by_name = {emitter.name: emitter for emitter in emitters}
    lights = []
    for name, names in members.items():
        light_emitters = sorted((by_name[n] for n in names), key=lambda emitter: emitter.node)
        if name not in fixed:
            check_adjustable(light_emitters)
        lights.append(keep(name, light_emitters) if name in fixed else tie(name, light_emitters))
    return tuple(sorted(lights, key=lambda light: (light.is_fixed, light.members[0].node)))


def regrouped(
    lights: Sequence[Light], emitters: Sequence[Emitter], more: Iterable[str]
) -> tuple[Light, ...]:
    """Return `lights` with `emitters`, which have the names of theirs.

    more: names of emitters that become lights of their own.
    """
    members: dict[str, Sequence[str]] = {light.name: light.member_names for light in lights}
    members |= {name: [name] for name in more}
    fixed = [light.name for light in lights if light.is_fixed]
    found_names = {light.name for light in lights if light.is_found}
    new_lights = lights_of(emitters, members, fixed)
    return tuple(replace(light, is_found=light.name in found_names) for light in new_lights)


def light_named(name: str, lights: Sequence[Light], *, scene: str) -> Light:
    """Return the light called `name`. Raises SceneError if it does not exist."""
    for light in lights:
        if light.name == name:
            return light
    raise SceneError(f"{scene} has no light {name!r}: it has {some_names(x.name for x in lights)}")


def settings_for(
    lights: Sequence[Light],
    emitters: Sequence[Emitter],
    emission: Mapping[str, RGB],
    *,
    scene: str,
    evenly: bool = False,
) -> dict[int, EmitterSetting]:
    """Return emitter settings by node. emission: emission by light name. evenly: see
    `with_texels`.
    """
    by_name: dict[str, EmitterSetting] = {}
    for name, rgb in emission.items():
        light = light_named(name, lights, scene=scene)
        if not light.is_fixed:
            by_name |= {m.name: _setting(m, light.emission_of(m, rgb)) for m in light.members}
        elif not any(rgb):
            by_name |= {m.name: _setting(m, rgb) for m in light.members}
        elif tuple(rgb) != AS_AUTHORED:
            raise SceneError(
                f"the fixed light can be loaded black or unchanged, not multiplied by {rgb}"
            )
    settings = with_texels(by_name, emitters, evenly=evenly)
    sampling_weights = {emitter.node: emitter.sampling_weight for emitter in emitters}
    if not any(
        (sampling_weights | {node: x.sampling_weight for node, x in settings.items()}).values()
    ):
        # Mitsuba rejects a scene without any sampled emitter. So sample black emitters, or the one
        # that is hit by chance if there are no others.
        by_chance = {emitter.node for emitter in emitters if emitter.hit_by_chance}
        for node in settings.keys() - by_chance or settings.keys():
            settings[node] = replace(settings[node], sampling_weight=sampling_weights[node] or 1.0)
    return settings


def _setting(emitter: Emitter, rgb: RGB) -> EmitterSetting:
    # An emitter with sampling weight 0 in the scene is sampled again when it emits light.
    weight = (emitter.sampling_weight or 1.0) if any(rgb) and not emitter.hit_by_chance else 0.0
    return EmitterSetting(emitter.kind, rgb, weight)


def check_adjustable(emitters: Iterable[Emitter]) -> None:
    """Raise SceneError if an emitter cannot be scaled."""
    for emitter in emitters:
        if emitter.obstacle:
            raise SceneError(
                f"light {emitter.name!r} {emitter.obstacle}, so it can only stay as it is"
            )


def check_grouping(
    members: Mapping[str, Sequence[str]], emitters: Sequence[Emitter], *, scene: str
) -> None:
    """Raise SceneError unless `members` name every emitter, and nothing else, once."""
    grouped = [name for names in members.values() for name in names]
    existing = {emitter.name for emitter in emitters}
    if set(grouped) != existing:
        raise SceneError(
            f"{scene} does not have the expected emitters: it lacks "
            f"{some_names(sorted(set(grouped) - existing)) or 'none'} and also has "
            f"{some_names(sorted(existing - set(grouped))) or 'none'}"
        )
    if len(grouped) > len(existing) or not all(members.values()):
        raise SceneError(
            f"every emitter belongs to one light, and every light has one: not so in {members}"
        )


def emitter_named(
    name: str, emitters: Sequence[Emitter], lights: Sequence[Light], *, scene: str
) -> Emitter:
    """Return the emitter called `name`, or the only emitter of the light called `name`."""
    if emitter := next((x for x in emitters if x.name == name), None):
        return emitter
    light = light_named(name, lights, scene=scene)
    if len(light.members) > 1:
        raise SceneError(
            f"light {name!r} is {len(light.members)} emitters: move one of them, "
            f"{some_names(light.member_names)}"
        )
    return light.members[0]


def black_emitters(
    emitters: Sequence[Emitter], lights: Sequence[Light]
) -> tuple[tuple[Emitter, ...], dict[int, EmitterSetting]]:
    """Return all emitters, those outside `lights` black, and the settings of these by node."""
    members = {member.name for light in lights for member in light.members}
    # If nothing else may be sampled, black emitters are, since Mitsuba needs at least one.
    can_be_sampled = any(not m.hit_by_chance for light in lights for m in light.members)
    lit_nodes = {m.node for light in lights for m in light.members}
    settings = {
        x.node: EmitterSetting(x.kind, BLACK, 0.0 if can_be_sampled else x.sampling_weight)
        for x in emitters
        if x.node not in lit_nodes
    }
    all_emitters = tuple(
        x
        if x.name in members
        else replace(x, emission=BLACK, sampling_weight=settings[x.node].sampling_weight)
        if x.node in settings
        else replace(x, emission=BLACK)  # a texel beside one that is lit
        for x in emitters
    )
    return all_emitters, settings


def lights_of_lamps(
    lights: Sequence[Light], lamps: Mapping[str, Lamp], *, scene: str
) -> tuple[Light, ...]:
    """Return `lights`, with each emitter of a lamp in the place of the lamp's light.

    Such a light is called `LAMP/EMITTER`, has one weight, the luminance of its emission, and shines
    as in the nearest mix to what the scene shows. lamps: by name of light. Raises SceneError for a
    light that is adjusted and has no lamp of spectra, or that is an image.
    """
    found: list[Light] = []
    for light in lights:
        if light.is_fixed:
            found.append(light)
            continue
        _check_lamp(light, lamps.get(light.name), scene)
        lamp = lamps[light.name]
        now = lamp.drives_for(np.array(light.emission))
        for emitter, drive in zip(lamp.emitters, now.tolist(), strict=True):
            level = drive * float(luminance(np.array(emitter.emission)))
            found.append(
                replace(
                    light,
                    name=part_name(light.name, emitter.name),
                    emission=(level, level, level),
                    is_scalar=True,
                    lamp=light.name,
                    spectrum=emitter.spectrum,
                )
            )
    names = [light.name for light in found]
    if repeated := {name for name in names if names.count(name) > 1}:
        raise SceneError(f"{scene} has two lights called {some_names(sorted(repeated))}")
    return tuple(found)


def part_name(lamp: str, emitter: str) -> str:
    """Return the name of the light of an emitter of a lamp."""
    return f"{lamp}/{emitter}"


def _check_lamp(light: Light, lamp: Lamp | None, scene: str) -> None:
    if light.unit == MULTIPLE:
        raise SceneError(
            f"{scene}: light {light.name!r} is an image, or several lights of different colours, "
            "and renders with spectra adjust lights of one colour: keep it as it is, by ",
            Hint("lights"),
        )
    missing = [] if lamp is None else [x.name for x in lamp.emitters if x.spectrum is None]
    if lamp is None or missing:
        what = "no emitters" if lamp is None else f"no spectrum of {some_names(missing)}"
        raise SceneError(
            f"{scene}: the lights file has {what} for light {light.name!r}, and a render with "
            "spectra needs them: add them, or keep the light as it is, by ",
            Hint("lights"),
        )
