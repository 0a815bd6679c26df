"""The text that `lightpaint solve` prints for an answer: short, or in full."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import fields
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Literal

import numpy as np

from lightpaint import report
from lightpaint.basis import BasisLight, LightImage, joined_texels, light_images
from lightpaint.cli.output import terminal
from lightpaint.cli.output.tables import spoken_agreement
from lightpaint.cli.output.vocabulary import BY_OPTION, spoken
from lightpaint.colour import LUMINANCE, luminance, rgb_to_hex
from lightpaint.display_text import some_names, some_of
from lightpaint.lighting import KEYS_BY_KIND, LightSetting, PlanesAnswer, Reason, renderings_of
from lightpaint.photometry import GlareReading
from lightpaint.pipeline import Look, Settings
from lightpaint.sentences import Sentence, SourceKey

Table = Literal["short", "full"]

#: Largest number of lights that are all shown; of more, this number of the most important ones.
MAX_FULL_LIGHTS, SHORT_LIST_LIGHTS = 16, 10

#: Width of a name in a table that fits 80 columns with a swatch.
NAME_WIDTH = 30

#: Share of its current emission at which a light counts as off.
OFF_SHARE = 2.0**-10


def show_look(look: Look, folder: Path, *, table: Table = "short") -> None:
    """Print how close the answer is, what the lights do, and which settings shaped it."""
    terminal.tell(look.verdict)
    for sentence in _sentences(look, table):
        terminal.tell(spoken(sentence))
    terminal.write("")
    if table == "full":
        _show_all(look)
    else:
        _show_short(look)
    if wheels := report.spoken_wheels(look.lighting.lights):
        terminal.tell(wheels)
    terminal.write("")
    if look.planes is not None:
        show_planes(look.planes)
    _show_renderings(look)
    terminal.tell(report.fit_sentence(look.solution, instead="--literal turns this off"))
    certificate = look.solution.certificate
    if curve := certificate.curve:
        counts_text = ", ".join(f"{100 * missed:.1f} % with {count}" for count, missed in curve)
        terminal.write(f"RMS miss of the painting, with noise, by number of lights: {counts_text}")
    terminal.write(f"results in {folder}{'' if str(folder).endswith('/') else '/'}")
    if note := undetermined_remark(look):
        terminal.say(note)
    if not certificate.converged:
        terminal.say(
            f"the solve stopped after {max(certificate.sweeps)} sweeps at a KKT residual of "
            f"{max(certificate.kkt_residual):.1e}"
        )
    if look.verification is not None and not look.verification.agrees:
        terminal.say(f"WARNING: {spoken_agreement(look.verification)}")


def show_planes(answer: PlanesAnswer) -> None:
    """Print what an answer gives on measuring planes."""
    if answer.readings:
        table = terminal.table(*report.HEADINGS)
        for row in report.plane_rows(answer):
            table.row(*row)
        terminal.print_table(table)
    show_glare(report.glare_by_title(answer))
    for sentence in report.planes_sentences(answer):
        terminal.tell(sentence)
    terminal.write("")


def show_glare(readings: Mapping[str, GlareReading]) -> None:
    """Print the glare that observers see. readings: by title."""
    if readings:
        terminal.write("")
        table = terminal.table(*report.GLARE_HEADINGS)
        for row in report.glare_rows(readings):
            table.row(*row)
        terminal.print_table(table)


def _show_renderings(look: Look) -> None:
    """Print what lamps reach of the Rf that was asked for."""
    lamps = [x.lamp for x in look.lighting.lights if x.lamp is not None]
    if not any(lamp.searches_rendering for lamp in lamps):
        return
    sentences = report.rendering_sentences(renderings_of(look.lighting))
    for sentence in sentences[:SHORT_LIST_LIGHTS]:
        terminal.tell(sentence)
    if more := sentences[SHORT_LIST_LIGHTS:]:
        terminal.tell(f"The report has the Rf of {len(more)} lamps more.")
    if sentences:
        terminal.write("")


def _sentences(look: Look, table: Table) -> list[str]:
    """Return the main reason why the answer is not closer, and whether other colours are closer.

    In full, return all reasons and the certainty. Sentences end with the options to change.
    """
    choice = report.closer_choice(look.analysis.color_choices)
    closer = [f"Other colours come closer: --colors {choice}."] if choice else []
    limits, appearance = _limit_sentences(look), look.analysis.appearance
    down = report.compensation_sentences(appearance.compensating_lights)
    if table == "short":
        limits = [] if appearance.is_close else limits[:1]
        # One line offers other colours, the one that says which light turns.
        if closer and any(report.ANY_COLOR in Sentence(sentence).parts for sentence in limits):
            limits = []
        return [*limits, *down, *closer]
    sentences = [
        *report.error_sentences(look.diagnosis, appearance, holds=[*limits, *down]),
        *closer,
    ]
    if look.uncertainty is not None:
        sentences.append(report.uncertainty_sentence(look.basis, look.solution, look.uncertainty))
    return sentences


def _limit_sentences(look: Look) -> list[str]:
    """Return the reasons that keep the lights from the painting, the main first, with options."""
    if not look.analysis.appearance.reasons:
        return report.bound_sentences(look.diagnosis)
    sentences = [_spoken_cause(look, reason) for reason in look.analysis.appearance.reasons]
    return [sentence for sentence in sentences if sentence][:2]


def _spoken_cause(look: Look, reason: Reason) -> str:
    """Return a reason in words, with the options to leave out."""
    about = report.spoken_about(look.analysis.appearance)
    sentence = report.spoken_cause(reason, weaker="--hold", about=about)
    keys = KEYS_BY_KIND.get(reason.kind, ())
    options = [
        f"--{'limit' if key == 'limits' else key} {name}"
        for name, constraint, origin in look.solution.problem.constraints.lights
        for key in keys
        if key in constraint
        and key != "duv"
        and SourceKey.of(origin).source == BY_OPTION
        and any(name == light or fnmatchcase(light, name) for light in reason.names)
    ]
    if not options:
        return sentence
    return f"{sentence.removesuffix('.')}: leave out {some_names(options, joint=' and ')}."


def spoken_settings(settings: Settings) -> str:
    """Return the settings in use, given or by default: `space display, hold 1, ...`."""
    values = {field.name: getattr(settings, field.name) for field in fields(settings)}
    transform = values.pop("transform")
    values |= {"view": transform and report.spoken_view(transform), "command": None}
    # Mention skipped stages, but not stages that always run.
    nonempty = {k: v for k, v in values.items() if v is not False and v not in (None, "")}
    return ", ".join(f"{k} {v}" for k, v in nonempty.items() if k not in ("verify", "report"))


def undetermined_remark(look: Look) -> str:
    """Return one line on lights that the painting does not determine; "" if there are none."""
    unreached = look.solution.certificate.unreached
    dark = [name for name in unreached if not look.basis.image(name).any()]
    notes = []
    unseen = [name for name in unreached if name not in dark]
    if dark:
        notes.append(f"the picture shows nothing of {_spoken(dark)}: left unchanged")
    if unseen:
        notes.append(f"no painted pixel sees {_spoken(unseen)}: left unchanged")
    notes += report.partly_reached(look.lighting)
    notes += [ambiguity.sentence for ambiguity in look.analysis.ambiguities]
    return f"the painting leaves lights open: {some_of(notes, joint='; ')}" if notes else ""


def _spoken(names: Sequence[str]) -> str:
    """Return names of lights, texels of an image by their number."""
    return some_names(joined_texels(names))


def _show_short(look: Look) -> None:
    """Print a row for each important light, in 80 columns, and a summary of the others."""
    lights, current_lights = look.lighting.lights, look.basis.lights
    shares = report.energy_shares(look.basis, look.lighting)
    errors = report.spoken_errors(look.uncertainty, len(shares))
    images = [image for image in light_images(current_lights) if image.is_whole]
    in_images = {int(k) for image in images for k in image.lights}
    important = _important_lights(look, in_images)
    table, swatches = terminal.table("light", "stops", "colour", "±", "share"), []
    for image in images:
        swatches.append(_add_image_row(table, look, image, float(shares[image.lights].sum())))
    for k in important:
        change_text = change(current_lights[k], lights[k])
        is_off = change_text == "off"
        swatches.append(None if is_off else _color(look, lights[k]))
        table.row(
            lights[k].name + "*" * lights[k].is_active,
            change_text,
            "" if is_off else _spoken_color(look, lights[k]),
            errors[k],
            f"{100 * shares[k]:.1f} %",
            room=NAME_WIDTH,
        )
    terminal.print_table(table, swatches)
    if note := report.untold_lights(look.lighting):
        terminal.tell(note)
    if other_indices := sorted(set(range(len(lights))) - set(important) - in_images):
        terminal.tell(_other_lights_text(look, other_indices))
    if any(lights[k].is_active for k in important):
        terminal.write("* limited by a constraint (--table full shows which)")


def _add_image_row(table: terminal.Rows, look: Look, image: LightImage, share: float) -> str | None:
    """Add the row of an image in texels with the change of its mean, and return its colour."""
    now, new = (image.mean(x) for x in (look.basis.current_weights, look.solution.weights))
    color = rgb_to_hex(new)
    is_off = not new.any()
    table.row(
        f"{image.name}, {image.size_text}",
        _stops(float(luminance(now)), float(luminance(new))),
        "" if is_off else color or "",
        "",
        f"{100 * share:.1f} %",
        room=NAME_WIDTH,
    )
    return None if is_off else color


def _important_lights(look: Look, in_images: Collection[int]) -> list[int]:
    """Return indices of the lights that matter or changed most in the picture, in order.

    in_images: lights that are texels of an image with a row of its own.
    """
    weights = look.solution.weights
    single = np.array([k for k in range(len(weights)) if k not in in_images], int)
    if len(single) <= MAX_FULL_LIGHTS:
        return [int(k) for k in single]
    change_size = np.abs(weights - look.basis.current_weights)
    power = ((change_size + weights) * look.basis.totals @ LUMINANCE)[single]
    order = np.argsort(-power, kind="stable")[:SHORT_LIST_LIGHTS]
    return sorted(int(k) for k in single[order])


def _other_lights_text(look: Look, other_indices: list[int]) -> str:
    """Return the number of other lights, their changes, and their share of the picture."""
    light_changes = [change(look.basis.lights[k], look.lighting.lights[k]) for k in other_indices]
    counts = {
        "off": light_changes.count("off"),
        "switched on": light_changes.count("on"),
        "fixed": light_changes.count("fixed"),
        "brighter": sum(x.startswith("+") for x in light_changes),
        "dimmer": sum(x.startswith("−") for x in light_changes),
        "as they were": light_changes.count("0.0") + light_changes.count("unchanged"),
    }
    text = ", ".join(f"{count} {kind}" for kind, count in counts.items() if count)
    share = report.energy_shares(look.basis, look.lighting)[other_indices].sum()
    percent = report.spoken_percent(float(share))
    return f"and {len(other_indices)} more ({text}): together {percent} of the picture"


def change(light: BasisLight, setting: LightSetting) -> str:
    """Return the change of a light in stops of luminance, `on` or `off`."""
    if light.is_fixed:
        return "fixed"
    if not any(setting.reached):
        return "unchanged"
    current_luminance, answer_luminance = (
        float(luminance(np.array(x.emission))) for x in (light, setting)
    )
    return _stops(current_luminance, answer_luminance)


def _stops(current_luminance: float, answer_luminance: float) -> str:
    """Return the change of a luminance in stops, `on` or `off`."""
    if answer_luminance <= OFF_SHARE * current_luminance:
        return "off"
    if current_luminance == 0:
        return "on"
    stops = f"{np.log2(answer_luminance / current_luminance):+.1f}"
    return "0.0" if stops in ("+0.0", "-0.0") else stops.replace("-", "−")


def _color(look: Look, light: LightSetting) -> str | None:
    """Return the colour of a light's swatch; the colour of its factor if its own is unknown."""
    if light.is_fixed or light.is_partly_reached:
        return None
    return look.lighting.photometry(light).hex or rgb_to_hex(np.array(light.emission))


