"""Writes the emission of a light into its element of the scene XML.

Luminaires become spots that plain Mitsuba knows, where these add up to their light, else the
emitters of `lightpaint.mitsuba`.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lightpaint import luminaires
from lightpaint.arrays import RGB, Doubles, Floats
from lightpaint.colour import WAVELENGTHS
from lightpaint.display_text import some_names
from lightpaint.errors import SceneError
from lightpaint.relit.xml_edit import Element, XmlFile
from lightpaint.scene import (
    AS_AUTHORED,
    SPOT_MARK,
    Emitter,
    HungLuminaire,
    Scaling,
    Scene,
    child_named,
    luminaire_lines,
    matrix_text,
    panel_lines,
    rgb_text,
)
from lightpaint.scene.checks.tokens import tag

#: Luminance that Mitsuba shows for a power per nanometre that has the luminance 1 for the observer.
LUMINANCE_OF_POWER = 0.009367658735689113


@dataclass
class Changes:
    """Changes of an element's children: replacements, and insertions of new ones.

    replaced: the reference, and its file, in whose place the changed element is written; None for
    an element that is changed where it is.
    """

    xml: XmlFile
    element: Element
    replaced: tuple[XmlFile, Element] | None = None
    _missing: list[str] = field(default_factory=list)

    def set(self, kind: str, name: str, value: str) -> None:
        """Set the child `<kind name=… value=…/>`, replacing one with that name.

        name: in snake_case. An existing child keeps its spelling, since Mitsuba rejects a mixture.
        """
        child = self._child_named(name)
        if child is None:
            self._missing.append(tag(kind, name=name, value=value))
        else:
            self.xml.replace(child, tag(kind, name=child.attributes["name"], value=value))

    def set_element(self, name: str, text: str) -> None:
        """Set the child called `name` to the XML `text`, replacing one with that name."""
        child = self._child_named(name)
        if child is None:
            self._missing.append(text)
        else:
            spelling = child.attributes["name"]
            self.xml.replace(child, text.replace(f'"{name}"', f'"{spelling}"', 1))

    def has(self, name: str) -> bool:
        """Return whether there is a child called `name`."""
        return self._child_named(name) is not None

    def replace(self, name: str, text: str) -> None:
        """Put the XML `text` in the place of the child called `name`, or add it."""
        child = self._child_named(name)
        if child is None:
            self._missing.append(text)
        else:
            self.xml.replace(child, text)

    def number(self, name: str, otherwise: float) -> float:
        """Return the number in the child called `name`, or `otherwise` if there is none."""
        child = self._child_named(name)
        text = child.attributes.get("value", "") if child is not None else f"{otherwise}"
        try:
            return float(text)
        except ValueError:
            raise SceneError(
                f"cannot scale {name}={text!r}: write a number in the place of the parameter"
            ) from None

    def child(self, name: str, definition: tuple[Path, int]) -> "Changes":
        """Return changes of the child called `name`, which there must be.

        definition: its file, and the offset of its element there. If that is only referred to, and
        others may share it, the changes are changes of a copy in the place of the reference.
        """
        child = self._child_named(name)
        assert child is not None
        if child.tag != "ref":
            return Changes(self.xml, child)
        file, offset = definition
        xml = XmlFile(file)
        return Changes(xml, xml.element_at(offset), (self.xml, child))

    def _child_named(self, name: str) -> Element | None:
        """Return the child called `name`; None if there certainly is none."""
        child = self.element.child_named(name)
        unresolved = next((c for c in self.element.children if "$" in c.name), None)
        if child is None and unresolved is not None:
            spelt = unresolved.attributes["name"]
            raise SceneError(
                f"{self.xml.place_of(unresolved)}: <{unresolved.tag} name={spelt!r}> in "
                f"{self._title()} may be its {name}: write the name in the place of the parameter"
            )
        return child

    def _title(self) -> str:
        attributes = self.element.attributes
        id_or_name = attributes.get("id") or attributes.get("name") or attributes.get("type", "")
        return f"<{self.element.tag}> {id_or_name!r}"

    def finish(self) -> None:
        """Pass on the insertions; must be called once, last."""
        if self._missing:
            self.xml.insert_first(self.element, self._missing)
        if self.replaced is not None:
            xml, reference = self.replaced
            name = reference.attributes["name"]
            xml.replace(reference, self.xml.edited_copy(self.element, name))


def set_emission(
    changes: Changes, scene: Scene, emitter: Emitter, rgb: RGB, *, stem: str
) -> dict[str, Floats]:
    """Set the emission of `emitter` to `rgb`, in the unit of its kind.

    stem: prefix of the names of images. Returns the images that must lie beside the relit scene,
    (h, w, 3) linear, by file name.
    """
    kind = emitter.kind
    assert kind is not None  # emitters that cannot be scaled are never set
    if kind.scaling is Scaling.COLOUR:
        changes.set("rgb", kind.parameter, " ".join(f"{np.float32(v):.9g}" for v in rgb))
    elif kind.scaling is Scaling.FACTORS:
        holder = changes
        if emitter.plugin != "sunsky":
            holder = changes.child(kind.parameter, _definition(scene, emitter, kind.parameter))
        for factor in kind.factors:
            holder.set("float", factor, f"{holder.number(factor, 1.0) * rgb[0]:.9g}")
        if holder is not changes:
            holder.finish()
    elif emitter.plugin != "area" and len(set(rgb)) == 1:
        changes.set("float", "scale", f"{changes.number('scale', 1.0) * rgb[0]:.9g}")
    elif not any(rgb):
        changes.set("rgb", kind.parameter, "0 0 0")
    elif rgb != AS_AUTHORED:
        return _scale_image(changes, scene, emitter, kind.parameter, rgb, stem)
    return {}


def set_spectrum(changes: Changes, emitter: Emitter, powers: Doubles) -> None:
    """Set the emission of `emitter` to a spectrum. powers: (81,) at WAVELENGTHS, for luminance."""
    assert emitter.kind is not None
    changes.set("spectrum", emitter.kind.parameter, spectrum_text(powers))


def spectrum_text(powers: Doubles) -> str:
    """Return a spectrum as XML has it. powers: (81,) at WAVELENGTHS, for luminance."""
    if not powers.any():  # a spectrum without power, which Mitsuba refuses
        return "0"
    values = zip(WAVELENGTHS.tolist(), (powers / LUMINANCE_OF_POWER).tolist(), strict=True)
    return ", ".join(f"{wave}:{value:.6g}" for wave, value in values)


def set_image(changes: Changes, emitter: Emitter, image: Floats, *, stem: str) -> dict[str, Floats]:
    """Set the image of a light to (rows, columns, 3) emissions.

    emitter: one of its texels. stem: prefix of the name of the image. Returns it by file name. A
    sky of one colour becomes an environment map.
    """
    assert emitter.texel is not None
    domain, name = emitter.texel.domain, f"{stem}.{safe_name(emitter.texel.image)}.exr"
    if domain.has_texture:
        changes.replace(domain.parameter, _bitmap(domain.parameter, name))
        if changes.has("scale"):
            changes.set("float", "scale", "1")
    elif emitter.plugin == "constant":
        changes.replace("radiance", tag("string", name="filename", value=name))
        changes.xml.set_attribute(changes.element, "type", "envmap")
    else:
        changes.set("string", "filename", name)
        if changes.has("scale"):
            changes.set("float", "scale", "1")
    return {name: domain.as_stored(image)}


def _bitmap(parameter: str, name: str) -> str:
    """Return the XML of a texture with a file of linear values, which stay as they are beyond its
    outermost pixels.
    """
    settings = (
        tag("string", name="filename", value=name),
        tag("boolean", name="raw", value="true"),
        tag("string", name="wrap_mode", value="clamp"),
    )
    return f'<texture type="bitmap" name="{parameter}">{"".join(settings)}</texture>'


def safe_name(name: str) -> str:
    """Return the name of a light without characters that are unusual in file names."""
    return re.sub(r"[^\w-]+", "_", name)


def _scale_image(
    changes: Changes, scene: Scene, emitter: Emitter, parameter: str, rgb: RGB, stem: str
) -> dict[str, Floats]:
    """Scale the image of `emitter` by `rgb`, and refer to the scaled copy."""
    # The index distinguishes emitters whose names give the same file name.
    name = f"{stem}.{scene.emitters.index(emitter)}.{safe_name(emitter.name)}.exr"
    holder = changes
    if emitter.plugin != "envmap":
        holder = changes.child(parameter, _definition(scene, emitter, parameter))
    holder.set("string", "filename", name)
    if holder is not changes:
        holder.set("boolean", "raw", "true")
        holder.finish()
    return {name: scene.emitted_image(emitter) * np.asarray(rgb, np.float32)}


def _definition(scene: Scene, emitter: Emitter, parameter: str) -> tuple[Path, int]:
    """Return where the texture of an emitter is defined: its file, and the offset of its
    element.
    """
    state = scene.parsed.state
    texture = child_named(state, emitter.node, parameter)
    assert texture is not None
    node = state.nodes[texture]
    return scene.files[node.file_index], int(node.offset) - 1


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
    numbers = {key: float(props[key]) for key in luminaires.NUMBER_KEYS if key in props}
    file, shown = str(props["filename"]), np.array(level) if powers is None else powers
    intensity = _intensity(shown)
    if emitter.plugin == luminaires.AREA_PLUGIN:
        name = "" if hung.is_panel else str(props.id())
        lines = luminaire_lines(
            luminaires.AREA_PLUGIN, name, file, numbers, intensity, None, sampling_weight=weight
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
        luminaires.POINT_PLUGIN, hung.name, file, numbers, intensity, matrix, sampling_weight=weight
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
    spots = _spots(hung) if hung is not None and emitter.plugin == luminaires.POINT_PLUGIN else ()
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
        and (x.plugin == luminaires.AREA_PLUGIN or not _spots(hung, is_spectral=scene.is_spectral))
    ]
    if not names:
        return None
    return (
        f"the relit scene has luminaires that Mitsuba alone does not know, {some_names(names)}: "
        "`import lightpaint.mitsuba` before you load it there"
    )


def _spots(hung: HungLuminaire, *, is_spectral: bool = False) -> tuple[luminaires.SpotPart, ...]:
    """Return the spots that add up to a luminaire; none with spectra if some are negative, which
    spectra of Mitsuba are not.
    """
    spots = luminaires.spots_of(hung.request.web)
    return () if is_spectral and any(x.candela < 0 for x in spots) else spots


def _spot_lines(
    name: str,
    spots: Sequence[luminaires.SpotPart],
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
    hung[:3, :3] = (
        luminaires.world_from_web(matrix[:3, :3], turn=turn, tilt=tilt)
        @ luminaires.EMITTER_FROM_WEB.T
    )
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
