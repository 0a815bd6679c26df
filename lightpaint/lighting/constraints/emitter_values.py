"""Emitters of lamps as people write them in a lights file: colours, brightness, bounds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from lightpaint import colour
from lightpaint.arrays import RGB, Doubles, as_rgb
from lightpaint.basis import BasisLight
from lightpaint.errors import ColorError, ConstraintError
from lightpaint.files import one_line
from lightpaint.lighting.constraints.values import check_keys
from lightpaint.luminaires import FULL
from lightpaint.sentences import Hint, SourceKey
from lightpaint.validation import BRIGHTEST, MAX_NAME, is_number

#: Keys of an emitter: of its colour, one of which it needs, and of its brightness at full.
COLORS, AMOUNTS = ("xy", "rgb", "spectrum"), ("Y", "cd", "lm")
EMITTER_KEYS = ("name", *COLORS, *AMOUNTS, "max", "bits", "watts")

#: Keys of a slot of a colour wheel beside emitters that mix.
SLOT_KEYS = ("name", "transmission")

#: Bits of the channels of fixtures.
BITS = (8, 16, 24)


@dataclass(frozen=True)
class EmitterRequest:
    """An emitter of a lights file.

    color: of luminance 1; channels may be negative. amount: at full, as `per` says: the luminance
    of its emission in the unit of the light, candelas, or lumens. spectrum: None if only its colour
    is known.
    """

    name: str
    color: RGB
    amount: float
    per: Literal["Y", "cd", "lm"]
    most: float
    bits: int
    watts: float | None
    where: SourceKey
    spectrum: colour.Spectrum | None = None

    def in_light(self, light: BasisLight, cd_per_unit: float | None) -> colour.LampEmitter:
        """Return the emitter with its emission in the unit of a light.

        cd_per_unit: cd/m² of a radiance of 1. Raises ConstraintError if candelas or lumens say
        nothing about this light.
        """
        level = self.amount
        # Keys of a luminaire hold for each of a group.
        count = len(light.members) if light.unit == FULL else 1
        if self.per != "Y":
            level *= count / self._amount_of_one(light, cd_per_unit)
        emission = as_rgb(level * np.array(self.color))
        watts = None if self.watts is None else count * self.watts
        return colour.LampEmitter(
            self.name, emission, self.most, self.bits, watts, spectrum=self.spectrum
        )

    def _amount_of_one(self, light: BasisLight, cd_per_unit: float | None) -> float:
        """Return the candelas or lumens of an emission of luminance 1."""
        if cd_per_unit is None:
            raise ConstraintError(
                self.where,
                f" is in {self.per}, and nothing says how much light an emission of 1 is: add "
                "cd_per_unit to the lights file, pass ",
                Hint("cd_per_unit"),
                ", or give Y in the scene's unit",
            )
        white = colour.photometry(
            (1, 1, 1), unit=light.unit, unit_flux=light.unit_flux, cd_per_unit=cd_per_unit
        )
        found = white.flux_lm
        if self.per == "cd":
            # A panel's intensity straight ahead is the intensity of its flux by Lambert's law.
            lambert = None if white.flux_lm is None else white.flux_lm / np.pi
            found = {"cd": white.luminous, "cd/m²": lambert}.get(white.luminous_unit)
        if not found:
            raise ConstraintError(
                self.where,
                f" is in {self.per}, which {light.name!r}, a {light.plugin}, does not have: give "
                "Y, the luminance of its emission at full",
            )
        return float(found)


def parse_emitters(table: Mapping[str, Any], light: SourceKey) -> tuple[EmitterRequest, ...]:
    """Return the emitters of a light, none if its table has none. Raises ConstraintError."""
    if "emitters" not in table:
        return ()
    value, where = table["emitters"], light / "emitters"
    is_list = isinstance(value, Sequence) and not isinstance(value, str)
    if not is_list or not value or not all(isinstance(x, Mapping) for x in value):
        raise ConstraintError(
            where,
            f" is {one_line(repr(value))}: expected a list of emitters, "
            '[{name = "red", xy = [0.69, 0.31], cd = 900}]',
        )
    is_wheel = bool(table.get("wheel")) and not has_slots(table)
    if len(value) > (most := colour.MAX_SLOTS if is_wheel else colour.MAX_EMITTERS):
        kind, what = ("slots", "be on a wheel") if is_wheel else ("emitters", "be mixed")
        raise ConstraintError(where, f" lists {len(value)} {kind}: at most {most} can {what}")
    emitters = tuple(_parse_emitter(x, where / str(k + 1)) for k, x in enumerate(value))
    _check_names([x.name for x in emitters], "emitters", where)
    return emitters


def has_slots(table: Mapping[str, Any]) -> bool:
    """Return whether a wheel is given by its slots, in front of emitters that mix."""
    return isinstance(table.get("wheel"), list | tuple)


def parse_slots(table: Mapping[str, Any], light: SourceKey) -> tuple[colour.SlotFilter, ...]:
    """Return the slots of a wheel in front of emitters, none without one. Raises
    ConstraintError."""
    if not has_slots(table):
        return ()
    value, where = table["wheel"], light / "wheel"
    if not 0 < len(value) <= colour.MAX_SLOTS or not all(isinstance(x, Mapping) for x in value):
        raise ConstraintError(
            where,
            f" is {one_line(repr(value))}: expected a list of at most {colour.MAX_SLOTS} slots, "
            '[{name = "congo", transmission = [0.1, 0.02, 0.6]}]',
        )
    slots = tuple(_parse_slot(x, where / str(k + 1)) for k, x in enumerate(value))
    _check_names([x.name for x in slots], "slots", where)
    return slots


def _check_names(names: Sequence[str], kind: str, where: SourceKey) -> None:
    """Raise ConstraintError for a name that two emitters or slots have."""
    if repeated := [name for name in names if names.count(name) > 1]:
        raise ConstraintError(
            where, f" has two {kind} named {repeated[0]!r}: give each a name of its own"
        )


def _parse_slot(table: Mapping[str, Any], where: SourceKey) -> colour.SlotFilter:
    check_keys(table, SLOT_KEYS, where)
    name, passed = table.get("name"), table.get("transmission")
    if not isinstance(name, str) or not 0 < len(name.strip()) <= MAX_NAME:
        raise ConstraintError(where / "name", f' is {one_line(repr(name))}: expected "congo"')
    is_list = isinstance(passed, list | tuple) and len(passed) == 3
    if not is_list or not all(is_number(x) and 0 <= x <= 1 for x in passed or ()):
        raise ConstraintError(
            where / "transmission",
            f" is {one_line(repr(passed))}: expected the shares of red, green and blue of BT.2020 "
            "that it lets through, [0.1, 0.02, 0.6]",
        )
    return colour.SlotFilter(name.strip(), as_rgb(np.array(passed, np.float64)))


def _parse_emitter(table: Mapping[str, Any], where: SourceKey) -> EmitterRequest:
    check_keys(table, EMITTER_KEYS, where)
    if "name" not in table:
        raise ConstraintError(where, ' has no name: give it one, such as name = "red"')
    name = table["name"]
    if not isinstance(name, str) or not 0 < len(name.strip()) <= MAX_NAME:
        raise ConstraintError(where / "name", f' is {one_line(repr(name))}: expected "red"')
    color_keys = [key for key in COLORS if key in table]
    if len(color_keys) != 1:
        found = " and ".join(color_keys) or "no colour"
        raise ConstraintError(where, f" has {found}: expected one of {', '.join(COLORS)}")
    amounts = [key for key in AMOUNTS if key in table]
    if len(amounts) > 1:
        raise ConstraintError(where, f" has {' and '.join(amounts)}: expected one of them")
    key, spectrum = color_keys[0], None
    if key == "spectrum":
        color, spectrum = _parse_spectrum(table[key], where / key)
    else:
        color = _parse_color(key, table[key], where / key)
    size = float(colour.luminance(color))
    if not amounts and key != "rgb":
        raise ConstraintError(
            where,
            " does not say how bright it is at full: add cd, lm, or Y, the luminance of its "
            "emission in the scene's unit",
        )
    per: Any = amounts[0] if amounts else "Y"
    amount = _positive(table, per, where) if amounts else size
    bits = table.get("bits", 8)
    if type(bits) is not int or bits not in BITS:
        raise ConstraintError(where / "bits", f" is {bits!r}: expected 8, 16 or 24")
    most = _positive(table, "max", where, most=1.0) if "max" in table else 1.0
    watts = _positive(table, "watts", where) if "watts" in table else None
    unit_color = as_rgb(color / size)
    return EmitterRequest(name.strip(), unit_color, amount, per, most, bits, watts, where, spectrum)


def _positive(
    table: Mapping[str, Any], key: str, where: SourceKey, *, most: float = BRIGHTEST
) -> float:
    value = table[key]
    if not (is_number(value) and 0 < value <= most):
        limit = f", at most {most:g}" if most < BRIGHTEST else ""
        raise ConstraintError(where / key, f" is {one_line(repr(value))}: expected > 0{limit}")
    return float(value)


def _parse_color(key: str, value: Any, where: SourceKey) -> Doubles:
    """Return the linear Rec.709 colour (3,) of an emitter, with a luminance > 0."""
    numbers = value if isinstance(value, Sequence) and not isinstance(value, str) else []
    count = 2 if key == "xy" else 3
    if len(numbers) != count or not all(is_number(x) and abs(x) <= BRIGHTEST for x in numbers):
        expected = "x and y of CIE 1931, [0.69, 0.31]" if key == "xy" else "three numbers"
        raise ConstraintError(where, f" is {one_line(repr(value))}: expected {expected}")
    if key == "xy":
        x, y = map(float, numbers)
        if not (0 <= x <= 1 and 0 < y <= 1 and x + y <= 1):
            raise ConstraintError(where, f" is {list(numbers)}: no colour has this x and y")
        return _of_xyz(np.array([x / y, 1, (1 - x - y) / y]))
    color = np.array(numbers, np.float64)
    if colour.luminance(color) <= 0:
        raise ConstraintError(
            where, f" is {list(numbers)}, whose luminance is not above 0: no light has this colour"
        )
    return color


def _of_xyz(xyz: Doubles) -> Doubles:
    return np.asarray(np.linalg.solve(colour.rgb_to_xyz(colour.REC709), xyz))


def _parse_spectrum(value: Any, where: SourceKey) -> tuple[Doubles, colour.Spectrum]:
    """Return the colour of a spectrum under the CIE's standard observer of 1931, of luminance 1,
    and the spectrum.

    value: pairs of nanometres and power, or the name of a light or a file; relative to the lights
    file.
    """
    try:
        if isinstance(value, str):
            is_file = where.source.endswith(".toml")
            folder = Path(where.source).parent if is_file else Path()
            waves, powers = colour.named_spectrum(value, folder)
        else:
            waves, powers = _pairs(value, where)
        # Between its points a spectrum is straight, and dark beyond them.
        metres, observer = colour.matching_functions()
        xyz = np.interp(metres * 1e9, waves, powers, left=0, right=0) @ observer
        return _of_xyz(xyz / max(xyz[1], 1e-300)), colour.spectrum_of(waves, powers)
    except ColorError as error:
        raise ConstraintError(where, ": " if isinstance(value, str) else " ", error) from None


def _pairs(value: Any, where: SourceKey) -> tuple[Doubles, Doubles]:
    """Return nanometres and power, (k,) each, of a list of pairs. Raises ColorError for one that a
    table could not have, either.
    """
    is_list = isinstance(value, Sequence)
    pairs = [
        (float(pair[0]), float(pair[1]))
        for pair in (value if is_list else [])
        if isinstance(pair, Sequence) and len(pair) == 2 and all(map(is_number, pair))
    ]
    is_bright = any(abs(power) > BRIGHTEST for _, power in pairs)
    if not is_list or not pairs or len(pairs) != len(value) or is_bright:
        raise ConstraintError(
            where,
            " is not a spectrum: expected pairs of nanometres and power, [[400, 0], [620, 0.1], "
            "[632, 1], [644, 0.1], [700, 0]]; or the name of a file or a light, "
            '"led.csv", "spot.gdtf:Red", "3200K blackbody"',
        )
    waves, powers = colour.measured_points(pairs)
    return waves, powers[:, 0]