def _spoken_color(look: Look, light: LightSetting) -> str:
    """Return `2700 K` for nearly white, else `#ff2010`; `× 1.46, 1, 0` for factors that differ."""
    appearance = look.lighting.photometry(light)
    if light.is_fixed or light.is_partly_reached:
        return ""
    if appearance.hex is None:
        factors = [f"{factor:.3g}" for factor in light.weight]
        return "" if len(set(factors)) == 1 else f"× {', '.join(factors)}"
    return appearance.hex if appearance.kelvin is None else f"{appearance.kelvin:.0f} K"


def _show_all(look: Look) -> None:
    """Print a row for each light: before, solved, certainty, and share of the picture."""
    shares = report.energy_shares(look.basis, look.lighting)
    has_constraints = any(light.constraint for light in look.lighting.lights)
    headings = ("light", "plugin", "emission now", "solved R G B", "±", "unit", "share", "colour")
    amounts = () if look.lighting.cd_per_unit is None else ("luminous", "flux")
    columns = ["constraint (* limits it)"] if has_constraints else []
    table = terminal.table(*headings, *amounts, *columns)
    errors = report.spoken_errors(look.uncertainty, len(shares))
    for k, (light, current_light) in enumerate(
        zip(look.lighting.lights, look.basis.lights, strict=True)
    ):
        appearance = look.lighting.photometry(light)
        table.row(
            light.name,
            light.plugin,
            "" if light.is_fixed else terminal.numbers(current_light.emission),
            "fixed" if light.is_fixed else _emission_text(light),
            errors[k],
            "" if light.is_fixed else light.unit,
            f"{100 * shares[k]:.1f} %",
            "" if light.is_fixed else appearance.color,
            *appearance.amounts[: len(amounts)],
            *([_constraint_text(light)] if has_constraints else []),
        )
    terminal.print_table(table)
    if note := report.spoken_preference(look.lighting.lights):
        terminal.tell(note)


def _constraint_text(light: LightSetting) -> str:
    """Return the constraint on a light, of a lamp the drives of its emitters."""
    text = light.constraint if light.lamp is None else report.spoken_lamp(light)
    return text + "*" * light.is_active


def _emission_text(light: LightSetting) -> str:
    if not any(light.emission):
        return "off"
    emission_text = terminal.numbers(light.emission)
    if all(light.reached):
        return emission_text
    note = f"{report.unreached_channels(light)} unchanged" if any(light.reached) else "unchanged"
    return f"{emission_text} ({note})"
