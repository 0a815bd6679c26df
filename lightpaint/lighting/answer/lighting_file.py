"""The file of a lighting, lighting.json (docs/formats.md)."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.colour import Lamp
from lightpaint.display_text import some_names
from lightpaint.errors import LightingError
from lightpaint.files import one_line, read_text, write_text
from lightpaint.keywords import keywords
from lightpaint.lighting.answer.certificate import Certificate
from lightpaint.lighting.answer.lighting import ALL_REACHED, Lighting, LightSetting
from lightpaint.lighting.answer.lighting_keys import LightingKey
from lightpaint.scene.properties.site import EmitterPlace
from lightpaint.storage.json_records import fields_of, read_record, strict_json
from lightpaint.validation import is_number
from lightpaint.version import __version__

FORMAT = "lightpaint-lighting 1"

#: Longest lighting file that is read, in bytes: a light takes some 2 kB.
MAX_BYTES = 2**23

#: Fields of a lighting that its file has under their own names.
PLAIN_FIELDS = ("target", "scene_identity", "cd_per_unit", "up", "observer")

#: Fields of a light's lamp, which its file has beside the others.
LAMP_FIELDS = ("emitters", "power_share", "prefer", "is_wheel", "least_rf", "behind")

#: Difference of drives, and of emissions relative to their size, that is rounding of a file.
SAME_DRIVES = 1e-3

#: Difference of drives that is round-off.
ROUNDED = 1e-9

#: Key of a lamp whose drives are the answer, found with spectra; its emission follows from them.
SPECTRAL = "is_spectral"

#: Fields of a certificate for options of the fit, written where they differ from the paper.
FIT_FIELDS = ("display", "rounds", "hold", "colors", "noise_removed", "software", "basis_spp")

#: Fields of a certificate for the difference to the painting, if computed.
APPEARANCE_FIELDS = ("delta_e", "delta_e_noise", "delta_e_asked")


@keywords()
def write_lighting(path: str | Path, lighting: Lighting) -> None:
    """Write lighting.json (docs/formats.md), whole or not at all.

    Args:
        path: The file to write.
        lighting: The lighting to keep.

    Examples:
        >>> lp.write_lighting("evening.json", lp.solve(basis, target).lighting)
        >>> len(lp.read_lighting("evening.json").lights)
        2
    """
    data = lighting_fields(lighting.of_lamps())
    write_text(Path(path), json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def lighting_fields(lighting: Lighting) -> dict[str, Any]:
    """Return the content of a lighting.json as plain values."""
    data: dict[str, Any] = {
        "format": FORMAT,
        "lightpaint": __version__,
        "target": lighting.target,
        "scene_identity": lighting.scene_identity,
        **({} if lighting.cd_per_unit is None else {"cd_per_unit": lighting.cd_per_unit}),
        "lights": {
            light.name: {
                "plugin": light.plugin,
                "parameter": light.parameter,
                "unit": light.unit,
                "emission": light.emission,
                "weight": light.weight,
                **_optional_fields(light),
                **_photometry(lighting, light),
            }
            for light in lighting.lights
        },
    }
    if lighting.observer.is_camera:
        data["observer"] = asdict(lighting.observer)
    if lighting.animation:
        data["keys"] = [_key_fields(lighting, key) for key in lighting.animation]
    if lighting.places:
        data["up"] = lighting.up
        data["places"] = {place.name: _place_fields(place) for place in lighting.places}
    if (q := lighting.certificate) is not None:
        data["solve"] = fields_of(
            q, "curve", "bounds", "objective_error", *FIT_FIELDS, *APPEARANCE_FIELDS
        )
    return data


@keywords()
def read_lighting(path: str | Path) -> Lighting:
    """Read a file of `write_lighting`.

    Args:
        path: A lighting.json.

    Raises:
        LightingError: For anything else.

    Examples:
        >>> lp.read_lighting("lighting.json").emission["panel"]
        (2.0, 1.5, 1.0)
    """
    path = Path(path)
    text = read_text(path, "lighting file", LightingError, limit=MAX_BYTES)
    try:
        data = strict_json(text)
    except ValueError as error:
        raise LightingError(f"{path} is not a JSON file: {one_line(str(error))}") from None
    format_found = data.get("format") if isinstance(data, dict) else None
    if format_found is None:
        raise LightingError(f"{path} is not a lighting: expected a lighting.json that solve wrote")
    if format_found != FORMAT:
        raise LightingError(
            f"{path} has the format {one_line(repr(format_found))}: expected {FORMAT!r}"
        )
    try:
        fields = {key: data[key] for key in PLAIN_FIELDS if key in data}
        lighting = read_record(Lighting, {"lights": [], **fields})
        lights = tuple(_read_setting(name, light) for name, light in data["lights"].items())
        certificate = None
        if "solve" in data:
            solve_record = data["solve"]
            certificate = read_record(
                Certificate, solve_record, required=["unreached"], others=True
            )
        places = tuple(
            read_record(EmitterPlace, {**place, "name": name}, others=True)
            for name, place in data.get("places", {}).items()
        )
        keys = tuple(_read_key(key, lights) for key in data.get("keys", ()))
        return replace(
            lighting, lights=lights, certificate=certificate, places=places, animation=keys
        )
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise LightingError(f"{path} is not a complete lighting: {one_line(repr(error))}") from None
    except LightingError as error:
        raise LightingError(f"{path}: {one_line(str(error))}") from None


def _key_fields(lighting: Lighting, key: LightingKey) -> dict[str, Any]:
    """Return a key: its frame, its painting, and the weights of lights by their names."""
    weights = dict(zip(lighting, key.weights, strict=True))
    return {"frame": key.frame, "target": key.target, "weights": weights}


def _read_key(data: Mapping[str, Any], lights: Sequence[LightSetting]) -> LightingKey:
    """Return a key that `_key_fields` described."""
    weights, frame = data["weights"], data["frame"]
    if type(frame) is not int:
        raise ValueError(f"the frame of a key is a whole number, not {frame!r}")
    if set(weights) != {light.name for light in lights}:
        raise ValueError(f"the key of frame {frame} is of other lights")
    values = [weights[light.name] for light in lights]
    key = read_record(LightingKey, {**data, "frame": 0, "weights": values}, others=True)
    return replace(key, frame=frame)


def _read_setting(name: str, data: Mapping[str, Any]) -> LightSetting:
    if data.get("members") == []:
        raise ValueError("members is a list of names, not empty")
    fields = {**data, "name": name}
    if "emitters" in data:
        fields["lamp"] = {key: data[key] for key in LAMP_FIELDS if key in data}
        if data.get(SPECTRAL) is True:
            names, errors = [x["name"] for x in data["emitters"]], data.get("drive_errors", {})
            fields["mix"] = [data["drives"][name] for name in names]
            fields["mix_errors"] = [errors.get(name) for name in names] if errors else None
    light: LightSetting = read_record(LightSetting, fields, others=True)
    if light.lamp is not None and light.mix is None and "drives" in data:
        return _with_drives(light, light.lamp, data["drives"])
    return light


def _with_drives(light: LightSetting, lamp: Lamp, drives: Mapping[str, Any]) -> LightSetting:
    """Return a light with the drives of its file, if its lamp prefers others.

    Raises LightingError for drives that somebody has changed, without the emission that they mix.
    """
    if set(drives) != set(lamp.names) or not all(map(is_number, drives.values())):
        raise LightingError(
            f"light {light.name!r} has drives that are not numbers of its emitters, "
            f"{some_names(lamp.names)}"
        )
    written = np.array([drives[name] for name in lamp.names], np.float64)
    mixed, emission = lamp.mix(written), np.array(light.emission)
    own = np.array([*light.drives.values()])
    if np.abs(mixed - emission).max() <= SAME_DRIVES * np.abs(emission).max():
        is_own = np.abs(written - own).max() <= ROUNDED
        return light if is_own else replace(light, edited_mix=tuple(written.tolist()))
    # An emission that they cannot mix has the drives of the nearest that they can.
    if np.abs(written - own).max() > SAME_DRIVES:
        own_text, other = (" ".join(f"{x:.6g}" for x in rgb) for rgb in (mixed, emission))
        raise LightingError(
            f"light {light.name!r} has drives that mix {own_text}, and the emission {other}: set "
            "emission and weight to what the drives mix, or leave drives out"
        )
    return light


def _place_fields(place: EmitterPlace) -> dict[str, Any]:
    """Return the fields of a place that are given."""
    record = asdict(place)
    old = record["moved_from"]
    if old is not None:
        record["moved_from"] = {key: value for key, value in old.items() if value is not None}
    return {key: value for key, value in record.items() if value and key != "name"}


def _optional_fields(light: LightSetting) -> dict[str, Any]:
    """Return the fields of a light that differ from their defaults."""
    ties: dict[str, Any] = {}
    if light.reached != ALL_REACHED:
        ties["reached"] = light.reached
    if light.standard_error is not None:
        ties["standard_error"] = light.standard_error
    if light.interval is not None:
        ties["interval"] = light.interval
    for flag in ("untold", "is_outside_gamut"):
        if getattr(light, flag):
            ties[flag] = True
    if light.is_fixed:
        ties["is_fixed"] = True
    if light.members != (light.name,):
        ties["members"] = light.members
    if light.lamp is not None:
        ties |= _lamp_fields(light, light.lamp)
    if light.constraint:
        ties |= {"constraint": light.constraint, "is_active": light.is_active}
    return ties


def _lamp_fields(light: LightSetting, lamp: Lamp) -> dict[str, Any]:
    """Return the emitters of a light, and their drives, which follow from its emission."""
    fields: dict[str, Any] = {"drives": dict(light.drives)}
    if light.mix is not None:
        fields[SPECTRAL] = True
    if light.standard_error is not None or any(x is not None for x in light.mix_errors or ()):
        fields["drive_errors"] = dict(light.drive_errors)
    if light.solved_mix is not None:
        fields["solved_mix"] = light.solved_mix
    if light.held_mix_change is not None:
        fields["held_mix_change"] = light.held_mix_change
    emitters = [fields_of(x, "watts", "spectrum") for x in lamp.emitters]
    if light.mixed_emission is not None:
        fields |= {"mixed_emission": light.mixed_emission}
    wheel = {"slot": light.slot or None, "slot_delta_e": light.slot_delta_e}
    fields |= {key: value for key, value in wheel.items() if value is not None}
    return fields | fields_of(lamp, *LAMP_FIELDS[1:]) | {"emitters": emitters}


def _photometry(lighting: Lighting, light: LightSetting) -> dict[str, Any]:
    """Return values that follow from the emission, for people and programs; only `unit_flux` is
    read back.
    """
    fields: dict[str, Any] = {} if light.unit_flux is None else {"unit_flux": light.unit_flux}
    return (
        fields if light.is_fixed else {**fields, "photometry": lighting.photometry(light).fields()}
    )
