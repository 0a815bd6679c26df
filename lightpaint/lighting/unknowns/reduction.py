"""The unknowns that constraints leave: w = C x + w₀ with bounds on x.

A light that may have any colour has three unknowns; one of fixed colour, or several on one dimmer,
have a single one; one that mixes primaries has an unknown for each. Locked lights are in w₀, which
moves to the right-hand side. Limits are bounds on x, or on its luminance. So the problem stays one
convex quadratic under all constraints; with ranges of white it is one for each choice of
neighbouring whites (white_mixes.py).
"""

from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from lightpaint.arrays import RGB, Bools, Doubles, Indices, as_rgb
from lightpaint.basis import BasisLight
from lightpaint.colour import Lamp
from lightpaint.display_text import brief, some_names
from lightpaint.errors import ConstraintError
from lightpaint.lighting.algebra.quadratic import Cap
from lightpaint.lighting.constraints.absolute_scale import with_scale
from lightpaint.lighting.constraints.constraint_table import (
    Constraints,
    LightConstraint,
    Requirements,
)
from lightpaint.lighting.constraints.light_constraints import (
    constraints_by_light,
    constraints_on_parts,
    tied_lights,
)
from lightpaint.lighting.unknowns import lamp_parts, unknown_blocks
from lightpaint.lighting.unknowns.gamuts import Gamuts
from lightpaint.lighting.unknowns.knobs import (
    Knob,
    SlotChoices,
    Unknown,
    dimmer_knob,
    fixed_emission,
    lamp_knob,
    lamp_of,
    mixing_knob,
    slots_of_lamp,
    tied_knob,
    white_lamp_knob,
)
from lightpaint.lighting.unknowns.mixed_lights import MixedLights


