#!/usr/bin/env bash
# colour-science 0.4.7.
#
# Its functions return other numbers in the scales "reference" (0 to 100) and "1" (0 to 1), and many
# switch to one of them for a moment by the context `domain_range_scale`. One expects the scale of a
# thread to be its own, or at least that of before once all have left. It is one for all threads, and
# each context puts back what it found: of two that overlap, the one that leaves last may leave the
# other's scale. From then on a colour rendering index is silently wrong: of illuminant FL2 99.1
# in the place of 64.2, after two threads had asked for one at the same time. A lock around
# all calls avoids it.
#
# Output seen:
#   before reference, after 1
#   Ra of FL2: 64.2 before, 99.1 after
#
# Exit status 0 while that is so, 1 once it changes.
set -euo pipefail
unset PYTHONPATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check colour-science==0.4.7
"$folder/venv/bin/python" - <<'PYTHON'
import sys
import threading
import warnings

warnings.simplefilter("ignore")
import colour

spectrum = colour.SDS_ILLUMINANTS["FL2"]
before, ra = colour.get_domain_range_scale(), colour.colour_rendering_index(spectrum)
one_is_in, two_is_in, one_is_out = (threading.Event() for _ in range(3))


def one():
    with colour.domain_range_scale("1"):
        one_is_in.set()
        two_is_in.wait()
    one_is_out.set()


def two():
    one_is_in.wait()
    with colour.domain_range_scale("1"):
        two_is_in.set()
        one_is_out.wait()


threads = [threading.Thread(target=work) for work in (one, two)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
after = colour.get_domain_range_scale()
ra_after = colour.colour_rendering_index(spectrum)
print(f"before {before}, after {after}")
print(f"Ra of FL2: {ra:.1f} before, {ra_after:.1f} after")
sys.exit(not (before == "reference" and after == "1" and abs(ra - ra_after) > 1))
PYTHON
