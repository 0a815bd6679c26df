#!/usr/bin/env bash
# luxpy 1.12.5, with numpy 2.3.5 and matplotlib 3.10.7.
#
# `spd_to_cri(spd)` returns, without options, not the colour rendering index Ra of CIE 13.3 but the
# fidelity index Rf of ANSI/IES TM-30: 70.1 for illuminant FL2, where its Ra is 64.2. With
# cri_type='ciera' it returns Ra, and one expects a number as exact as its Rf; it rounds the eight
# indices to whole numbers first, so that Ra comes in eighths (64.125), though its R9 ('ciera-14')
# is not rounded. So whoever compares two mixes that differ by less than half a point sees steps.
#
# Output seen:
#   spd_to_cri(FL2) = 70.1010, spd_to_iesrf(FL2) = 70.1010
#   Ra of FL2 = 64.1250, of 20 spectra between FL2 and FL7 all in eighths: True; R9 in eighths: False
#
# Exit status 0 while that is so, 1 once it changes.
set -euo pipefail
unset PYTHONPATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    luxpy==1.12.5 numpy==2.3.5 matplotlib==3.10.7
"$folder/venv/bin/python" -W ignore - <<'PYTHON'
import sys

import luxpy
import numpy as np


def number(found):
    return float(np.ravel(found)[0])


def in_eighths(values):
    return bool(np.all(8 * np.array(values) % 1 == 0))


fl2, fl7 = (luxpy._CIE_ILLUMINANTS[name] for name in ("F2", "F7"))
fl7 = np.vstack([fl2[0], np.interp(fl2[0], *fl7)])
cri = luxpy.cri
plain, rf = number(cri.spd_to_cri(fl2)), number(cri.spd_to_iesrf(fl2))
print(f"spd_to_cri(FL2) = {plain:.4f}, spd_to_iesrf(FL2) = {rf:.4f}")
ra, r9 = [], []
for share in np.linspace(0, 1, 20):
    spd = np.vstack([fl2[0], (1 - share) * fl2[1] + share * fl7[1]])
    ra.append(number(cri.spd_to_cri(spd, cri_type="ciera")))
    r9.append(float(cri.spd_to_cri(spd, cri_type="ciera-14", out="Rfi")[8, 0]))
print(
    f"Ra of FL2 = {ra[0]:.4f}, of {len(ra)} spectra between FL2 and FL7 all in eighths: "
    f"{in_eighths(ra)}; R9 in eighths: {in_eighths(r9)}"
)
is_so = plain == rf and abs(plain - ra[0]) > 1 and in_eighths(ra) and not in_eighths(r9)
sys.exit(0 if is_so else 1)
PYTHON
