"""The notebooks, run from their first cell to the last, each in a kernel of its own."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from jupyter_client.blocking import BlockingKernelClient
from jupyter_client.manager import start_new_kernel
from renderer import REPOSITORY

NOTEBOOKS = sorted((REPOSITORY / "notebooks").glob("*.ipynb"))

#: Seconds after which a cell hangs.
CELL_S = 300

#: Of bases and verifications: whether a cell runs does not depend on their noise.
FEW_SAMPLES = "spp=4"


@pytest.mark.long
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_every_cell_of_a_notebook_runs(path: Path) -> None:
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    sources = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    assert sources
    manager, client = start_new_kernel(kernel_name="python3", cwd=str(path.parent))
    try:
        for source in sources:
            assert error_of(client, re.sub(r"\bspp=\d+", FEW_SAMPLES, source)) == ""
    finally:
        client.stop_channels()
        manager.shutdown_kernel(now=True)
        manager.cleanup_resources()


def error_of(client: BlockingKernelClient, source: str) -> str:
    """Return how a cell fails, with its traceback; nothing if it does not."""
    reply: dict[str, Any] = client.execute_interactive(
        source, timeout=CELL_S, allow_stdin=False, output_hook=lambda _: None
    )
    content = reply["content"]
    return "" if content["status"] == "ok" else "\n".join(content["traceback"])
