#!/usr/bin/env bash
# rcssmin 1.3.0.
#
# In CSS, `.a :is(.b)` selects what is inside of .a, and `.a:is(.b)` .a itself. One expects a minifier
# to keep the space in front of a pseudo-class of a descendant in every block. rcssmin keeps it at the
# top, and in `@media`; in `@container` it keeps it in the first rule and drops it in the next ones,
# so that these select something else. Written `.a *:is(.b)` the selector survives.
#
# Output seen:
#   @media: @media (max-width:9em){.k{margin:0}.a :is(.b){margin:0}}
#   @container: @container (max-width:9em){.k{margin:0}.a:is(.b){margin:0}}
#
# Exit status 0 while that is so, 1 once it changes.
set -euo pipefail
unset PYTHONPATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check rcssmin==1.3.0
"$folder/venv/bin/python" - <<'PYTHON'
import sys

import rcssmin

rules = ".k { margin: 0 }\n.a :is(.b) { margin: 0 }"
small = {block: rcssmin.cssmin(f"{block} (max-width: 9em) {{\n{rules}\n}}")
         for block in ("@media", "@container")}
for block, text in small.items():
    print(f"{block}: {text}")
sys.exit([".a :is(.b)" in text for text in small.values()] != [True, False])
PYTHON