@dataclass(frozen=True)
class Reduction:
    """The unknowns that constraints leave, and the fixed lights.

    fixed_weights: (n, 3), w₀: the emission of lights without a knob; 0 for the others.
    labels: the constraint on each light in few words; "" for none.
    knobs: their unknowns, one after the other, are the x.
    is_joined: whether something else couples the channels: a pull to colours.
    gamuts: colours that lights without other constraints keep to.
    lamps: what mixes a light from emitters, by the light's index.
    requirements: sums that the answer has to reach, if there are any.
    mixed_emissions: the emissions, by the light's index, of lamps with colour wheels before these
    came to their slots.
    slots: the slots that wheels can still have, by the place of the knob.
    """

    fixed_weights: Doubles
    labels: tuple[str, ...]
    knobs: tuple[Knob, ...]
    is_joined: bool = False
    gamuts: Gamuts | None = None
    lamps: Mapping[int, Lamp] = field(default_factory=dict)
    requirements: Requirements | None = None
    mixed_emissions: Mapping[int, RGB] = field(default_factory=dict)
    slots: Mapping[int, SlotChoices] = field(default_factory=dict)

    @cached_property
    def unknowns(self) -> tuple[Unknown, ...]:
        """All x in their order."""
        return tuple(x for knob in self.knobs for x in knob.unknowns)

    @cached_property
    def places(self) -> tuple[tuple[int, ...], ...]:
        """The indices of the x of each knob."""
        ends = np.cumsum([0, *(len(knob.unknowns) for knob in self.knobs)]).tolist()
        return tuple(tuple(range(first, last)) for first, last in pairwise(ends))

    @cached_property
    def movable(self) -> frozenset[int]:
        """The lights, by their indices, that knobs move."""
        return frozenset(light for knob in self.knobs for light in knob.lights)

    @cached_property
    def watts(self) -> Doubles:
        """(k,), the power that each x takes at 1, in watts."""
        return lamp_parts.watts_of_unknowns(self.knobs, self.lamps)

    @cached_property
    def white_knobs(self) -> tuple[int, ...]:
        """Places of the knobs of lights that keep to a range of white, and may be on."""
        return tuple(
            k
            for k, knob in enumerate(self.knobs)
            if knob.whites is not None and any(x.upper > 0 for x in knob.unknowns)
        )

    @cached_property
    def confined_knobs(self) -> tuple[int, ...]:
        """Places of the knobs that are kept within their gamuts."""
        return tuple(k for k, knob in enumerate(self.knobs) if knob.gamut is not None)

    @cached_property
    def has_sides(self) -> bool:
        """True if knobs are kept within triangles of their gamuts."""
        return any(knob.side is not None for knob in self.knobs)

    @cached_property
    def gamut_knobs(self) -> tuple[int, ...]:
        """Places of the knobs that have a gamut, and still take any colour."""
        if self.gamuts is None:
            return ()
        return tuple(k for k, knob in enumerate(self.knobs) if knob.has_any_colour)

    @cached_property
    def open_wheels(self) -> tuple[int, ...]:
        """Places of the knobs of colour wheels that have still to come to a slot."""
        return tuple(k for k, knob in enumerate(self.knobs) if knob.has_open_wheel)

    def with_slots(self, weights: Doubles) -> "Reduction":
        """Return the reduction with each colour wheel at the slot that comes closest to the colour
        of its lamp in weights (n, 3).
        """
        knobs, mixed_emissions, slots = [*self.knobs], {**self.mixed_emissions}, {**self.slots}
        for k in self.open_wheels:
            knob, wheel = knobs[k], knobs[k].wheel
            assert wheel is not None
            color = knob.solved_color(weights)
            if wheel.has_color(color):
                mixed_emissions[knob.lights[0]] = as_rgb(color)
            else:  # off, but it may serve once other wheels have left their colours
                color = np.zeros(3)
            slots[k] = SlotChoices.of_wheel(knob, slot := wheel.slot_for(color))
            knobs[k] = knob.at_slot(slot)
        return replace(self, knobs=tuple(knobs), mixed_emissions=mixed_emissions, slots=slots)

    @cached_property
    def wheels(self) -> tuple[int, ...]:
        """Places of the knobs of colour wheels that may have another slot, of lights that may be
        on.
        """
        return tuple(k for k in self.slots if any(x.upper > 0 for x in self.knobs[k].unknowns))

    def at_slots(self, places: Mapping[int, int]) -> "Reduction":
        """Return the reduction with wheels, by the place of the knob, at other slots.

        Raises ConstraintError for a place without a wheel.
        """
        knobs, slots, lamps = [*self.knobs], {**self.slots}, {**self.lamps}
        for k, place in places.items():
            if k not in slots:
                raise ConstraintError(f"no colour wheel at {brief(k)}: they are at {[*slots]}")
            option = slots[k].options[place]
            knobs[k], slots[k] = option.knob, replace(slots[k], at=place)
            if option.lamp is not None:
                lamps[option.knob.lights[0]] = option.lamp
        return replace(self, knobs=tuple(knobs), slots=slots, lamps=lamps)

    @cached_property
    def has_equal_mixes(self) -> bool:
        """True if a light mixes more than three colours, and hence most colours in many ways."""
        return any(len(knob.lights) == 1 and len(knob.unknowns) > 3 for knob in self.knobs)

    @property
    def has_choices(self) -> bool:
        """True if lights choose their whites, whether they keep to their gamuts, or how."""
        return bool(self.white_knobs or self.gamut_knobs) or self.has_sides

    def with_gamuts(self, gamuts: Gamuts) -> "Reduction":
        """Return the reduction with lights of any colour keeping to `gamuts`."""
        return replace(self, gamuts=gamuts)

    def with_requirements(self, requirements: Requirements) -> "Reduction":
        """Return the reduction with sums that the answer has to reach, which couple all lights.

        Raises ConstraintError if they are of other lights.
        """
        if requirements.rows.shape[1] != len(self.labels):
            raise ConstraintError(
                f"wishes for planes are of {requirements.rows.shape[1]} lights, and there are "
                f"{len(self.labels)}: measure anew"
            )
        return replace(self, requirements=requirements, is_joined=True)

    def at_middle_colors(self) -> "Reduction":
        """Return the reduction with each light that keeps to a gamut as a dimmer of the colour in
        its middle, which all parts of the gamut have.
        """
        if not self.gamut_knobs:
            return self
        knobs = [*self.knobs]
        for k in self.gamut_knobs:
            assert self.gamuts is not None
            knobs[k] = knobs[k].dimming(self.gamuts[knobs[k].lights[0]].middle)
        return replace(self, knobs=tuple(knobs), gamuts=None)

    def confined_to_sides(self, sides: Mapping[int, int | None]) -> "Reduction":
        """Return the reduction with knobs, by their places, confined to a side of their gamuts; to
        the whole gamut where the side is None.
        """
        if not sides:
            return self
        knobs = [*self.knobs]
        for k, side in sides.items():
            assert self.gamuts is not None
            knobs[k] = knobs[k].confined(self.gamuts[knobs[k].lights[0]], side)
        return replace(self, knobs=tuple(knobs))

    def with_windows(self, windows: Mapping[int, tuple[int, int]]) -> "Reduction":
        """Return the reduction with knobs, by their places, between other whites of their
        ranges."""
        knobs = [*self.knobs]
        for k, window in windows.items():
            if knobs[k].window != window:
                knobs[k] = knobs[k].with_window(window)
        return replace(self, knobs=tuple(knobs))

    @cached_property
    def is_free(self) -> Bools:
        """(n,), which lights may have any colour, or any of a gamut."""
        free_knobs = (knob for knob in self.knobs if knob.is_free or knob.gamut is not None)
        free = {light for knob in free_knobs for light in knob.lights}
        return np.array([k in free for k in range(len(self.labels))], dtype=bool)

    @cached_property
    def caps(self) -> tuple[Cap, ...]:
        """Limits on sums of x."""
        return tuple(
            Cap(members, *knob.limit)
            for members, knob in zip(self.places, self.knobs, strict=True)
            if knob.limit is not None
        )

    @cached_property
    def lower(self) -> Doubles:
        """(k,), the least that each x may be."""
        return np.array([x.lower for x in self.unknowns])

    @cached_property
    def upper(self) -> Doubles:
        """(k,), the most that each x may be."""
        return np.array([x.upper for x in self.unknowns])

    @cached_property
    def columns(self) -> tuple[Indices, Indices, Doubles]:
        """The matrix C by its entries: unknown, light and (3,) emission of each, in the order of
        unknowns.
        """
        entries = [(k, i, rgb) for k, x in enumerate(self.unknowns) for i, rgb in x.columns]
        return (
            np.array([k for k, _, _ in entries], dtype=np.intp),
            np.array([i for _, i, _ in entries], dtype=np.intp),
            np.array([rgb for _, _, rgb in entries], dtype=np.float64).reshape(-1, 3),
        )

    @cached_property
    def required(self) -> tuple[Doubles, Doubles]:
        """The requirements in the unknowns, R x ≥ r: (m, k) and (m,)."""
        requirements = self.requirements
        assert requirements is not None
        unknown, light, rgb = self.columns
        entry, channel = np.nonzero(rgb)
        given = requirements.rows.reshape(len(requirements), self.fixed_weights.size)
        parts = given[:, 3 * light[entry] + channel]
        parts *= rgb[entry, channel]
        columns, first = np.unique(unknown[entry], return_index=True)
        if columns.size < entry.size:
            parts = _sums_of_runs(parts, first)
        rows = parts
        if columns.size < len(self.unknowns):
            rows = np.zeros((len(requirements), len(self.unknowns)))
            rows[:, columns] = parts
        least = requirements.least - np.einsum("mnc,nc->m", requirements.rows, self.fixed_weights)
        if requirements.watts.any():
            rows += np.outer(requirements.watts, self.watts)
            fixed = {k: lamp for k, lamp in self.lamps.items() if k not in self.movable}
            least -= requirements.watts * lamp_parts.watts_of(self.fixed_weights, fixed)
        return rows, least

    @cached_property
    def limited_knobs(self) -> tuple[unknown_blocks.LimitedKnobs, ...]:
        """The limited knobs, grouped by their number of unknowns."""
        sizes = {len(knob.unknowns) for knob in self.knobs if knob.limit is not None}
        return tuple(
            unknown_blocks.LimitedKnobs.of(self.knobs, self.places, size) for size in sorted(sizes)
        )

    @cached_property
    def knob_groups(self) -> tuple[unknown_blocks.KnobGroup, ...]:
        """The knobs, grouped by their numbers of unknowns and lights."""
        by_size: dict[tuple[int, int], list[int]] = {}
        for k, knob in enumerate(self.knobs):
            by_size.setdefault((len(knob.unknowns), len(knob.lights)), []).append(k)
        return tuple(
            unknown_blocks.KnobGroup.of(
                [self.knobs[k] for k in numbers], [self.places[k] for k in numbers]
            )
            for numbers in by_size.values()
        )

    @cached_property
    def blocks(self) -> tuple[unknown_blocks.Block, ...]:
        """A block for every set of channels that the unknowns couple."""
        unknown, light, rgb = self.columns
        blocks = []
        for channels in self.channel_groups:
            members = np.unique(unknown[(rgb[:, channels] != 0).any(axis=1)])
            place = np.zeros(len(self.unknowns), dtype=np.intp)
            place[members] = np.arange(members.size)
            entries = []
            for c in channels:
                is_entry = rgb[:, c] != 0
                columns, first = np.unique(place[unknown[is_entry]], return_index=True)
                entries.append(
                    unknown_blocks.Entries(columns, light[is_entry], rgb[is_entry, c], first)
                )
            in_block = set(members.tolist())
            cap_indices = [k for k, cap in enumerate(self.caps) if cap.unknowns[0] in in_block]
            caps = tuple(
                replace(cap, unknowns=tuple(int(place[i]) for i in cap.unknowns))
                for cap in (self.caps[k] for k in cap_indices)
            )
            blocks.append(
                unknown_blocks.Block(channels, members, tuple(entries), caps, cap_indices)
            )
        return tuple(blocks)

    @cached_property
    def mixed_lights(self) -> MixedLights | None:
        """The unknowns as lamps of many emitters, and others beside them; None where none is one,
        or caps or requirements join them.
        """
        is_one = [block.unknowns.size for block in self.blocks] == [len(self.unknowns)]
        if self.caps or self.requirements is not None or not is_one:
            return None
        return MixedLights.of(self.knob_groups, (self.lower, self.upper), self.columns)

    @cached_property
    def alike_blocks(self) -> unknown_blocks.AlikeBlocks | None:
        """The three blocks together, if they have the same lights and nothing joins them."""
        if len(self.blocks) < 3 or self.caps or not all(block.is_plain for block in self.blocks):
            return None
        first, *others = (block.entries[0].lights for block in self.blocks)
        if not all(np.array_equal(first, lights) for lights in others):
            return None
        unknowns = np.stack([block.unknowns for block in self.blocks])
        is_all_lights = np.array_equal(first, np.arange(len(self.fixed_weights)))
        return unknown_blocks.AlikeBlocks(
            None if is_all_lights else first, unknowns, self.lower[unknowns], self.upper[unknowns]
        )

    @cached_property
    def has_fixed_light(self) -> bool:
        """True if a light without a knob shines."""
        return bool(self.fixed_weights.any())

    def weights(self, x: Doubles) -> Doubles:
        """Return the weights w = C x + w₀, (n, 3)."""
        unknown, light, rgb = self.columns
        w = self.fixed_weights.copy()
        np.add.at(w, light, x[unknown, None] * rgb)
        return w

    def determined(self, lit: Bools) -> Bools:
        """Return, (n, 3), whether the unknowns that move a light in a channel reach something that
        counts.

        lit: (n, 3), whether the light itself does. A dimmer that does so in one channel or with
        one of its lights determines all of them; fixed lights are determined already.
        """
        unknown, light, rgb = self.columns
        moves, has_effect = rgb != 0, np.zeros(len(self.unknowns), dtype=bool)
        np.logical_or.at(has_effect, unknown, (moves & lit[light]).any(axis=1))
        is_moved, is_determined = np.zeros_like(lit), np.zeros_like(lit)
        np.logical_or.at(is_moved, light, moves)
        np.logical_or.at(is_determined, light, moves & has_effect[unknown, None])
        # The brightness of a colour without blue determines its blue, too.
        either = is_determined.any(axis=1, keepdims=True) | ~is_moved.any(axis=1, keepdims=True)
        return np.asarray(is_determined | (~is_moved & either))

    @cached_property
    def weight_ranges(self) -> tuple[Doubles, Doubles]:
        """The least and the most that bounds leave of each weight, (n, 3) each."""
        unknown, light, rgb = self.columns
        low, high = self.fixed_weights.copy(), self.fixed_weights.copy()
        least, most = self.lower[unknown, None], self.upper[unknown, None]
        for end, bounds in (
            (low, np.where(rgb < 0, most, least)),
            (high, np.where(rgb < 0, least, most)),
        ):
            products = np.multiply(bounds, rgb, out=np.zeros(rgb.shape), where=rgb != 0)
            np.add.at(end, light, products)
        return low, high

    @cached_property
    def channel_groups(self) -> list[list[int]]:
        """Channels that one problem couples; apart where no unknown and no limit joins them."""
        if self.is_joined:
            return [[0, 1, 2]]
        unknown, _, rgb = self.columns
        touched: Bools = np.zeros((len(self.unknowns) + len(self.caps), 3), dtype=bool)
        np.logical_or.at(touched, unknown, rgb != 0)
        for k, cap in enumerate(self.caps):
            touched[len(self.unknowns) + k] = touched[list(cap.unknowns)].any(axis=0)
        groups = [{0}, {1}, {2}]
        for row in np.unique(touched, axis=0):
            channels = set(np.flatnonzero(row).tolist())
            meeting = [group for group in groups if group & channels]
            groups = [group for group in groups if not group & channels]
            groups.append(set().union(*meeting))
        return sorted(sorted(group) for group in groups if group)


