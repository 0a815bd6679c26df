"""Tables of fixtures for any lighting, and the patch of a scene of Mitsuba."""

from lightpaint.relit.export.fixtures import fixtures_csv, fixtures_json
from lightpaint.relit.formats.export_format import ExportContext, ExportFormat, Writer
from lightpaint.relit.xml_patch import scene_patch


class CsvFormat(ExportFormat):
    """A table of fixtures for spreadsheets."""

    name, file, file_of_groups = "csv", "fixtures.csv", "fixtures.csv"
    needs_source = False

    def of_scene(self, export: ExportContext) -> Writer:
        """Return the writer of the table."""
        return lambda: fixtures_csv(export.lighting)

    of_groups = of_scene


class JsonFormat(ExportFormat):
    """The same table for programs."""

    name, file, file_of_groups = "json", "fixtures.json", "fixtures.json"
    needs_source = False

    def of_scene(self, export: ExportContext) -> Writer:
        """Return the writer of the table."""
        return lambda: fixtures_json(export.lighting)

    of_groups = of_scene


class MitsubaFormat(ExportFormat):
    """A patch of the scene's XML."""

    name, file = "mitsuba", "relit.patch"
    keeps_lighting = True

    def of_scene(self, export: ExportContext) -> Writer:
        """Return the writer of the patch."""
        scene = export.source.scene
        assert scene is not None
        return lambda: scene_patch(scene, export.lighting)
