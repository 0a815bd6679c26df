"""The documents of `--json`, for programs (docs/solving.md)."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lightpaint.basis import Basis
from lightpaint.basis.cache import basis_cache
from lightpaint.cli.doctor import Finding
from lightpaint.cli.output.tables import photometry_at_full, photometry_of
from lightpaint.lighting import Appearance, FullLamp
from lightpaint.pipeline import RECORD, Job, Look, PaintedView
from lightpaint.relit import Verification
from lightpaint.report import finite, verification_numbers
from lightpaint.scene import MULTIPLE, WHOLE_EMISSION, Light, Scene


@dataclass(frozen=True)
class Tolerances:
    """The required closeness of an answer; None for no requirement.

    max_miss: largest mean ΔE over the painted pixels. min_fit: smallest `Appearance.share_met`.
    """

    max_miss: float | None = None
    min_fit: float | None = None

    def shortfalls(self, appearance: Appearance) -> list[str]:
        """Return the unmet tolerances of an answer, as text that follows its name."""
        shortfalls = []
        if self.max_miss is not None and appearance.delta_e > self.max_miss:
            shortfalls.append(
                f"misses a mean ΔE of {appearance.delta_e:.3f}, more than --max-miss "
                f"{self.max_miss:g}"
            )
        if self.min_fit is not None and appearance.share_met < self.min_fit:
            shortfalls.append(
                f"meets a share of {appearance.share_met:.3f}, less than --min-fit {self.min_fit:g}"
            )
        return shortfalls

    def document(self, appearance: Appearance) -> dict[str, object]:
        """Return the requirements and whether they are met, for programs."""
        requirements = {"max_miss": self.max_miss, "min_fit": self.min_fit}
        if not (
            requirements := {
                name: value for name, value in requirements.items() if value is not None
            }
        ):
            return {}
        return {"asked": requirements, "is_met": not self.shortfalls(appearance)}


def lights_document(
    scene: Scene, cd_per_unit: float | None, lamps: Mapping[str, FullLamp]
) -> dict[str, Any]:
    """Return the document of `lights`. lamps: at full, by light."""
    scale = {} if cd_per_unit is None else {"cd_per_unit": cd_per_unit}
    listed = [
        light_document(x, cd_per_unit) | lamp_document(x, cd_per_unit, lamps.get(x.name))
        for x in scene.lights
    ]
    return {"scene": str(scene.path), **scale, "lights": listed}


def lamp_document(light: Light, cd_per_unit: float | None, lamp: FullLamp | None) -> dict[str, Any]:
    """Return what mixes a light, and its light and power at full; empty without a lamp."""
    if lamp is None:
        return {}
    emitters = [
        {"name": x.name, "emission": list(x.emission), "max": x.most, "watts": x.watts}
        for x in lamp.lamp.emitters
    ]
    full = photometry_at_full(light, cd_per_unit, lamp)
    return {
        "emitters": emitters,
        "at_full": {"emission": list(lamp.emission), "watts": lamp.watts, **full.fields()},
    }


def light_document(light: Light, cd_per_unit: float | None) -> dict[str, Any]:
    """Return a light, and the emitters in it, for other programs."""
    members = [
        {
            "name": member.name,
            "plugin": member.plugin,
            "parameter": member.kind.parameter if member.kind is not None else WHOLE_EMISSION,
            "unit": member.kind.unit if member.kind is not None else MULTIPLE,
            "emission": list(member.emission),
            "form": member.form,
            "sampling_weight": member.sampling_weight,
            "photometry": photometry_of(member, cd_per_unit).fields(),
        }
        for member in light.members
    ]
    document = {
        "name": light.name,
        "plugin": light.plugin,
        "parameter": light.parameter,
        "unit": light.unit,
        "emission": list(light.emission),
        "form": light.form,
        "is_fixed": light.is_fixed,
        "photometry": photometry_of(light, cd_per_unit).fields(),
        "members": members,
    }
    if len(members) == 1:
        document["sampling_weight"] = light.members[0].sampling_weight
    return document


def basis_document(file: Path, basis: Basis) -> dict[str, Any]:
    """Return the document of `basis`."""
    height, width = basis.size
    return {
        "file": str(file),
        "scene": basis.origin.scene,
        "sensor": basis.origin.sensor,
        "lights": [light.name for light in basis.lights if not light.is_fixed],
        "kept": [light.name for light in basis.lights if light.is_fixed],
        "size": [width, height],
        "spp": basis.origin.spp,
        "seed": basis.origin.seed,
        "method": basis.origin.method,
    }


def result_document(
    job: Job, view: PaintedView, look: Look, tolerances: Tolerances
) -> dict[str, Any]:
    """Return the document of one view in `solve`: its report.json, lighting.json and files."""
    other_folders = {other_view.folder for other_view in job.views} - {view.folder, job.folder}
    files = [*job.results.files, job.folder / RECORD]
    return {
        "target": look.target.name,
        "sensor": look.basis.origin.sensor,
        "folder": str(job.folder),
        "view": str(view.folder),
        "files": [str(x) for x in files if x.is_file() and x.parent not in other_folders],
        "verdict": look.verdict,
        "is_close": look.analysis.appearance.is_close,
        **tolerances.document(look.analysis.appearance),
        "report": _in_file(view.folder / "report.json"),
        "lighting": _in_file(job.folder / "lighting.json"),
    }


def _in_file(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))


def files_document(folder: Path, files: Sequence[Path], **fields: Any) -> dict[str, Any]:
    """Return files that were written, and their folder."""
    return {**fields, "folder": str(folder), "files": [str(file) for file in files]}


def verified_document(folder: Path, result: Verification) -> dict[str, Any]:
    """Return the document of one folder in `verify`, as in report.json."""
    return {"folder": str(folder), **dict(finite(verification_numbers(result)))}


def kept_document(entry: basis_cache.Entry) -> dict[str, Any]:
    """Return the document of one basis in the cache, without unreadable fields."""
    document: dict[str, Any] = {"file": str(entry.path), "bytes": entry.size}
    if (origin := entry.origin) is not None and entry.image_size is not None:
        height, width = entry.image_size
        document |= {"scene": origin.scene, "sensor": origin.sensor, "size": [width, height]}
        document |= {"lights": entry.lights, "spp": origin.spp, "seed": origin.seed}
    return document


def doctor_document(findings: Sequence[Finding]) -> dict[str, Any]:
    """Return the document of `doctor`."""
    return {
        "ok": all(finding.state != "missing" for finding in findings),
        "findings": [
            {
                "what": finding.subject,
                "state": finding.state,
                "found": finding.result,
                **({"remedy": finding.remedy} if finding.remedy else {}),
            }
            for finding in findings
        ],
    }