def only_knobs(reduction: Reduction, chosen: Collection[int]) -> Reduction:
    """Return `reduction` with the knobs that are not chosen fixed at 0."""
    labels, knobs = [*reduction.labels], [*reduction.knobs]
    for k, knob in enumerate(knobs):
        if k not in chosen:
            knobs[k] = knob.switched_off()
            for light in knob.lights:
                labels[light] = ", ".join(filter(None, [labels[light], "left out"]))
    return replace(reduction, labels=tuple(labels), knobs=tuple(knobs))


def _lamps(
    constraints: Constraints,
    lights: Sequence[BasisLight],
    by_light: Sequence[LightConstraint | None],
) -> dict[int, Lamp]:
    """Return the lamps that mix lights, by the lights' indices; alike lights share one."""
    scale, prefer = constraints.cd_per_unit, constraints.prefer_emitters
    made: dict[Hashable, Lamp | None] = {}
    lamps = {}
    for k, (light, constraint) in enumerate(zip(lights, by_light, strict=True)):
        quantity = light.plugin, light.unit, light.unit_flux, len(light.members)
        kind = id(constraint), quantity, light.is_fixed, light.is_scalar
        if kind not in made:
            made[kind] = lamp_of(light, constraint, scale, prefer)
        if (lamp := made[kind]) is not None:
            lamps[k] = lamp
    if prefer == "rf" and lamps and all(x.powers_at_full is None for x in lamps.values()):
        named = some_names(lights[k].name for k in lamps)
        raise ConstraintError(
            f"prefer_emitters is rf, and nothing says which spectra the emitters of {named} have: "
            "give them a spectrum each in the lights file, or prefer watts, white or fewest"
        )
    return lamps


