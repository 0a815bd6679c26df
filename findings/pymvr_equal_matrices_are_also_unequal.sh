#!/usr/bin/env bash
# pymvr 1.0.7 (pymvr==1.0.7).
#
# Places in an MVR show are `pymvr.value.Matrix`. One expects `a != b` to be the opposite of
# `a == b`, as in "has this fixture moved?". But both compare for equality: equal matrices are also
# unequal, and different ones are neither equal nor unequal. Ask `not a == b`.
#
# Output seen:
#   equal: == True, != True
#   moved: == False, != False
#
# Exit status 0 while that is so, 1 once it changes.
set -euo pipefail
unset PYTHONPATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pymvr==1.0.7
"$folder/venv/bin/python" - <<'PYTHON'
import sys

from pymvr.value import Matrix

here = Matrix("{1,0,0}{0,1,0}{0,0,1}{0,0,3000}")
again = Matrix("{1,0,0}{0,1,0}{0,0,1}{0,0,3000}")
moved = Matrix("{1,0,0}{0,1,0}{0,0,1}{500,0,3000}")
equal, differ = (here == again, here != again), (here == moved, here != moved)
print(f"equal: == {equal[0]}, != {equal[1]}\nmoved: == {differ[0]}, != {differ[1]}")
sys.exit((equal, differ) != ((True, True), (False, False)))
PYTHON
