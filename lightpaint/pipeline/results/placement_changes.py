"""Changes of a placement, as records for reports and as sentences for people."""

from typing import Any

from lightpaint.display_text import rounded_text
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.placement import (
    HARDLY_VISIBLE,
    TO_END,
    AddedLight,
    Move,
    Placement,
    PlacementRecord,
)
from lightpaint.report.rig.hung_lights import HungLights, LightChange, hung_lights, spoken_fraction

#: Least errors of a turn, in degrees, and of a way, as a share of it, that are worth a number.
LEAST_TURN_ERROR, LEAST_SHARE = 0.05, 0.001


def hung_of(placement: Placement | PlacementRecord, lighting: Lighting | None) -> HungLights:
    """Return the changes of a placement and the lights of an answer; none without a placement."""
    changes = [_change_of(change) for change in all_changes(placement)]
    changes.sort(key=lambda change: -change.numbers["gain_share"])
    missed_shares = placement.missed_before, placement.missed_after
    lights = () if lighting is None else hung_lights(lighting)
    up_axis = (0.0, 1.0, 0.0) if lighting is None else lighting.up
    return HungLights(lights, tuple(changes), up_axis, *missed_shares, placement.looks)


def all_changes(placement: Placement | PlacementRecord) -> list[Move | AddedLight]:
    """Return the moves, then the new lights."""
    return [*placement.moves, *placement.additions]


def _change_of(change: Move | AddedLight) -> LightChange:
    numbers: dict[str, Any] = {
        "gain_share": change.gain_share,
        "place_error": change.place_error,
        "turn_error": change.turn_error,
        "is_hardly_visible": change.is_hardly_visible,
    }
    if isinstance(change, Move):
        numbers |= {"distance": change.distance, "turn": change.turn}
        numbers |= {"cutoff": change.new.cutoff, "beam": change.new.beam}
    return LightChange(change.name, spoken_change(change), numbers)


def spoken_change(change: Move | AddedLight) -> str:
    """Return a light's change and gain: `spot_knot turned by 12°, slid by 0.6: a fifth …`."""
    gain = f"{spoken_fraction(change.gain_share)} of what was missed"
    if isinstance(change, Move):
        phrase, gain = spoken_move(change), change.shared_gain or gain
    else:
        x, y, z = (f"{v:.2f}" for v in change.site.position or (0.0, 0.0, 0.0))
        phrase = f"is a new {change.emitter.kind} at ({x}, {y}, {z})".replace("-", "−")
        if change.place_error:
            phrase += f" ± {rounded_text(change.place_error, 1)}"
    text = f"{change.name} {phrase}: {gain}"
    return f"{text}; {HARDLY_VISIBLE}" if change.is_hardly_visible else text


def spoken_move(move: Move) -> str:
    """Return a light's change with its errors: `turned by 12° ± 1°, slid by 0.6 ± 0.05`."""
    phrases = []
    if move.turn >= 0.5:
        turn_error = move.turn_error or 0.0
        error = f" ± {rounded_text(turn_error, 1)}°" if turn_error >= LEAST_TURN_ERROR else ""
        phrases.append(f"turned by {move.turn:.0f}°{error}{TO_END * move.is_turned_to_end}")
    if move.distance > 0:
        place_error = move.place_error or 0.0
        is_told = place_error >= LEAST_SHARE * move.distance
        error = f" ± {rounded_text(place_error, 1)}" if is_told else ""
        way = rounded_text(move.distance, 2)
        phrases.append(f"slid by {way}{error}{TO_END * move.is_slid_to_end}")
    if move.new.cutoff is not None and move.new.cutoff != move.old.cutoff:
        phrases.append(f"its cone ends at {move.new.cutoff:.0f}° (was {move.old.cutoff:.0f}°)")
    if move.has_other_edge:
        phrases.append(f"its beam at {move.new.beam:.0f}° (was {move.old.beam:.0f}°)")
    return ", ".join(phrases)