def reduce_to(constraints: Constraints, lights: Sequence[BasisLight]) -> Reduction:
    """Return the unknowns that `constraints` leave among `lights`.

    Raises ConstraintError for a light that is not there, for requirements of other lights, and for
    the impossible: a colour for a light that has only a dimmer, a light on two dimmers, limits that
    leave nothing.
    """
    reduction = _reduce_parts(constraints, lights)
    if constraints.requirements is None:
        return reduction
    return reduction.with_requirements(constraints.requirements)


def _reduce_parts(constraints: Constraints, lights: Sequence[BasisLight]) -> Reduction:
    """Return the unknowns among lights, of which some may be emitters of a lamp, without
    requirements.
    """
    whole = lamp_parts.WholeLamps.of(lights)
    if not whole.has_parts:
        return _reduce_to(constraints, lights)
    of_emitters, of_lamps = constraints_on_parts(constraints, lights)
    by_light = constraints_by_light(of_lamps, whole.lights)
    lamps = _lamps(of_lamps, whole.lights, by_light)
    if not lamps:  # nothing says what the emitters have in common
        return _reduce_to(constraints, lights)
    constraints = of_lamps
    _check_ties(constraints, lights)
    whole.check_emitters(lights, lamps)
    colored = [
        replace(
            light,
            emission=as_rgb(lamp_parts.emission_of_parts([lights[i] for i in parts], lamps[k])),
        )
        if k in lamps
        else light
        for k, (light, parts) in enumerate(zip(whole.lights, whole.parts, strict=True))
    ]
    reduction = _reduce_to(constraints, colored)
    fixed = [whole.weights(k, lamps.get(k), row) for k, row in enumerate(reduction.fixed_weights)]
    labels = [
        label for label, parts in zip(reduction.labels, whole.parts, strict=True) for _ in parts
    ]
    knobs = [part for knob in reduction.knobs for part in whole.knobs(knob, lamps)]
    of_parts = {
        i: part
        for k, lamp in lamps.items()
        for i, part in zip(whole.parts[k], lamp_parts.part_lamps(lamp), strict=True)
    }
    reduction = Reduction(np.concatenate(fixed), tuple(labels), tuple(knobs), lamps=of_parts)
    return _with_constrained_parts(reduction, of_emitters, lights)


