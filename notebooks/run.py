"""Run the notebooks and keep their outputs, without what changes from run to run.

    python notebooks/run.py              # all of them
    python notebooks/run.py 02_own_loss  # one

Needs `pip install '.[test]'`. Outputs keep their text and one small picture each; addresses, times,
ids of widgets and paths of this machine are removed, so that a change of an output is a change of
what lightpaint does.
"""

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

FOLDER = Path(__file__).resolve().parent

#: Seconds after which a cell hangs.
CELL_S = 300

#: Types of outputs that are kept, of those with a picture the smallest.
PICTURES = ("image/svg+xml", "image/png", "image/jpeg")
KEPT = (*PICTURES, "text/html", "text/plain")

#: Relative difference of two numbers in outputs of different processors, whose rounding differs,
#: and the size below which numbers are round-off.
ROUNDING, ROUND_OFF = 0.02, 1e-9

_PAINTER_ID = re.compile(r' data-painter="[0-9a-f]+"')
_NUMBER = re.compile(r"-?\d+(?:\.(\d+))?(?:e[+-]?\d+)?")


def run(path: Path) -> nbformat.NotebookNode:
    """Return a notebook as a fresh kernel runs it, stripped. Raises CellExecutionError."""
    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(
        notebook,
        timeout=CELL_S,
        kernel_name="python3",
        record_timing=False,
        store_widget_state=False,
        resources={"metadata": {"path": str(path.parent)}},
    )
    client.execute()
    strip(notebook)
    return notebook


def strip(notebook: nbformat.NotebookNode) -> None:
    """Remove from a notebook what another run would have otherwise."""
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    notebook.metadata = {"kernelspec": kernel, "language_info": {"name": "python"}}
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        if cell.cell_type == "code":
            cell.outputs = list(_stripped(cell.outputs))


def _stripped(outputs: list[Any]) -> Iterator[Any]:
    # Timing alone divides what a cell prints; stderr has progress.
    printed = [x for x in outputs if x.output_type == "stream" and x.name == "stdout"]
    if printed:
        text = _plain("".join(x.text for x in printed))
        yield nbformat.v4.new_output("stream", name="stdout", text=text)
    for output in outputs:
        if output.output_type == "stream":
            continue
        data, pictures = output.data, [x for x in PICTURES if x in output.data]
        smallest = min(pictures, key=lambda kind: len(data[kind]), default=None)
        kept = [x for x in KEPT if x in data and (x not in PICTURES or x == smallest)]
        output.data = {kind: data[kind] for kind in kept}
        output.data["text/plain"] = _plain(data.get("text/plain", ""))
        if "text/html" in kept:
            output.data["text/html"] = _PAINTER_ID.sub("", data["text/html"])
        output.metadata = {}
        yield output


def _plain(text: str) -> str:
    """Return a text without addresses of objects and paths of this machine."""
    text = re.sub(r" at 0x[0-9a-fA-F]+", "", text)
    return text.replace(str(FOLDER.parent), "…")


def differences(kept: nbformat.NotebookNode, fresh: nbformat.NotebookNode) -> list[str]:
    """Return in which cells the outputs of two runs differ, and how, one line each.

    Words have to be the same, numbers up to the rounding of processors; of pictures and pages only
    that they are there.
    """
    found = []
    for k, (one, other) in enumerate(zip(kept.cells, fresh.cells, strict=True)):
        if one.cell_type != "code":
            continue
        texts = [_texts(cell.outputs) for cell in (one, other)]
        kinds = [[sorted(x.get("data", {})) for x in cell.outputs] for cell in (one, other)]
        if kinds[0] != kinds[1]:
            found.append(f"cell {k} shows {kinds[0]}, in a fresh run {kinds[1]}")
        elif not same_text(*texts):
            found.append(f"cell {k} prints {texts[0]!r}, in a fresh run {texts[1]!r}")
    return found


def _texts(outputs: list[Any]) -> str:
    return "\n".join(x.text if x.output_type == "stream" else x.data["text/plain"] for x in outputs)


def same_text(one: str, other: str) -> bool:
    """Return whether two texts have the same words, and the same numbers but for rounding."""
    if _NUMBER.sub("#", one).split() != _NUMBER.sub("#", other).split():
        return False
    pairs = zip(_NUMBER.finditer(one), _NUMBER.finditer(other), strict=True)
    return all(map(_same_number, *zip(*pairs, strict=True))) if _NUMBER.search(one) else True


def _same_number(one: re.Match[str], other: re.Match[str]) -> bool:
    a, b = float(one[0]), float(other[0])
    # Two units of the last decimal place: each is rounded to it.
    unit = 10.0 ** -len(one[1] or "") if one[1] and "e" not in one[0] else 0.0
    return abs(a - b) <= max(ROUNDING * max(abs(a), abs(b)), 2 * unit, ROUND_OFF)


def main() -> int:
    """Run and write the notebooks that are named; return the exit code."""
    paths = [FOLDER / f"{Path(name).stem}.ipynb" for name in sys.argv[1:]]
    for path in paths or sorted(FOLDER.glob("*.ipynb")):
        if not path.is_file():
            print(f"{path.name}: no such notebook in {FOLDER}", file=sys.stderr)
            return 2
        notebook = run(path)
        nbformat.write(notebook, path)
        print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
