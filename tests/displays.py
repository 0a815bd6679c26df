"""Displays of programs that want a window."""

import os

#: Numbers of displays that one worker of pytest-xdist may use.
EACH = 20

_WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))

#: Options of xvfb-run. Each worker has numbers of its own, since two that look for a free one at
#: the same time take the same.
FREE_DISPLAY = ("-a", "-n", str(100 + EACH * _WORKER))