def _check_ties(constraints: Constraints, lights: Sequence[BasisLight]) -> None:
    """Raise ConstraintError for ties that name emitters of lamps."""
    names = {light.name: light.lamp for light in lights if light.lamp}
    for tie in constraints.ties:
        for name in tie.lights:
            if name in names:
                raise ConstraintError(
                    tie.where,
                    f": {name!r} is an emitter of {names[name]!r}: tie lamps, not their emitters",
                )


def _with_constrained_parts(
    reduction: Reduction, constraints: Constraints, lights: Sequence[BasisLight]
) -> Reduction:
    """Return the unknowns with constraints on single emitters of lamps, too."""
    by_part = constraints_by_light(constraints, lights)
    fixed, labels = reduction.fixed_weights.copy(), list(reduction.labels)
    knobs = {knob.lights: knob for knob in reduction.knobs}
    for k, constraint in enumerate(by_part):
        if constraint is None:
            continue
        if (k,) not in knobs:
            raise ConstraintError(
                constraint.where,
                f" is on an emitter of {lights[k].lamp!r}, whose own constraint rules all of its "
                "emitters: leave one of the two out",
            )
        labels[k] = ", ".join(filter(None, [labels[k], constraint.label]))
        if constraint.is_fixed:
            fixed[k] = fixed_emission(lights[k], constraint, reduction.lamps[k])
            del knobs[k,]
        else:
            knobs[k,] = dimmer_knob(k, lights[k], constraint, reduction.lamps[k])
    return replace(
        reduction, fixed_weights=fixed, labels=tuple(labels), knobs=tuple(knobs.values())
    )


