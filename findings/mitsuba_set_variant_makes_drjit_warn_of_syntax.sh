#!/usr/bin/env bash
# Mitsuba 3.9.1 (mitsuba==3.9.1 with its Dr.Jit, numpy==2.4.6), variants scalar_rgb and
# llvm_ad_rgb.
#
# A program that renders in two variants calls `mi.set_variant` back and forth. One expects a lookup:
# both variants are loaded. Mitsuba executes its Python integrators anew each time that a JIT variant
# is set, a tenth of a second of the processor, and applies `@drjit.syntax` to their functions again.
# So after some hundred calls Dr.Jit warns that the program transforms functions in a loop, which it
# does not.
#
# Output seen:
#   functions transformed by one call: 7
#   warnings after 150 calls: The AST-transforming decorator @drjit.syntax was called more than 1000 ti
#
# Exit status 0 while that is so, 1 once it changes.
set -euo pipefail
unset PYTHONPATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mitsuba==3.9.1 numpy==2.4.6
"$folder/venv/bin/python" - <<'PYTHON'
import sys
import warnings

import drjit.ast
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
mi.set_variant("scalar_rgb")
before = drjit.ast._syntax_counter
mi.set_variant("llvm_ad_rgb")
count = drjit.ast._syntax_counter - before
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    for _ in range(150):
        mi.set_variant("scalar_rgb")
        mi.set_variant("llvm_ad_rgb")
texts = {str(x.message)[:73] for x in caught if "syntax" in str(x.message)}
print("functions transformed by one call:", count)
print("warnings after 150 calls:", *texts)
sys.exit(not (count and texts))
PYTHON
