"""What commands print of scenes and answers: tables, and sentences below them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lightpaint.basis.cache import Entry
from lightpaint.cli import terminal
from lightpaint.colour.photometry import Photometry, photometry
from lightpaint.placement.suggestion import Suggestion
from lightpaint.relit.verification import Verification
from lightpaint.report.measures import energy_shares
from lightpaint.report.sentences import (
    how_sure,
    partly_reached,
    spoken_errors,
    spoken_percent,
    unreached_channels,
    what_is_missed,
)
from lightpaint.report.suggestion import spoken_position, spoken_suggestions
from lightpaint.report.verdict import agreement
from lightpaint.results import Look
from lightpaint.scene.emission import MULTIPLE
from lightpaint.scene.emitters import Emitter
from lightpaint.scene.lights import WHOLE_EMISSION, Light
from lightpaint.scene.scene import Scene
from lightpaint.screen import some_names


def show_lights(scene: Scene, cd_per_unit: float | None) -> None:
    """Print the lights of a scene as they are, groups with their members."""
    headings = ("light", "plugin", "emission R G B", "unit", "size or place", "sampling", "colour")
    # Lumen and candela only where somebody has said what a number stands for.
    amounts = () if cd_per_unit is None else ("luminous", "flux")
    table = terminal.table(*headings, *amounts)
    for light in scene.lights:
        single = light.member_names == (light.name,) and not light.is_fixed
        if not single:
            what = "kept as it is" if light.is_fixed else terminal.numbers(light.emission)
            unit = "" if light.is_fixed else light.unit
            count = f"{len(light.members)} emitter{'s' if len(light.members) > 1 else ''}"
            whole = _photometry(light, cd_per_unit)
            table.row(
                light.name,
                light.plugin,
                what,
                unit,
                count,
                "",
                "" if light.is_fixed else whole.color,
                *whole.amounts[: len(amounts)],
            )
        for member in light.members:
            its = _photometry(member, cd_per_unit)
            table.row(
                member.name if single else f"  {member.name}",
                member.plugin,
                terminal.numbers(member.emission),
                member.kind.unit if member.kind is not None else MULTIPLE,
                member.form,
                f"{member.sampling_weight:g}",
                its.color,
                *its.amounts[: len(amounts)],
            )
    terminal.print_table(table)


def _photometry(light: Light | Emitter, cd_per_unit: float | None) -> Photometry:
    """As the scene has it."""
    unit, flux = MULTIPLE, None
    if isinstance(light, Light):
        unit, flux = light.unit, light.unit_flux
    elif light.kind is not None:
        unit = light.kind.unit
        flux = None if light.unit_flux is None else (light.unit_flux,) * 3
    return photometry(light.emission, unit=unit, unit_flux=flux, cd_per_unit=cd_per_unit)


def described(light: Light, cd_per_unit: float | None) -> dict[str, Any]:
    """A light, and the emitters in it, for other programs."""
    members = [
        {
            "name": member.name,
            "plugin": member.plugin,
            "parameter": member.kind.parameter if member.kind is not None else WHOLE_EMISSION,
            "unit": member.kind.unit if member.kind is not None else MULTIPLE,
            "emission": list(member.emission),
            "form": member.form,
            "sampling_weight": member.sampling_weight,
            "photometry": _photometry(member, cd_per_unit).fields(),
        }
        for member in light.members
    ]
    about = {
        "name": light.name,
        "plugin": light.plugin,
        "parameter": light.parameter,
        "unit": light.unit,
        "emission": list(light.emission),
        "form": light.form,
        "is_fixed": light.is_fixed,
        "photometry": _photometry(light, cd_per_unit).fields(),
        "members": members,
    }
    if len(members) == 1:
        about["sampling_weight"] = light.members[0].sampling_weight
    return about


def show_look(look: Look, folder: Path) -> None:
    """Print the lights that were solved for, and what is to be said of the answer."""
    _show_solved(look)
    terminal.write(look.verdict)
    for sentence in what_is_missed(look.diagnosis):
        terminal.write(sentence)
    if look.uncertainty is not None:
        terminal.write(how_sure(look.basis, look.solution, look.uncertainty))
    terminal.write(f"results in {folder}{'' if str(folder).endswith('/') else '/'}")
    certificate = look.solution.certificate
    if curve := certificate.curve:
        listed = ", ".join(f"{100 * missed:.1f} % with {count}" for count, missed in curve)
        terminal.write(f"missed of the painting (RMS, with noise), by number of lights: {listed}")
    _say_unreached(look)
    for channels in partly_reached(look.lighting):
        terminal.say(channels)
    for ambiguity in look.analysis.ambiguities:
        terminal.say(ambiguity.sentence)
    if not certificate.converged:
        terminal.say(
            f"the solve stopped after {max(certificate.sweeps)} sweeps at a KKT residual of "
            f"{max(certificate.kkt_residual):.1e}"
        )
    if look.verification is not None and not look.verification.agrees:
        terminal.say(f"WARNING: {spoken_agreement(look.verification)}")


def _say_unreached(look: Look) -> None:
    """Say of which lights nothing is known, and what would help."""
    unreached = look.solution.certificate.unreached
    dark = [name for name in unreached if not look.basis.image(name).any()]
    if dark:
        terminal.say(f"the picture holds nothing of {some_names(dark)}: kept as it is")
    if seen := [name for name in unreached if name not in dark]:
        terminal.say(
            f"no painted pixel sees {some_names(seen)}: kept as it is; "
            "paint where it shines, or pass --unpainted"
        )


def _show_solved(look: Look) -> None:
    """Print a row for each light: before, solved, how sure, and what it does to the picture."""
    shares = energy_shares(look.basis, look.lighting)
    held = any(light.constraint for light in look.lighting.lights)
    headings = ("light", "plugin", "emission now", "solved R G B", "±", "unit", "share", "colour")
    amounts = () if look.lighting.cd_per_unit is None else ("luminous", "flux")
    asked = ["asked (* holds it)"] if held else []
    table = terminal.table(*headings, *amounts, *asked)
    errors = spoken_errors(look.uncertainty, len(shares))
    for k, (light, now) in enumerate(zip(look.lighting.lights, look.basis.lights, strict=True)):
        solved = "off" if not any(light.emission) else terminal.numbers(light.emission)
        if not all(light.reached) and any(light.emission):
            kept = f"{unreached_channels(light)} kept" if any(light.reached) else "kept"
            solved += f" ({kept})"
        seen = look.lighting.photometry(light)
        table.row(
            light.name,
            light.plugin,
            "" if light.is_fixed else terminal.numbers(now.emission),
            "kept" if light.is_fixed else solved,
            errors[k],
            "" if light.is_fixed else light.unit,
            f"{100 * shares[k]:.1f} %",
            "" if light.is_fixed else seen.color,
            *seen.amounts[: len(amounts)],
            *([light.constraint + "*" * light.is_active] if held else []),
        )
    terminal.print_table(table)


def show_kept(entries: Sequence[Entry]) -> None:
    """Print a row for each basis in the cache, the last used first."""
    table = terminal.table("scene", "sensor", "pixels", "lights", "spp", "seed", "MB", "file")
    for entry in reversed(entries):
        known, about = entry.origin, ["?"] * 6
        if known is not None and entry.image_size is not None:
            height, width = entry.image_size
            about = [known.scene, known.sensor, f"{width}x{height}", str(entry.lights)]
            about += [str(known.spp), str(known.seed)]
        table.row(*about, f"{entry.size / 1e6:.0f}", entry.path.name)
    terminal.print_table(table)


def spoken_agreement(result: Verification) -> str:
    """Whether render and prediction agree, with numbers."""
    return (
        f"{agreement(result)}; RMSE {result.rmse:.2g} (noise {result.noise_rmse:.2g}), "
        f"ΔE {result.delta_e_mean:.1f}"
    )


def show_suggestions(
    suggestions: Sequence[Suggestion], *, cd_per_unit: float | None = None
) -> None:
    """Print the lights that would help, and their XML."""
    terminal.write("")
    terminal.write(spoken_suggestions(suggestions))
    if not suggestions:
        return
    headings = ("suggested light", "at", "intensity R G B", "unit", "takes away", "left", "colour")
    amounts = () if cd_per_unit is None else ("luminous", "flux")
    table = terminal.table(*headings, *amounts)
    for light in suggestions:
        seen = light.photometry(cd_per_unit)
        table.row(
            light.name,
            spoken_position(light),
            terminal.numbers(light.emission),
            "W/sr",
            spoken_percent(light.gain_share),
            spoken_percent(light.missed_share),
            seen.color,
            *seen.amounts[: len(amounts)],
        )
    terminal.print_table(table)
    terminal.write("to be pasted into <scene>, and solved again:")
    for light in suggestions:
        terminal.write_lines(light.xml)