def lamps_by_name(constraints: Constraints, lights: Sequence[BasisLight]) -> dict[str, Lamp]:
    """Return what mixes lights from emitters, by the light's name. Raises ConstraintError."""
    constraints = with_scale(constraints, lights)
    by_light = constraints_by_light(constraints, lights)
    return {lights[k].name: lamp for k, lamp in _lamps(constraints, lights, by_light).items()}


def _reduce_to(constraints: Constraints, lights: Sequence[BasisLight]) -> Reduction:
    """Return the unknowns that `constraints` leave among `lights`, each of which is whole."""
    by_light = constraints_by_light(constraints, lights)
    labels = ["" if constraint is None else constraint.label for constraint in by_light]
    tied, fixed, knobs = tied_lights(constraints, lights), np.zeros((len(lights), 3)), []
    lamps, slots = _lamps(constraints, lights, by_light), dict[int, SlotChoices]()
    for k, (light, constraint) in enumerate(zip(lights, by_light, strict=True)):
        if light.is_fixed:
            fixed[k] = 1
        elif k in tied:
            tie, members = tied[k]
            names = ", ".join(lights[i].name for i in members)
            labels[k] = ", ".join(filter(None, [f"tied ({names})", labels[k]]))
            if k == members[0]:
                knob = tied_knob(tie, members, names, lights, by_light, lamps)
                if any(
                    member_constraint.is_fixed
                    for member_constraint in (by_light[i] for i in members)
                    if member_constraint is not None
                ):
                    [level] = knob.unknowns
                    for i, rgb in level.columns:
                        fixed[i] = level.lower * rgb
                else:
                    knobs.append(knob)
        elif constraint is not None and constraint.is_fixed:
            fixed[k] = fixed_emission(light, constraint, lamps.get(k))
        elif constraint is None:
            knobs.append(Knob.of_any_colour(k, is_scalar=light.is_scalar))
        elif k in lamps and lamps[k].is_wheel:
            knobs.append(lamp_knob(k, light, constraint, lamps[k]))
        elif light.is_scalar or (
            constraint.primaries is not None and len(constraint.primaries) == 1
        ):
            knobs.append(dimmer_knob(k, light, constraint, lamps.get(k)))
        elif k in lamps and constraint.whites is not None:
            knobs.append(white_lamp_knob(k, light, constraint, lamps[k]))
        elif k in lamps:
            if len(constraint.slots) > 1:
                scale = constraints.cd_per_unit
                slots[len(knobs)] = slots_of_lamp(k, light, constraint, scale, lamps[k])
            knobs.append(lamp_knob(k, light, constraint, lamps[k]))
        else:
            knobs.append(mixing_knob(k, light, constraint))
    return Reduction(fixed, tuple(labels), tuple(knobs), lamps=lamps, slots=slots)


def _sums_of_runs(parts: Doubles, first: Indices) -> Doubles:
    """Return the sums over runs of columns of parts, (m, e), which begin at `first`, (j,)."""
    length = parts.shape[1] // first.size
    if (first == length * np.arange(first.size)).all() and length * first.size == parts.shape[1]:
        # A few sums of whole columns are far quicker than one for each run.
        return np.asarray(sum(parts[:, k::length] for k in range(length)))
    return np.asarray(np.add.reduceat(parts, first, axis=1))
