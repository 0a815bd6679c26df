"""Tables of fixtures for any lighting, and the patch of a scene of Mitsuba."""

from abc import abstractmethod

from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.relit.export.fixtures import fixtures_csv, fixtures_json
from lightpaint.relit.formats.export_format import ExportContext, ExportFormat, Writer
from lightpaint.relit.xml_patch import scene_patch


class TableFormat(ExportFormat):
    """A table of fixtures."""

    needs_source = False

    @staticmethod
    @abstractmethod
    def text_of(lighting: Lighting) -> str:
        """Return the table of a lighting."""

    def of_scene(self, export: ExportContext) -> Writer:
        """Return the writer of the table."""
        return lambda: self.text_of(export.lighting)

    of_groups = of_scene


class CsvFormat(TableFormat):
    """A table of fixtures for spreadsheets."""

    name, file, file_of_groups = "csv", "fixtures.csv", "fixtures.csv"
    text_of = staticmethod(fixtures_csv)


class JsonFormat(TableFormat):
    """The same table for programs."""

    name, file, file_of_groups = "json", "fixtures.json", "fixtures.json"
    text_of = staticmethod(fixtures_json)


class MitsubaFormat(ExportFormat):
    """A patch of the scene's XML."""

    name, file = "mitsuba", "relit.patch"
    keeps_lighting = True

    def of_scene(self, export: ExportContext) -> Writer:
        """Return the writer of the patch."""
        scene = export.source.scene
        assert scene is not None
        return lambda: scene_patch(scene, export.lighting)
