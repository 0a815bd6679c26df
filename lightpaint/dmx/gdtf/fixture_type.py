"""A type of fixture, read from its GDTF file: its modes, each read once."""

from functools import cache
from xml.etree.ElementTree import Element

import numpy as np

from lightpaint.display_text import some_names
from lightpaint.dmx.gdtf.geometry_tree import Placed, geometry_tree
from lightpaint.dmx.gdtf.mode_channels import ModeChannel, mode_channels
from lightpaint.dmx.gdtf.mode_lights import FixtureMode, ModeReader
from lightpaint.errors import RigError
from lightpaint.storage.rig_archive import RigArchive, reading

#: The file in a GDTF.
DESCRIPTION = "description.xml"


class FixtureType:
    """A GDTF file, 1.0 to 1.2.

    data: of the archive. name: of the file, for errors. Raises RigError for one that is damaged.
    """

    def __init__(self, data: bytes, name: str) -> None:
        self.file = name
        with RigArchive(data, name, "GDTF") as archive:
            root = archive.xml(DESCRIPTION)
        element = root.find("FixtureType")
        if element is None:
            raise RigError(f"{name} is not a GDTF: its {DESCRIPTION} has no FixtureType")
        self._element: Element = element
        self.name = element.get("Name") or name.removesuffix(".gdtf")
        self._modes = {x.get("Name", ""): x for x in element.iterfind("DMXModes/DMXMode")}
        # Every fixture of a rig asks for its mode.
        self.mode = cache(self._mode)
        self._parts = cache(self._read_parts)

    def breaks(self, mode: str) -> set[int]:
        """Return the breaks of a mode's channels. Raises RigError for an unknown mode."""
        return {x.dmx.dmx_break for x in self._parts(mode)[1]}

    def _mode(
        self,
        name: str,
        breaks: frozenset[int] | None = None,
        *,
        zoom: float | None = None,
        pixels: bool = False,
    ) -> FixtureMode:
        """Return a mode.

        breaks: those that have an address; None for all. zoom, pixels: as in `read_rig`. Raises
        RigError for an unknown mode, and for values that cannot be read.
        """
        tree, channels = self._parts(name)
        kept = [x for x in channels if breaks is None or x.dmx.dmx_break in breaks]
        with reading(self.file):
            wheels = self._element.findall("Wheels/Wheel")
            reader = ModeReader(name, tree, kept, self._described, wheels, zoom=zoom)
            mode = reader.read(pixels=pixels)
            numbers = [(*x.xy, x.candela) for light in mode.lights for x in light.emitters]
            if not np.isfinite(numbers).all():
                raise ValueError("light that is not finite")
            return mode

    def _read_parts(self, name: str) -> tuple[list[Placed], list[ModeChannel]]:
        """Return the geometries and channels of a mode."""
        element = self._modes.get(name)
        if element is None and name == "" and len(self._modes) == 1:
            [element] = self._modes.values()
        if element is None:
            modes = some_names(self._modes) or "none"
            raise RigError(f"{self.file} has no mode {name!r}: it has {modes}")
        with reading(self.file):
            geometries = self._element.find("Geometries")
            tree = geometry_tree(geometries, element.get("Geometry", ""), self.file)
            return tree, mode_channels(element, tree, self.file)

    def _described(self, path: str) -> list[Element]:
        """Return the elements at a path in the physical descriptions."""
        return self._element.findall(f"PhysicalDescriptions/{path}")
