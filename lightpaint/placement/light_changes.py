"""Better places of lights: moves, additions, their gain, and a record of them as JSON, for other
looks and other machines.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from lightpaint.arrays import RGB, Floats, as_position
from lightpaint.colour import lambertian_flux, point_flux, spot_flux
from lightpaint.display_text import rounded_text
from lightpaint.errors import SceneError
from lightpaint.files import read_text
from lightpaint.keywords import keywords
from lightpaint.scene import NewEmitter, Pose, Scene
from lightpaint.scene.properties.site import Site
from lightpaint.sentences import Hint
from lightpaint.storage.json_records import read_record, strict_json

#: Advice on a place that the picture hardly determines.
HARDLY_VISIBLE = "hardly visible from here: paint a second view"

#: Remark on a way or a turn that more freedom might lengthen.
TO_END = " (as far as it may)"

#: Change of a beam's share of its cone that is worth mentioning.
LEAST_BEAM_CHANGE = 0.01

FORMAT: Literal["lightpaint-places 1"] = "lightpaint-places 1"

#: Maximum size in bytes of a file.
MAX_BYTES = 2**22


@keywords()
@dataclass(frozen=True)
class Move:
    """A worthwhile move of a light.

    Attributes:
        name: The light.
        old: Its place, direction and cone before.
        new: The same after the move.
        gain_share: The share of the error that it removes, given the other changes; of a pair, what
            both remove together.
        place_error: Standard error of its place, in units of the scene; None if it did not slide.
        turn_error: The same of its direction, in degrees; None if it has none.
        is_hardly_visible: Whether the picture hardly tells where it is.
        is_slid_to_end: Whether it hangs at the edge of the places that it may have.
        is_turned_to_end: Whether it turned by all that it may.
        mirrors: The light of its pair whose mirror image it is; "" if it is not an image.

    Examples:
        >>> solution, scene = lp.solve(basis, target), lp.load_scene("room.xml")
        >>> placement = lp.place(scene, basis, solution, {"bulb": lp.Freedom(within=0.5)})
        >>> all(move.gain_share > 0 for move in placement.moves)
        True
    """

    name: str
    old: Site
    new: Site
    gain_share: float
    place_error: float | None = None
    turn_error: float | None = None
    is_hardly_visible: bool = False
    is_slid_to_end: bool = False
    is_turned_to_end: bool = False
    mirrors: str = ""

    @property
    def distance(self) -> float:
        """Distance that it slid, in units of the scene."""
        if self.old.position is None or self.new.position is None:
            return 0.0
        return math.dist(self.old.position, self.new.position)

    @property
    def turn(self) -> float:
        """Degrees that it turned."""
        if self.old.direction is None or self.new.direction is None:
            return 0.0
        cosine = float(np.dot(self.old.direction, self.new.direction))
        return math.degrees(math.acos(max(-1.0, min(1.0, cosine))))

    @property
    def pose(self) -> Pose:
        """The change as a pose."""
        new, slid = self.new, self.distance > 0
        place = np.array(new.position or (0.0, 0.0, 0.0))
        turned = self.turn > 0 or slid
        target = None if new.direction is None else as_position(place + np.array(new.direction))
        return Pose(
            position=new.position if slid else None,
            target=target if turned else None,
            cutoff=new.cutoff if new.cutoff != self.old.cutoff else None,
            beam=new.beam if new.beam != self.old.beam else None,
        )

    @property
    def has_other_edge(self) -> bool:
        """True if the beam is noticeably wider or narrower, and not in proportion to its cone."""
        old, new = self.old, self.new
        is_noticeable = round(new.beam or 0.0) != round(old.beam or 0.0)
        return is_noticeable and abs(_beam_share(new) - _beam_share(old)) >= LEAST_BEAM_CHANGE

    @property
    def shared_gain(self) -> str:
        """The gain of a mirror image in words; "" for other lights."""
        if not self.mirrors:
            return ""
        return f"the mirror image of {self.mirrors}, whose gain is for both"

    def __str__(self) -> str:
        done = []
        if self.turn >= 0.5:
            done.append(f"turned by {self.turn:.0f}°{TO_END * self.is_turned_to_end}")
        if self.distance > 0:
            done.append(f"slid by {rounded_text(self.distance, 2)}{TO_END * self.is_slid_to_end}")
        if self.new.cutoff is not None and self.new.cutoff != self.old.cutoff:
            done.append(f"cone {self.old.cutoff:.0f}° to {self.new.cutoff:.0f}°")
        if self.has_other_edge:
            done.append(f"beam {self.old.beam:.0f}° to {self.new.beam:.0f}°")
        gain = self.shared_gain or f"{_percent(self.gain_share)} of what was missed"
        return _with_advice(f"{self.name}: {', '.join(done)}: {gain}", self)


@keywords()
@dataclass(frozen=True)
class AddedLight:
    """A worthwhile new light.

    Attributes:
        emitter: The light: its name, kind, place and emission.
        gain_share: The share of the error that it removes, given the other changes.
        place_error: Standard error of its place, in units of the scene.
        turn_error: The same of its direction, in degrees; None if it has none.
        is_hardly_visible: Whether the picture hardly tells where it is.
        seen_at: Its place in the first picture, from (0, 0) top left to (1, 1); None if outside.
        missed_share: The share of ‖Ψ‖² that is missed with it and the additions before it.
        without: (h, w, 3) linear, the best lighting before this light, small.
        with_it: (h, w, 3), the same with it.

    Examples:
        >>> solution, scene = lp.solve(basis, target), lp.load_scene("room.xml")
        >>> new = [lp.NewLights("point", count=1)]
        >>> [x.name for x in lp.place(scene, basis, solution, new=new).additions]
        []
    """

    emitter: NewEmitter
    gain_share: float
    place_error: float | None = None
    turn_error: float | None = None
    is_hardly_visible: bool = False
    seen_at: tuple[float, float] | None = None
    missed_share: float = 0.0
    without: Floats | None = field(default=None, repr=False, compare=False)
    with_it: Floats | None = field(default=None, repr=False, compare=False)

    @property
    def name(self) -> str:
        """Its name."""
        return self.emitter.name

    @property
    def site(self) -> Site:
        """Its place, direction and cone."""
        return self.emitter.site

    @property
    def flux(self) -> RGB:
        """Watts that it radiates per channel, if a unit of the scene is a metre.

        For a panel it is more certain than size and radiance, since a small, bright, distant one
        has nearly the same effect.
        """
        light, site = self.emitter, self.site
        if light.kind == "panel":
            assert light.size is not None
            unit = lambertian_flux(light.size[0] * light.size[1])
        elif light.kind == "spot":
            unit = spot_flux(*(math.radians(angle or 0.0) for angle in (site.cutoff, site.beam)))
        else:
            unit = point_flux()
        r, g, b = (unit * amount for amount in light.emission)
        return r, g, b

    def __str__(self) -> str:
        x, y, z = self.site.position or (0.0, 0.0, 0.0)
        gain = f"{_percent(self.gain_share)} of what was missed"
        text = f"{self.name}: a new {self.emitter.kind} at ({x:.2f}, {y:.2f}, {z:.2f}): {gain}"
        return _with_advice(text, self)


def _beam_share(site: Site) -> float:
    """Return the width of a spot's beam, as a share of its cone."""
    return (site.beam or 0.0) / (site.cutoff or 1.0)


