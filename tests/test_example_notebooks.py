"""The notebooks: the outputs that are kept of each are those of a fresh run."""

import copy
import json
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from renderer import REPOSITORY

NOTEBOOKS = sorted((REPOSITORY / "notebooks").glob("*.ipynb"))

#: Bytes of all notebooks.
MAX_BYTES = 3_000_000

WIDGET = "application/vnd.jupyter.widget-view+json"


@pytest.fixture(scope="module")
def script() -> ModuleType:
    """The script that runs notebooks.

    Its libraries take two seconds to import, which workers that run other tests save.
    """
    for library in ("nbformat", "nbclient"):
        pytest.importorskip(library, reason=library)
    spec = spec_from_file_location("notebooks_run", REPOSITORY / "notebooks" / "run.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.nightly
@pytest.mark.long
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_outputs_that_are_kept_are_those_of_a_fresh_run(path: Path, script: ModuleType) -> None:
    """Else run `python notebooks/run.py`, which writes them, and look at what has changed."""
    kept = script.nbformat.read(path, as_version=4)
    script.nbformat.validate(kept)
    assert script.differences(kept, script.run(path)) == []


def test_what_is_kept_is_small_and_needs_no_kernel(script: ModuleType) -> None:
    assert sum(path.stat().st_size for path in NOTEBOOKS) < MAX_BYTES
    for path in NOTEBOOKS:
        notebook = script.nbformat.read(path, as_version=4)
        stripped = copy.deepcopy(notebook)
        script.strip(stripped)
        assert stripped == notebook, path.name
        code = [cell for cell in notebook.cells if cell.cell_type == "code"]
        assert [cell.execution_count for cell in code] == [*range(1, len(code) + 1)]
        assert any("data" in output for cell in code for output in cell.outputs)


def test_a_closed_painter_leaves_a_mixer(script: ModuleType) -> None:
    [path] = [path for path in NOTEBOOKS if path.stem.endswith("_paint")]
    outputs = [x for cell in script.nbformat.read(path, 4).cells for x in cell.get("outputs", [])]
    [view] = [x.data for x in outputs if "srcdoc" in x.get("data", {}).get("text/html", "")]
    assert WIDGET not in view
    assert len(json.dumps(view)) < 400_000


def test_outputs_that_differ_are_found(script: ModuleType) -> None:
    nbformat, differences = script.nbformat, script.differences

    def notebook(*outputs: Any) -> Any:
        cell = nbformat.v4.new_code_cell("x", outputs=list(outputs))
        return nbformat.v4.new_notebook(cells=[cell])

    def printed(text: str) -> Any:
        return nbformat.v4.new_output("stream", name="stdout", text=text)

    def shown(**data: str) -> Any:
        mime = {kind.replace("_", "/"): text for kind, text in data.items()}
        return nbformat.v4.new_output("display_data", data=mime)

    kept = notebook(printed("missed: 0.352\n"))
    assert differences(kept, notebook(printed("missed: 0.351\n"))) == []
    assert differences(kept, notebook(printed("missed: 0.450\n"))) != []
    assert differences(kept, notebook(printed("misses: 0.352\n"))) != []
    assert differences(kept, notebook()) != []
    picture = notebook(shown(text_plain="a picture", image_png="iVBO"))
    assert differences(picture, notebook(shown(text_plain="a picture"))) != []
    script.strip(picture)
    assert differences(picture, picture) == []


def test_numbers_are_the_same_up_to_rounding(script: ModuleType) -> None:
    same_text = script.same_text
    assert same_text("KKT residual: 1e-15", "KKT residual: 8e-16")
    assert same_text("0.002 -1.5", "0.003 -1.5")  # in the last decimal place
    assert not same_text("0.02", "0.05")
    assert not same_text("12 lights", "11 lights")
    assert not same_text("1 2", "1")
