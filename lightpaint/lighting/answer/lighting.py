"""The answer: named lights with their emissions."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby
from typing import Any

import numpy as np

from lightpaint import colour
from lightpaint.arrays import RGB, Bools, Doubles, Position, as_rgb
from lightpaint.basis import Basis, Lights
from lightpaint.dataframes import CHANNELS, by_channel, number, pandas, xarray
from lightpaint.display_text import Shown, brief, some_names, some_of
from lightpaint.errors import LightingError, UnknownLightError
from lightpaint.keywords import keywords
from lightpaint.lighting.answer.certificate import Certificate
from lightpaint.lighting.answer.lighting_keys import LightingKey, check_keys, key_span, weights_at
from lightpaint.scene.properties.site import EmitterPlace
from lightpaint.validation import BRIGHTEST, MAX_NAME, check_shape, is_amount

#: A number of each channel, None if undetermined; an interval of each.
Errors = tuple[float | None, float | None, float | None]
Ends = tuple[float, float]
Intervals = tuple[Ends | None, Ends | None, Ends | None]

#: Plugin and unit of a projector of one colour.
PROJECTOR = ("projector", "W/m²")

ALL_REACHED = (True, True, True)


@dataclass(frozen=True)
class LightSetting:
    """The setting of a light in a lighting.

    emission: linear RGB in `unit`, the parameter's own unit in Mitsuba.
    weight: RGB relative to one unit of the basis; the same numbers for one-colour lights.
    is_fixed: whether it stays as it is in the scene, with weight 1.
    members: names of the emitters it consists of; itself if none are given.
    unit_flux: watts it radiates per channel at an emission of 1; None if unknown.
    constraint: short text of its constraint in the solve; "" for none. is_active: whether the
    constraint held it back.
    reached: for each channel whether it reaches any counted pixel; if not, its emission is
    undetermined, and does not change.
    standard_error: of the emission, from the noise of the basis, if known; None in channels that
    reach nothing.
    interval: 95 % interval of each channel, lower and upper end; as standard_error.
    untold: whether the basis has too few samples to determine it.
    lamp: what mixes its emission from emitters. is_outside_gamut: whether it has a colour outside
    Rec.709 without that, in the scene. Channels of the emission of such lights, and only of these,
    may be negative.
    part_of: of an emitter that is a light, as in a basis of spectra, the name of its lamp. mix,
    mix_errors: of a lamp of such lights, the drives of its emitters and their standard errors; None
    where they follow from the emission. edited_mix: other drives that mix it than the lamp prefers,
    which somebody wrote into its file.
    mixed_emission: of a lamp with a colour wheel that shines, the emission that the solve found
    before the wheel came to a slot, unless the slot was fixed.
    solved_mix: the drives of its emitters that the solve
    found, where the lamp has others since, which leave the picture as it is. held_mix_change: the
    CIEDE2000 that few pixels of the picture would exceed with the mix that the lamp prefers, from
    which the picture holds it back; None where nothing does.
    """

    name: str
    plugin: str
    parameter: str
    unit: str
    emission: RGB
    weight: RGB
    is_fixed: bool = False
    members: tuple[str, ...] = ()
    unit_flux: RGB | None = None
    constraint: str = ""
    is_active: bool = False
    reached: tuple[bool, bool, bool] = ALL_REACHED
    standard_error: Errors | None = None
    interval: Intervals | None = None
    untold: bool = False
    lamp: colour.Lamp | None = None
    is_outside_gamut: bool = False
    part_of: str = ""
    mix: tuple[float, ...] | None = None
    mix_errors: tuple[float | None, ...] | None = None
    edited_mix: tuple[float, ...] | None = None
    mixed_emission: RGB | None = None
    solved_mix: tuple[float, ...] | None = None
    held_mix_change: float | None = None

    def __post_init__(self) -> None:
        if len(self.name) > MAX_NAME:
            raise LightingError(f"a light has a name of more than {MAX_NAME} characters")
        if not self.members:
            object.__setattr__(self, "members", (self.name,))
        if self.mixed_emission is not None and (self.lamp is None or not self.lamp.is_wheel):
            raise LightingError(f"light {self.name!r} has no colour wheel, and a colour for it")
        for drives in filter(None, (self.mix, self.edited_mix)):
            is_own = self.lamp is not None and len(drives) == len(self.lamp.emitters)
            if not is_own or not all(map(is_amount, drives)):
                raise LightingError(f"light {self.name!r} has drives that are not of its emitters")
        self._check_errors()
        values = {"emission": self.emission, "weight": self.weight}
        values |= {} if self.mixed_emission is None else {"mixed_emission": self.mixed_emission}
        for name, rgb in values.items():
            if not all(map(is_amount, map(abs, rgb) if self._may_be_negative else rgb)):
                raise LightingError(
                    f"light {self.name!r} has the {name} {list(rgb)}: need three numbers from 0 "
                    f"to {BRIGHTEST:g}"
                )
            if self.is_fixed and rgb != (1, 1, 1):
                raise LightingError(
                    f"light {self.name!r} is fixed, so its {name} must be 1 1 1, not {list(rgb)}"
                )
        if self.unit_flux and not all(map(is_amount, self.unit_flux)):
            raise LightingError(
                f"light {self.name!r} has the unit_flux {list(self.unit_flux)}: need three numbers "
                f"from 0 to {BRIGHTEST:g}"
            )

    @property
    def _may_be_negative(self) -> bool:
        return self.lamp is not None or self.is_outside_gamut

    @property
    def physical_emission(self) -> RGB:
        """Emission in the sense of `unit`: Mitsuba's projector gives a plane at distance 1 π times
        its parameter. The value of a lamp's emitter has the emitter's colour.
        """
        emission = self.emission
        if self.part_of and self.lamp is not None:
            [emitter] = self.lamp.emitters
            emission = as_rgb(emission[0] * color_of_emitter(emitter))
        if (self.plugin, self.unit) != PROJECTOR:
            return emission
        r, g, b = (math.pi * channel for channel in emission)
        return r, g, b

    def with_emission(self, emission: RGB, *, weight: RGB | None = None) -> "LightSetting":
        """Return the light at another emission, which no solve has found.

        It has no constraint and no error bars. What the basis cannot tell of it stays: channels
        that reach nothing, too few samples. weight: by default the same numbers. A lamp whose
        drives were the answer gets the drives of the nearest emission that it can mix.
        """
        if self.mix is not None and self.lamp is not None:
            return self.with_mix(self.lamp.drives_for(np.array(emission)))
        return self._changed(emission, emission if weight is None else weight)

    def with_mix(self, drives: Doubles) -> "LightSetting":
        """Return the lamp at other drives (e,) of its emitters, which no solve has found."""
        assert self.lamp is not None
        emission = as_rgb(self.lamp.mix(drives))
        return replace(self._changed(emission, emission), mix=tuple(drives.tolist()))

    def _changed(self, emission: RGB, weight: RGB) -> "LightSetting":
        return replace(
            self,
            emission=emission,
            weight=weight,
            mix=None,
            mix_errors=None,
            edited_mix=None,
            mixed_emission=None,
            solved_mix=None,
            held_mix_change=None,
            constraint="",
            is_active=False,
            standard_error=None,
            interval=None,
        )

    @cached_property
    def drives(self) -> Mapping[str, float]:
        """The drive of each of its emitters, 0 to 1, by name; empty without a lamp of emitters.

        The drives of its file, if somebody chose another mix there. Of an emission that they cannot
        mix, the drives of the nearest that they can.
        """
        if self.lamp is None:
            return {}
        if (given := self.mix or self.edited_mix) is not None:
            return dict(zip(self.lamp.names, given, strict=True))
        drives = self.lamp.drives_for(np.array(self.emission))
        return dict(zip(self.lamp.names, drives.tolist(), strict=True))

    @cached_property
    def drive_errors(self) -> Mapping[str, float | None]:
        """The standard error of each drive; None where it is unknown, and of a drive at 0 or full,
        which small errors do not move.
        """
        if self.mix_errors is not None:
            return dict(zip(self.drives, self.mix_errors, strict=True))
        if self.lamp is None or self.mix is not None or self.standard_error is None:
            return dict.fromkeys(self.drives)
        drives = np.array(list(self.drives.values()))
        errors = self.lamp.drive_errors(drives, self.standard_error)
        return dict(zip(self.drives, errors, strict=True))

    @property
    def watts(self) -> float | None:
        """Power of its emitters; None if the power of one is unknown."""
        known = [] if self.lamp is None else [x.watts for x in self.lamp.emitters]
        if not known or None in known:
            return None
        return sum(x * (w or 0.0) for x, w in zip(self.drives.values(), known, strict=True))

    @cached_property
    def powers(self) -> Doubles | None:
        """(81,), the spectrum of its emission; None if a spectrum of its emitters is unknown."""
        if self.lamp is None or self.lamp.powers_at_full is None:
            return None
        return np.asarray(np.array(list(self.drives.values())) @ self.lamp.powers_at_full)

    @cached_property
    def slot(self) -> str:
        """The name of the slot at which its colour wheel is; "" without a wheel, or while it is
        off.
        """
        lit = [name for name, drive in self.drives.items() if drive > 0]
        if self.lamp is None or not lit:
            return ""
        return lit[0] if self.lamp.is_wheel else self.lamp.behind

    @property
    def slot_delta_e(self) -> float | None:
        """The distance of the slot's colour from that which the solve asked for, in CIEDE2000 of a
        white surface; None where none was asked for, or the lamp is off.
        """
        if self.lamp is None or self.mixed_emission is None or not self.slot:
            return None
        return float(
            self.lamp.distances(np.array(self.mixed_emission))[self.lamp.names.index(self.slot)]
        )

    @property
    def is_partly_reached(self) -> bool:
        """True if some of its channels were solved for and others reach nothing."""
        return any(self.reached) and not all(self.reached)

    def _check_errors(self) -> None:
        errors = () if self.is_fixed else self.standard_error or ()
        if not all(e is None or is_amount(e) for e in errors):
            raise LightingError(
                f"light {self.name!r} has the standard error {list(errors)}: need three numbers "
                f"from 0 to {BRIGHTEST:g}, or null where it is unknown"
            )
        for ends in filter(None, self.interval or ()):
            least = -BRIGHTEST if self._may_be_negative else 0.0
            if not least <= ends[0] <= ends[1] <= BRIGHTEST:
                raise LightingError(
                    f"light {self.name!r} has the interval {list(ends)}: need two numbers, "
                    f"0 <= lower <= upper <= {BRIGHTEST:g}"
                )


@keywords()
@dataclass(frozen=True)
class Lighting(Shown, Mapping[str, LightSetting]):
    """Emissions for named lights: a mapping of their names to their settings, in their order.

    Attributes:
        lights: The setting of each light, in the order of the basis.
        target: Name of the painting.
        scene_identity: The identity of its scene.
        certificate: The certificate of the solve, if there was one.
        cd_per_unit: cd/m² for a radiance of 1, if given.
        places: Where emitters of its scene are, those that were moved and new ones with all that
            `relight` needs; none without a scene.
        up: The direction in the scene that is up, for pan and tilt.
        animation: The lights at painted frames of a shot over which they change, at least two, in
            order; none for lights that stay the same. `lights` are then the lights of the first
            key.
        observer: What saw its picture, if that was rendered with spectra.

    Examples:
        >>> lighting = lp.read_lighting("lighting.json")
        >>> lighting["panel"].emission
        (2.0, 1.5, 1.0)
        >>> "window" in lighting, len(lighting), list(lighting)
        (False, 2, ['panel', 'bulb'])
        >>> lighting.with_emission("panel", (1, 1, 1)).emission["panel"]
        (1, 1, 1)
    """

    lights: tuple[LightSetting, ...]
    target: str = ""
    scene_identity: str = ""
    certificate: Certificate | None = None
    cd_per_unit: float | None = None
    places: tuple[EmitterPlace, ...] = ()
    up: Position = (0.0, 1.0, 0.0)
    animation: tuple[LightingKey, ...] = ()
    observer: colour.Observer = colour.EYE

    def __repr__(self) -> str:
        rgb = [" ".join(f"{v:.4g}" for v in light.emission) for light in self.lights]
        texts = [
            f"{light.name} {emission}" for light, emission in zip(self.lights, rgb, strict=True)
        ]
        target = f" for {self.target}" if self.target else ""
        return f"Lighting({len(texts)} lights{target}: {some_of(texts, room=600)})"

    def __post_init__(self) -> None:
        names = [light.name for light in self.lights]
        if len(set(names)) != len(names):
            raise LightingError(f"light names repeat: {some_names(names)}")
        lamps = {x.part_of or x.name: x.members for x in self.lights}
        members = [name for names in lamps.values() for name in names]
        if len(set(members)) != len(members):
            raise LightingError(f"an emitter is in two lights: {some_names(sorted(members))}")
        scale = self.cd_per_unit
        if scale is not None and not 0 < scale <= BRIGHTEST:
            raise LightingError(
                f"a radiance of 1 stands for {scale:g} cd/m²: need a number > 0, at most "
                f"{BRIGHTEST:g}"
            )
        check_keys(self.animation, len(self.lights))

    def __getitem__(self, name: str) -> LightSetting:
        """Return the light of that name. Raises UnknownLightError, a KeyError, if there is none."""
        if not isinstance(name, str) or name not in self._by_name:
            raise UnknownLightError(
                f"no light {brief(name)} in the lighting: it has {some_of([*self], room=400)}"
            )
        return self._by_name[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._by_name)

    def __len__(self) -> int:
        return len(self.lights)

    @cached_property
    def _by_name(self) -> dict[str, LightSetting]:
        return {light.name: light for light in self.lights}

    @cached_property
    def members(self) -> Mapping[str, tuple[str, ...]]:
        """Names of the emitters of each light, by its name."""
        return {light.name: light.members for light in self.lights}

    @cached_property
    def fixed(self) -> frozenset[str]:
        """Names of the fixed lights."""
        return frozenset(light.name for light in self.lights if light.is_fixed)

    @cached_property
    def emission(self) -> Mapping[str, RGB]:
        """RGB emission by name of light."""
        return {light.name: light.emission for light in self.lights}

    def photometry(self, light: LightSetting) -> colour.Photometry:
        """Return colour, temperature and flux of one of its lights.

        The colour of a light that reaches something in some channels only is unknown.
        """
        measured = colour.photometry(
            light.physical_emission,
            unit=light.unit,
            unit_flux=light.unit_flux,
            cd_per_unit=self.cd_per_unit,
        )
        return measured.without_colour() if light.is_partly_reached else measured

    def to_dataframe(self) -> Any:
        """Return a pandas.DataFrame with a row for each light, by its name.

        red, green, blue: its emission, linear Rec.709 in `unit`. error_red: its standard error;
        lower_red, upper_red: the ends of the 95 % interval; likewise for the other channels, and
        NaN where they are unknown, as before an analysis (`analyse`, `error_bars`). y: luminance of
        the emission. kelvin, duv, hex: its colour, where it has one.
        Raises LightpaintError without pandas.
        """
        rows = [self._row(light) for light in self.lights]
        return pandas().DataFrame(rows, index=pandas().Index([*self], name="light"))

    def _row(self, light: LightSetting) -> dict[str, Any]:
        measured, nothing = self.photometry(light), (None, None, None)
        errors = [number(x) for x in light.standard_error or nothing]
        ends = [x or (math.nan, math.nan) for x in light.interval or nothing]
        return {
            **by_channel("", light.emission),
            "unit": light.unit,
            "y": measured.y,
            "kelvin": number(measured.kelvin),
            "duv": number(measured.duv),
            "hex": measured.hex,
            **by_channel("error", errors),
            **by_channel("lower", [x[0] for x in ends]),
            **by_channel("upper", [x[1] for x in ends]),
            "constraint": light.constraint,
            "is_active": light.is_active,
            "is_fixed": light.is_fixed,
            "untold": light.untold,
            "plugin": light.plugin,
            "members": ", ".join(light.members),
        }

    def to_xarray(self) -> Any:
        """Return an xarray.Dataset: emission, weight and error, (light, channel).

        error: standard error of the emission, NaN where unknown. Raises LightpaintError
        without xarray.
        """
        errors = [light.standard_error or (None, None, None) for light in self.lights]
        dims = ("light", "channel")
        return xarray().Dataset(
            {
                "emission": (dims, np.array([x.emission for x in self.lights], np.float64)),
                "weight": (dims, np.array([x.weight for x in self.lights], np.float64)),
                "error": (dims, np.array(errors, np.float64)),
            },
            coords={
                "light": [*self],
                "channel": list(CHANNELS),
                "unit": ("light", [x.unit for x in self.lights]),
            },
            attrs={"target": self.target},
        )

    def with_emission(self, name: str, emission: RGB) -> "Lighting":
        """Return the lighting with another RGB emission for one light, and without its certificate.

        Raises UnknownLightError if there is no such light.
        """
        old = self[name]
        # Somebody chose it, whatever the basis can tell of the light.
        chosen = replace(old.with_emission(emission), reached=ALL_REACHED, untold=False)
        lights = tuple(chosen if light is old else light for light in self.lights)
        return replace(self, lights=lights, animation=(), certificate=None)

    def at_frame(self, frame: float) -> "Lighting":
        """Return the lighting at a frame of its shot; unchanged if it is the same at all frames."""
        if not self.animation:
            return self
        pairs = zip(self.lights, weights_at(self.animation, frame), strict=True)
        lights = tuple(x if x.is_fixed else x.with_emission(as_rgb(w)) for x, w in pairs)
        return replace(self, lights=lights, animation=(), certificate=None)

    @cached_property
    def by_frame(self) -> Mapping[int, "Lighting"]:
        """The lighting at each frame from the first key to the last; none if it stays the same."""
        return {x: self.at_frame(x) for x in key_span(self.animation)} if self.animation else {}

    def of_lamps(self) -> "Lighting":
        """Return the lighting with a light for each lamp, also where emitters are lights.

        Without their lamps, as of a saved basis without a lights file, emitters stay lights.
        """
        if not any(light.part_of and light.lamp is not None for light in self.lights):
            return self
        groups = groupby(self.lights, key=lambda light: light.part_of or light.name)
        return replace(self, lights=tuple(whole_lamp(tuple(parts)) for _, parts in groups))

    def for_target(self, target: str) -> "Lighting":
        """Return the lighting as the answer to that target."""
        return replace(self, target=target)

    def with_certificate(self, certificate: Certificate | None) -> "Lighting":
        """Return the lighting with this certificate."""
        return replace(self, certificate=certificate)

    @classmethod
    def of_weights(
        cls,
        lights: Basis | Lights,
        weights: Doubles,
        *,
        labels: Sequence[tuple[str, bool]] | None = None,
        reached: Bools | None = None,
        lamps: Mapping[int, colour.Lamp] | None = None,
        mixed_emissions: Mapping[int, RGB] | None = None,
        **fields: Any,
    ) -> "Lighting":
        """Make a lighting of weights (n, 3) in the order of `lights`, which may be the lights of a
        basis.

        labels: for each light its `constraint` and whether this `is_active`. reached: (n, 3).
        lamps: what mixes a light from emitters, by the light's index. mixed_emissions: see
        `LightSetting`.
        """
        if isinstance(lights, Basis):
            fields.setdefault("scene_identity", lights.origin.scene_identity)
            lights = lights.lights
        count = len(lights)
        check_shape("weights", weights, (count, 3), "a row per light", error=LightingError)
        is_reached = np.ones((count, 3), dtype=bool) if reached is None else reached
        check_shape("reached", is_reached, (count, 3), "a row per light", error=LightingError)
        columns = lights, map(as_rgb, weights), labels or [("", False)] * count, is_reached.tolist()
        settings = tuple(
            # One unit of weight is unit-white emission, so that here the two are the same numbers.
            LightSetting(
                light.name,
                light.plugin,
                light.parameter,
                light.unit,
                emission=weight,
                weight=weight,
                is_fixed=light.is_fixed,
                members=light.members,
                unit_flux=light.unit_flux,
                constraint=constraint,
                is_active=is_active,
                reached=(red, green, blue),
                lamp=(lamps or {}).get(k),
                is_outside_gamut=light.is_outside_gamut,
                part_of=light.lamp,
                mixed_emission=(mixed_emissions or {}).get(k),
            )
            for k, (light, weight, (constraint, is_active), (red, green, blue)) in enumerate(
                zip(*columns, strict=True)
            )
        )
        return cls(settings, **fields)

    @classmethod
    def current(cls, basis: Basis) -> "Lighting":
        """Return the current lighting of the scene."""
        return cls.of_weights(basis, basis.current_weights)

    def weights_for(self, lights: Basis | Lights) -> Doubles:
        """Return weights (n, 3) in the order of `lights`, which may be the lights of a basis.

        Raises LightingError if the two do not name the same lights.
        """
        if isinstance(lights, Basis):
            lights = lights.lights
        settings = self.lights
        if any(light.lamp for light in lights):
            settings = tuple(part for light in settings for part in parts_of(light))
        by_name = {light.name: light.weight for light in settings}
        members = {light.name: light.members for light in settings}
        if set(by_name) != set(lights.names):
            missing = sorted(set(lights.names) - set(by_name))
            unknown = sorted(set(by_name) - set(lights.names))
            raise LightingError(
                "lighting and basis name different lights: "
                f"missing {some_names(missing) or 'none'}; unknown {some_names(unknown) or 'none'}"
            )
        for light in lights:
            if set(light.members) != set(members[light.name]):
                raise LightingError(
                    f"light {light.name!r} is not the same in both: of "
                    f"{some_names(members[light.name])} in the lighting, of "
                    f"{some_names(light.members)} in the basis"
                )
        return np.array([by_name[name] for name in lights.names], dtype=np.float64)


def whole_lamp(parts: Sequence[LightSetting]) -> LightSetting:
    """Return the lamp of emitters that are lights, or a light that is not one of these."""
    first = parts[0]
    if not first.part_of:
        return first
    emitters = [in_own_color(x.lamp.emitters[0]) for x in parts if x.lamp is not None]
    assert first.lamp is not None
    lamp = replace(first.lamp, emitters=tuple(emitters), power_share=None)
    if (own_share := first.lamp.power_share) is not None:
        lamp = replace(lamp, power_share=own_share * float(lamp.powers[0]))
    drives = np.array([x.emission[0] for x in parts]) / lamp.levels
    errors = [None if x.standard_error is None else x.standard_error[0] for x in parts]
    emission = as_rgb(lamp.mix(drives))
    solved = [x.solved_mix or (drive,) for x, drive in zip(parts, drives.tolist(), strict=True)]
    return replace(
        first,
        name=first.part_of,
        emission=emission,
        weight=emission,
        is_active=any(x.is_active for x in parts),
        reached=ALL_REACHED,
        standard_error=None,
        interval=None,
        untold=any(x.untold for x in parts),
        lamp=lamp,
        part_of="",
        mix=tuple(drives.tolist()),
        solved_mix=tuple(x for [x] in solved) if any(x.solved_mix for x in parts) else None,
        mix_errors=tuple(
            None if x is None else float(x / y) for x, y in zip(errors, lamp.levels, strict=True)
        ),
    )


def parts_of(light: LightSetting) -> tuple[LightSetting, ...]:
    """Return a light for each emitter of a lamp, as a basis of spectra has them."""
    if light.lamp is None or light.part_of or light.is_fixed:
        return (light,)
    levels = (np.array(list(light.drives.values())) * light.lamp.levels).tolist()
    return tuple(
        replace(
            light,
            name=f"{light.name}/{emitter.name}",
            emission=(level, level, level),
            weight=(level, level, level),
            lamp=None,
            part_of=light.name,
            mix=None,
            mix_errors=None,
            edited_mix=None,
            solved_mix=None,
            standard_error=None,
            interval=None,
        )
        for emitter, level in zip(light.lamp.emitters, levels, strict=True)
    )


def in_own_color(emitter: colour.LampEmitter) -> colour.LampEmitter:
    """Return an emitter, whose emission has its luminance in each channel, in its own colour."""
    return replace(emitter, emission=as_rgb(emitter.emission[0] * color_of_emitter(emitter)))


def color_of_emitter(emitter: colour.LampEmitter) -> Doubles:
    """Return the colour of an emitter's spectrum, (3,), of luminance 1."""
    assert emitter.spectrum is not None
    color = colour.rgb_of_powers(emitter.spectrum)
    return np.asarray(color / colour.luminance(color))