def _percent(share: float) -> str:
    return f"{100 * share:.{1 if share < 0.0095 else 0}f} %"


def _with_advice(text: str, change: Move | AddedLight) -> str:
    return f"{text}; {HARDLY_VISIBLE}" if change.is_hardly_visible else text


@keywords()
@dataclass(frozen=True)
class Placement:
    """Better places of lights.

    Attributes:
        scenes: The scene with these, through the sensor of each view, for new bases and another
            solve.
        moves: The worthwhile ones, largest gain first. Each reliably removes at least 1 % of the
            error that is left without it.
        additions: The worthwhile new lights, likewise.
        missed_before: The error of the solve as a share of ‖Ψ‖², estimated on paths that no place
            was fitted to.
        missed_after: The same with the moves and additions.
        looks: Names of the looks that share it; empty for a single look.
        level_errors: Lights, also unmoved ones, and the standard deviations of their weights by the
            errors of poses, of each channel and relative to the weight.

    Examples:
        >>> solution, scene = lp.solve(basis, target), lp.load_scene("room.xml")
        >>> placement = lp.place(scene, basis, solution, {"bulb": lp.Freedom(within=0.5)})
        >>> placement.missed_after <= placement.missed_before
        True
    """

    scenes: tuple[Scene, ...]
    moves: tuple[Move, ...]
    additions: tuple[AddedLight, ...]
    missed_before: float
    missed_after: float
    looks: tuple[str, ...] = ()
    level_errors: tuple[tuple[str, RGB], ...] = ()

    @property
    def scene(self) -> Scene:
        """The scene of the first view."""
        return self.scenes[0]

    @property
    def is_empty(self) -> bool:
        """True if nothing moved, and nothing is new."""
        return not self.moves and not self.additions


