"""Writes luminaires into a scene's XML: as spots that plain Mitsuba knows, where these add up to
their light, else as the emitters of `lightpaint.mitsuba`.
"""

from collections.abc import Sequence

import numpy as np

from lightpaint.arrays import RGB, Doubles
from lightpaint.display_text import some_names
from lightpaint.luminaires import AREA_PLUGIN, POINT_PLUGIN
from lightpaint.luminaires.luminaire_request import NUMBER_KEYS
from lightpaint.luminaires.web import EMITTER_FROM_WEB, SpotPart, spots_of, world_from_web
from lightpaint.relit.emission_xml import spectrum_text
from lightpaint.scene.checks.tokens import tag
from lightpaint.scene.lights.emitters import Emitter
from lightpaint.scene.lights.hung_luminaires import (
    SPOT_MARK,
    HungLuminaire,
    luminaire_lines,
    matrix_text,
    panel_lines,
    rgb_text,
)
from lightpaint.scene.scene import Scene


def luminaire_of(scene: Scene, emitter: Emitter) -> HungLuminaire | None:
    """Return the luminaire that an emitter became by the lights file; None for any other."""
    hung = scene.parsed.luminaires.get(emitter.node)
    return hung if isinstance(hung, HungLuminaire) else None


def luminaire_xml(
    scene: Scene,
    emitter: Emitter,
    level: RGB,
    sampling_weight: float | None,
    powers: Doubles | None = None,
) -> list[str]:
    """Return the XML of a luminaire at a level, line by line, for the place of its element.

    sampling_weight: None for its own. powers: (81,), the spectrum of its level, in the place of a
    colour.
    """
    hung = luminaire_of(scene, emitter)
    assert hung is not None
    weight = emitter.sampling_weight if sampling_weight is None else sampling_weight
    props = scene.parsed.state.nodes[emitter.node].props
    numbers = {key: float(props[key]) for key in NUMBER_KEYS if key in props}
    file, shown = str(props["filename"]), np.array(level) if powers is None else powers
    intensity = _intensity(shown)
    if emitter.plugin == AREA_PLUGIN:
        name = "" if hung.is_panel else str(props.id())
        lines = luminaire_lines(
            AREA_PLUGIN, name, file, numbers, intensity, None, sampling_weight=weight
        )
        if not hung.is_panel:
            return lines
        shape = scene.parsed.state.nodes[scene.parsed.shape_of[emitter.node]].props
        matrix = np.array(shape["to_world"].matrix, np.float64).reshape(4, 4)
        return panel_lines(hung.name, str(shape.plugin_name()), matrix, lines)
    matrix = np.array(props["to_world"].matrix, np.float64).reshape(4, 4)
    if spots := _spots(hung, is_spectral=powers is not None):
        return _spot_lines(hung.name, spots, matrix, numbers, hung.scale * shown, weight)
    return luminaire_lines(
        POINT_PLUGIN, hung.name, file, numbers, intensity, matrix, sampling_weight=weight
    )


def _intensity(level: Doubles) -> str:
    """Return the XML of an intensity: a colour (3,) or a spectrum (81,)."""
    if len(level) == 3:
        return tag("rgb", name="intensity", value=rgb_text(level.tolist()))
    return tag("spectrum", name="intensity", value=spectrum_text(level))


def written_emission(scene: Scene, emitter: Emitter, level: RGB) -> RGB:
    """Return the emission that the element called like an emitter gets for a level of it.

    That is the level, but for a luminaire whose first spot has the name.
    """
    hung = luminaire_of(scene, emitter)
    spots = _spots(hung) if hung is not None and emitter.plugin == POINT_PLUGIN else ()
    if not spots:
        return level
    assert hung is not None
    r, g, b = (hung.scale * spots[0].candela * channel for channel in level)
    return r, g, b


def plugin_remark(scene: Scene) -> str | None:
    """Return a remark on luminaires that plain Mitsuba does not know; None without any."""
    names = [
        x.name
        for x in scene.emitters
        if (hung := luminaire_of(scene, x)) is not None
        and (x.plugin == AREA_PLUGIN or not _spots(hung, is_spectral=scene.is_spectral))
    ]
    if not names:
        return None
    return (
        f"the relit scene has luminaires that Mitsuba alone does not know, {some_names(names)}: "
        "`import lightpaint.mitsuba` before you load it there"
    )


def _spots(hung: HungLuminaire, *, is_spectral: bool = False) -> tuple[SpotPart, ...]:
    """Return the spots that add up to a luminaire; none with spectra if some are negative, which
    spectra of Mitsuba are not.
    """
    spots = spots_of(hung.request.web)
    return () if is_spectral and any(x.candela < 0 for x in spots) else spots


def _spot_lines(
    name: str,
    spots: Sequence[SpotPart],
    matrix: Doubles,
    numbers: dict[str, float],
    level: Doubles,
    weight: float,
) -> list[str]:
    """Return the XML of spots, the first of which has the name of the luminaire.

    level: a colour (3,) or a spectrum (81,), by which their candela are multiplied.
    """
    turn, tilt = numbers.get("turn", 0.0), numbers.get("tilt", 0.0)
    hung = np.eye(4)
    hung[:3, 3] = matrix[:3, 3]
    hung[:3, :3] = world_from_web(matrix[:3, :3], turn=turn, tilt=tilt) @ EMITTER_FROM_WEB.T
    lines: list[str] = []
    for k, spot in enumerate(spots if level.any() else spots[:1]):
        inner = [
            matrix_text(hung),
            tag("float", name="beam_width", value=f"{spot.beam:.9g}"),
            tag("float", name="cutoff_angle", value=f"{spot.cutoff:.9g}"),
            _intensity(spot.candela * level),
        ]
        if weight != 1:
            inner.append(tag("float", name="sampling_weight", value=f"{weight:g}"))
        spot_name = f"{name}{SPOT_MARK}{k + 1}" if k else name
        start = tag("emitter", type="spot", id=spot_name).replace("/>", ">")
        lines += [start, *(f"    {line}" for line in inner), "</emitter>"]
    return lines
