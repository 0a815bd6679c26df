"""Exports an answer to another program, and keeps what is said."""

from pathlib import Path

from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.relit.exported_answer import Source
from lightpaint.relit.formats import write_content, writers_of


class Remarks:
    """A listener that keeps what is said."""

    def __init__(self) -> None:
        self.texts: list[str] = []

    def __call__(self, done: int, total: int, unit: str) -> None:
        pass

    def say(self, text: str) -> None:
        self.texts.append(text)


def export(lighting: Lighting, source: Source, folder: Path, form: str, name: str) -> list[str]:
    """Write the files of a format, and return what was said."""
    remarks = Remarks()
    writers, _ = writers_of({form: name}, lighting, source, folder, remarks)
    for file, make in writers.items():
        write_content(folder / file, make())
    return remarks.texts