def hung(
    scenes: Sequence[Scene], moves: Sequence[Move], additions: Sequence[AddedLight]
) -> list[Scene]:
    """Return `scenes` with these moves and new lights, or unchanged without any."""
    if not moves and not additions:
        return list(scenes)
    poses, new = {move.name: move.pose for move in moves}, [light.emitter for light in additions]
    return [scene.moved(poses).with_new_emitters(new) for scene in scenes]


@dataclass(frozen=True)
class PlacementRecord:
    """A placement without its scenes and pictures.

    made_of: fingerprint of its inputs. Others: as in `Placement`.
    """

    moves: tuple[Move, ...]
    additions: tuple[AddedLight, ...]
    missed_before: float
    missed_after: float
    looks: tuple[str, ...] = ()
    level_errors: tuple[tuple[str, RGB], ...] = ()
    made_of: str = ""
    format: Literal["lightpaint-places 1"] = FORMAT

    def hung_in(self, scenes: Sequence[Scene]) -> Placement:
        """Return the placement applied to `scenes`, which differ only in the sensor.

        Raises SceneError for moved lights that these lack, or new lights that exist already.
        """
        return Placement(
            tuple(hung(scenes, self.moves, self.additions)),
            self.moves,
            self.additions,
            self.missed_before,
            self.missed_after,
            self.looks,
            self.level_errors,
        )

    def to_json(self) -> str:
        """Return this record as text."""
        return json.dumps(asdict(self), indent=1, ensure_ascii=False) + "\n"


def record_of(
    placement: Placement, *, looks: Sequence[str] = (), made_of: str = ""
) -> PlacementRecord:
    """Return the record of a placement. looks: the names of looks that share it."""
    return PlacementRecord(
        placement.moves,
        tuple(replace(x, without=None, with_it=None) for x in placement.additions),
        placement.missed_before,
        placement.missed_after,
        tuple(looks),
        placement.level_errors,
        made_of,
    )


def read_placement(path: Path) -> PlacementRecord:
    """Read a record that `to_json` made. Raises SceneError for anything else."""
    text = read_text(path, "file of places", SceneError, limit=MAX_BYTES)
    try:
        data = strict_json(text)
        for light in data["additions"]:
            if light.pop("without", None) or light.pop("with_it", None):
                raise ValueError("it has pictures")
        return read_record(PlacementRecord, data, required=("format",), is_exact=True)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise SceneError(
            f"{path} has no places of lights: {reason}; export it again from the painter, or "
            "leave ",
            Hint("placement"),
            " out",
        ) from None
