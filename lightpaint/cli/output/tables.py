"""Tables of scenes, bases and suggestions, with sentences below them."""

from collections.abc import Mapping, Sequence

import numpy as np

from lightpaint.arrays import as_rgb
from lightpaint.basis.cache import Entry
from lightpaint.cli.output import terminal
from lightpaint.colour import Photometry, photometry
from lightpaint.lighting import FullLamp
from lightpaint.placement import Suggestion
from lightpaint.relit import Verification
from lightpaint.report import agreement, spoken_percent, spoken_position, spoken_suggestions
from lightpaint.scene import MULTIPLE, Emitter, Light, Scene
from lightpaint.scene.lights.texels import domain_of, image_of, layouts_of, node_name


def show_lights(scene: Scene, cd_per_unit: float | None, lamps: Mapping[str, FullLamp]) -> None:
    """Print the lights of a scene, groups with their members. lamps: at full, by light."""
    headings = ("light", "plugin", "emission R G B", "unit", "size or place", "sampling", "colour")
    # Lumens and candelas need a scale.
    amounts = () if cd_per_unit is None else ("luminous", "flux")
    of_lamps = ("emitters", *(("lm at full",) if amounts else ()), "W at full") if lamps else ()
    table = terminal.table(*headings, *amounts, *of_lamps)
    adjusted = (x for x in scene.lights if not x.is_fixed and image_of(x.name))
    images = layouts_of(name for light in adjusted for name in light.member_names)
    for image, layout in images.items():
        texels = [x.emission for x in scene.emitters if x.texel and x.texel.image == image]
        light = scene.light(node_name(image, layout.nodes[0]))
        shares = layout.sums(domain_of(light.plugin).shares(layout.finest))
        mean = np.average(texels, axis=0, weights=shares)
        symmetric = ", symmetric" if image in scene.symmetric else ""
        size = f"{layout.size_text} {image}.xCOLUMN.yROW{symmetric}"
        table.row(image, light.plugin, terminal.numbers(as_rgb(mean)), light.unit, size, "", "")
    for light in scene.lights:
        if image_of(light.name) in images:
            continue
        is_single = light.member_names == (light.name,) and not light.is_fixed
        if not is_single:
            state = "fixed" if light.is_fixed else terminal.numbers(light.emission)
            unit = "" if light.is_fixed else light.unit
            count = f"{len(light.members)} emitter{'s' if len(light.members) > 1 else ''}"
            whole = photometry_of(light, cd_per_unit)
            table.row(
                light.name,
                light.plugin,
                state,
                unit,
                count,
                "",
                "" if light.is_fixed else whole.color,
                *whole.amounts[: len(amounts)],
                *_lamp_cells(light, cd_per_unit, lamps.get(light.name)),
            )
        # One row is enough for many similar lamps without names.
        for member in () if light.is_found else light.members:
            light_photometry = photometry_of(member, cd_per_unit)
            table.row(
                member.name if is_single else f"  {member.name}",
                member.plugin,
                terminal.numbers(member.emission),
                member.kind.unit if member.kind is not None else MULTIPLE,
                member.form,
                f"{member.sampling_weight:g}",
                light_photometry.color,
                *light_photometry.amounts[: len(amounts)],
                *_lamp_cells(light, cd_per_unit, lamps.get(light.name) if is_single else None),
            )
    terminal.print_table(table)


def _lamp_cells(light: Light, cd_per_unit: float | None, lamp: FullLamp | None) -> list[str]:
    """Return the names of a lamp's emitters, its lumens at full if there is a scale, and watts."""
    if lamp is None:
        return []
    flux = photometry_at_full(light, cd_per_unit, lamp).amounts[1].removesuffix(" lm")
    watts = "" if lamp.watts is None else f"{lamp.watts:.4g}"
    return [" + ".join(lamp.lamp.names), *([] if cd_per_unit is None else [flux]), watts]


def photometry_at_full(light: Light, cd_per_unit: float | None, lamp: FullLamp) -> Photometry:
    """Return the photometry of a light whose lamp is at full."""
    flux = light.unit_flux
    return photometry(lamp.emission, unit=light.unit, unit_flux=flux, cd_per_unit=cd_per_unit)


def photometry_of(light: Light | Emitter, cd_per_unit: float | None) -> Photometry:
    """Return the photometry of a light or of one of its emitters, as in the scene."""
    unit, flux = MULTIPLE, None
    if isinstance(light, Light):
        unit, flux = light.unit, light.unit_flux
    elif light.kind is not None:
        unit = light.kind.unit
        flux = None if light.unit_flux is None else (light.unit_flux,) * 3
    return photometry(light.emission, unit=unit, unit_flux=flux, cd_per_unit=cd_per_unit)


def show_kept(entries: Sequence[Entry]) -> None:
    """Print a row for each basis in the cache, the last used first."""
    table = terminal.table("scene", "sensor", "pixels", "lights", "spp", "seed", "MB", "file")
    for entry in reversed(entries):
        origin, cells = entry.origin, ["?"] * 6
        if origin is not None and entry.image_size is not None:
            height, width = entry.image_size
            cells = [origin.scene, origin.sensor, f"{width}x{height}", str(entry.lights)]
            cells += [str(origin.spp), str(origin.seed)]
        table.row(*cells, f"{entry.size / 1e6:.0f}", entry.path.name)
    terminal.print_table(table)


def spoken_agreement(result: Verification) -> str:
    """Return whether render and prediction agree, with numbers."""
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
    headings = ("suggested light", "at", "intensity R G B", "unit", "removes", "left", "colour")
    amounts = () if cd_per_unit is None else ("luminous", "flux")
    table = terminal.table(*headings, *amounts)
    for light in suggestions:
        light_photometry = light.photometry(cd_per_unit)
        table.row(
            light.name,
            spoken_position(light),
            terminal.numbers(light.emission),
            "W/sr",
            spoken_percent(light.gain_share),
            spoken_percent(light.missed_share),
            light_photometry.color,
            *light_photometry.amounts[: len(amounts)],
        )
    terminal.print_table(table)
    terminal.write("paste this into <scene>, and solve again:")
    for light in suggestions:
        terminal.write_lines(light.xml)
