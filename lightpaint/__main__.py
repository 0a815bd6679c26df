# PYTHON_ARGCOMPLETE_OK
"""`python -m lightpaint`: the command line, where its script is not on the path."""

import sys

from lightpaint.cli import main

if __name__ == "__main__":
    sys.exit(main())
