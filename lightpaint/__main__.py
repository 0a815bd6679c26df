# PYTHON_ARGCOMPLETE_OK
"""Run the command line as `python -m lightpaint`, where its script is not on the path."""

import sys

if __name__ == "__main__":
    try:
        from lightpaint.cli import main
    except KeyboardInterrupt:
        sys.exit(130)
    sys.exit(main())
