"""Writes the emission of a light into its element of the scene XML."""

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lightpaint.arrays import RGB, Doubles, Floats
from lightpaint.colour import WAVELENGTHS
from lightpaint.errors import SceneError
from lightpaint.relit.xml_edit import Element, XmlFile
from lightpaint.scene.checks.tokens import tag
from lightpaint.scene.lights.emitters import Emitter
from lightpaint.scene.properties.emission import AS_AUTHORED, Scaling, child_named
from lightpaint.scene.scene import Scene

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
        others may share it, the changes are those of a copy in the place of the reference.
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
