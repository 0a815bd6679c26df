"""Loaded by workers of a test cluster: lets tests stop them at a work item, and take their memory.

A file `wait-NAME` in the folder LIGHTPAINT_TEST_SLOW holds whoever does that item for as long as
it is there; `memory-NAME` takes the memory of the first who comes.
"""

import os
import time
from pathlib import Path
from typing import Any

from lightpaint.basis.render import basis_render
from lightpaint.batch.work import item_execution

#: Of a lesson, here and in the tests: what is learned does not matter to them.
LESSON = (2**12,)

_FOLDER = Path(os.environ["LIGHTPAINT_TEST_SLOW"])
_run = item_execution._run


def _slowly(item: Any, *others: Any) -> Any:
    deadline_s = time.monotonic() + 120
    while (_FOLDER / f"wait-{item.name}").exists() and time.monotonic() < deadline_s:
        time.sleep(0.02)
    try:
        (_FOLDER / f"memory-{item.name}").unlink()
    except FileNotFoundError:
        return _run(item, *others)
    raise MemoryError


item_execution._run = _slowly
basis_render.TRAINING_SAMPLES = LESSON
