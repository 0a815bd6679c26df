"""A rig as a console sees it: fixtures, their lights, and the channels that control them.

Lengths are in metres, z is up. Colours are linear Rec.709 and may be negative: LEDs lie outside it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from lightpaint.arrays import RGB, Position
from lightpaint.colour import SlotFilter, Spectrum
from lightpaint.display_text import some_names
from lightpaint.errors import RigError

#: Channels of a universe.
UNIVERSE_SIZE = 512


@dataclass(frozen=True)
class DmxChannel:
    """A channel of a fixture's mode.

    attribute, geometry: what it controls, as GDTF names it (ColorAdd_R, Beam).
    offsets: the places of its bytes from the fixture's address, the coarse one first, from 1.
    dmx_break: the address that they count from, from 1.
    default: its level at rest, of all its bytes.
    curve: pairs of a share of its highest level and the share of what it controls that this gives,
    the shares rising from 0 to 1; straight if there are none.
    """

    attribute: str
    geometry: str
    offsets: tuple[int, ...]
    dmx_break: int = 1
    default: int = 0
    curve: tuple[tuple[float, float], ...] = ()

    @property
    def highest(self) -> int:
        """Its highest level."""
        return int(256 ** len(self.offsets) - 1)


@dataclass(frozen=True)
class RigEmitter:
    """Light sources of one colour in a light, such as its red LEDs, which dim together.

    xy: chromaticity of CIE 1931. candela: luminous intensity at full, in the middle of the beam.
    channels: places, among the channels of the fixture, of all channels that set it.
    curve: pairs of a share of what its channels control and the share of light that this gives,
    from (0, 0) to (1, 1), both rising; straight if there are none.
    watts: power at full, if known. spectrum: if it was measured.
    """

    name: str
    xy: tuple[float, float]
    candela: float
    channels: tuple[int, ...]
    curve: tuple[tuple[float, float], ...] = ()
    watts: float | None = None
    spectrum: Spectrum | None = None


@dataclass(frozen=True)
class RigFilter:
    """A filter of a light that moves in without steps, such as cyan.

    density: optical density (natural logarithm) of all of it for red, green and blue; of a part of
    it in proportion. channels: places of all channels that set it.
    """

    name: str
    density: RGB
    channels: tuple[int, ...]


@dataclass(frozen=True)
class RigSlot:
    """A slot of a colour wheel: the level that chooses it, and the first and last that mean it."""

    level: int
    first: int
    last: int


def filter_drive(slot: str) -> str:
    """Return the name, among the drives of a light, of a slot that filters what it mixes."""
    return f"wheel {slot}"


@dataclass(frozen=True)
class RigWheel:
    """The colour wheels of a light, one behind the other.

    channels: their places among the channels of the fixture. slots: the combinations of their
    slots, with one of each wheel. filters: of light that is mixed before it, what each combination
    is called and lets through, the open one first; empty where combinations are the light's
    emitters, in their order.
    """

    channels: tuple[int, ...]
    slots: tuple[tuple[RigSlot, ...], ...]
    filters: tuple[SlotFilter, ...] = ()

    @cached_property
    def filter_drives(self) -> tuple[str, ...]:
        """The names, among the drives of the light, of the combinations that filter it."""
        return tuple(filter_drive(x.name) for x in self.filters)


@dataclass(frozen=True)
class RigLight:
    """A light of a fixture: all its beams together, or one of its pixels.

    name: of the light in scene, lights file and answer.
    position, direction, up: in the scene; direction and up have length 1.
    beam_angle, field_angle: full angles in degrees at 50 % and 10 % of the intensity.
    dimmers: places of the fixture's channels that multiply all its emitters; the first of them
    carries the level, the others stay at full.
    masters: places of channels that multiply it and other lights, and stay at full.
    filters: three of them, which set red, green and blue, its emitters, instead of channels of
    these.
    chromaticity: places of two channels that set x and y of CIE 1931 of the sum of its emitters,
    and in their place; `dimmers` set the sum's luminance. Empty for other lights.
    whites: places of channels that set its colour temperature, whose curves give kelvin; its
    emitters are its coolest and its warmest white, whose drives add up to what `dimmers` set.
    wheel: colour wheels, whose slots are its emitters, one at a time, of which `dimmers` set the
    drive; or that filter what emitters mix.
    """

    name: str
    position: Position
    direction: Position
    up: Position
    beam_angle: float
    field_angle: float
    emitters: tuple[RigEmitter, ...]
    dimmers: tuple[int, ...] = ()
    masters: tuple[int, ...] = ()
    filters: tuple[RigFilter, ...] = ()
    chromaticity: tuple[int, ...] = ()
    whites: tuple[int, ...] = ()
    wheel: RigWheel | None = None

    @property
    def has_slots_for_emitters(self) -> bool:
        """True if its emitters are the slots of a colour wheel, one of which shines at a time."""
        return self.wheel is not None and not self.wheel.filters

    @property
    def is_controlled(self) -> bool:
        """True if channels set it: not for a fixture without an address, or of which there is only
        a placeholder.
        """
        channels = [x.channels for x in self.emitters] + [x.channels for x in self.filters]
        return any((*channels, self.dimmers, self.chromaticity))


@dataclass(frozen=True)
class RigAxis:
    """An axis about which a channel turns a head.

    name: pan or tilt. channel: its place among the channels of the fixture. axis: in the scene, of
    length 1, while all angles are 0; turns about it are right-handed. levels, degrees: the ends of
    the channel's range, and the angles there.
    """

    name: str
    channel: int
    axis: Position
    levels: tuple[int, int]
    degrees: tuple[float, float]

    def degrees_at(self, level: int) -> float:
        """Return the angle at a level."""
        return float(np.interp(level, self.levels, self.degrees))

    def level_of(self, degrees: float) -> int:
        """Return the level of an angle in its range."""
        (first, last), (start, end) = self.levels, self.degrees
        return first + round((degrees - start) / (end - start) * (last - first))


@dataclass(frozen=True)
class RigHead:
    """A part of a fixture that pan and tilt turn.

    axes: one or two, the outer one first, which turns the other. direction: of its beams in the
    scene while all angles are 0, of length 1. lights: names of the lights on it.
    """

    axes: tuple[RigAxis, ...]
    direction: Position
    lights: tuple[str, ...]


@dataclass(frozen=True)
class RigFixture:
    """A fixture at an address of a console.

    fixture_id, name: as the console shows them. kind, mode: its GDTF type and its mode.
    addresses: the absolute address of each break, from 1; 513 is channel 1 of universe 2.
    heads: what turns. is_aimed: whether the axes of these rest where lights are to point.
    """

    fixture_id: str
    name: str
    kind: str
    mode: str
    addresses: Mapping[int, int]
    channels: tuple[DmxChannel, ...]
    lights: tuple[RigLight, ...]
    heads: tuple[RigHead, ...] = ()
    is_aimed: bool = False

    def places(self, channel: DmxChannel) -> list[tuple[int, int]]:
        """Return the universe and the index, 0 to 511, of each byte of a channel."""
        first = self.addresses[channel.dmx_break]
        absolute = [first + offset - 2 for offset in channel.offsets]
        return [(1 + place // UNIVERSE_SIZE, place % UNIVERSE_SIZE) for place in absolute]

    def set_level(
        self, universes: Mapping[int, bytearray], channel: DmxChannel, level: int
    ) -> None:
        """Write the level of a channel into the bytes of its universe."""
        values = level.to_bytes(len(channel.offsets), "big")
        for (universe, index), value in zip(self.places(channel), values, strict=True):
            universes[universe][index] = value


@dataclass(frozen=True)
class ConsoleRig:
    """All fixtures of a show.

    name: of the file it is from. Raises RigError for two fixtures on one address, a channel beyond
    its universe, and light names that repeat.
    """

    name: str
    fixtures: tuple[RigFixture, ...] = field(default_factory=tuple)

    def __post_init__(self) -> None:
        names = [light.name for fixture in self.fixtures for light in fixture.lights]
        if repeated := sorted({name for name in names if names.count(name) > 1}):
            raise RigError(f"{self.name} has several lights named {some_names(repeated)}")
        owners: dict[tuple[int, int], RigFixture] = {}
        for fixture in self.fixtures:
            for channel in fixture.channels:
                self._check_channel(fixture, channel, owners)

    def _check_channel(
        self, fixture: RigFixture, channel: DmxChannel, owners: dict[tuple[int, int], RigFixture]
    ) -> None:
        places = fixture.places(channel)
        first = fixture.addresses[channel.dmx_break]
        if places and any(universe != 1 + (first - 1) // UNIVERSE_SIZE for universe, _ in places):
            own = [x for x in fixture.channels if x.dmx_break == channel.dmx_break]
            last = max(offset for x in own for offset in x.offsets)
            raise RigError(
                f"{self.name}: {fixture.name!r} at {address_text(first)} needs channel "
                f"{(first - 1) % UNIVERSE_SIZE + last} of its universe, which has "
                f"{UNIVERSE_SIZE}: give it a lower address"
            )
        for universe, index in places:
            other = owners.setdefault((universe, index), fixture)
            if other is not fixture:
                raise RigError(
                    f"{self.name}: {other.name!r} and {fixture.name!r} are both on "
                    f"{universe}.{index + 1}: give one of them another address"
                )

    @cached_property
    def owners(self) -> Mapping[str, RigFixture]:
        """The fixture of each light, by the light's name."""
        return {light.name: fixture for fixture in self.fixtures for light in fixture.lights}

    @cached_property
    def rest(self) -> Mapping[int, bytes]:
        """The 512 bytes of each universe with all channels at rest."""
        universes = {universe: bytearray(UNIVERSE_SIZE) for universe in self.universes}
        for fixture in self.fixtures:
            for channel in fixture.channels:
                fixture.set_level(universes, channel, channel.default)
        return {universe: bytes(levels) for universe, levels in universes.items()}

    @cached_property
    def universes(self) -> list[int]:
        """The universes that its channels are in."""
        return sorted(
            {u for x in self.fixtures for channel in x.channels for u, _ in x.places(channel)}
        )


def address_text(address: int) -> str:
    """Return an absolute address as people write it, `2.1` for 513."""
    return f"{1 + (address - 1) // UNIVERSE_SIZE}.{1 + (address - 1) % UNIVERSE_SIZE}"
