"""Loaded by workers of a test cluster: lets tests stop them at an errand, and take their memory.

A file `wait-NAME` in the folder LIGHTPAINT_TEST_SLOW holds whoever does that errand for as long as
it is there; `memory-NAME` takes the memory of the first who comes.
"""

import os
import time
from pathlib import Path
from typing import Any

from lightpaint.basis.render import parts
from lightpaint.batch.work import work

#: Of a lesson, here and in the tests: what is learned does not matter to them.
LESSON = 2**12

_FOLDER = Path(os.environ["LIGHTPAINT_TEST_SLOW"])
_done = work._done


def _slowly(errand: Any, *others: Any) -> Any:
    deadline_s = time.monotonic() + 120
    while (_FOLDER / f"wait-{errand.name}").exists() and time.monotonic() < deadline_s:
        time.sleep(0.02)
    try:
        (_FOLDER / f"memory-{errand.name}").unlink()
    except FileNotFoundError:
        return _done(errand, *others)
    raise MemoryError


work._done = _slowly
parts.LESSON = LESSON
