"""Colour rendering by luxpy of the spectra in luxpy_figures.json, which it writes back.

luxpy is no dependency: it needs a numpy before 2.4. In an environment of its own:

    pip install luxpy==1.12.5 numpy==2.3.5 matplotlib
    python tests/colour/luxpy_figures.py
"""

import json
from pathlib import Path

import luxpy
import numpy as np

FILE = Path(__file__).with_suffix(".json")


def figures(powers: list[float]) -> dict[str, float]:
    """Return Ra, R9, Rf and Rg of power at 380 to 780 nm in steps of 5 nm."""
    cri = luxpy.cri
    spectrum = np.vstack([np.arange(380, 785, 5.0), powers])
    found = {
        "ra": cri.spd_to_cri(spectrum, cri_type="ciera"),  # of whole indices, so in eighths
        "r9": cri.spd_to_cri(spectrum, cri_type="ciera-14", out="Rfi")[8],
        "rf": cri.spd_to_iesrf(spectrum),
        "rg": cri.spd_to_iesrg(spectrum),
    }
    return {key: round(float(np.ravel(x)[0]), 4) for key, x in found.items()}


def main() -> None:
    """Compute all figures anew."""
    data = json.loads(FILE.read_text())
    data["versions"] = {"luxpy": luxpy.__version__, "numpy": np.__version__}
    for light in data["lights"].values():
        light |= figures(light["powers"])
    lines = [f'    "{name}": {json.dumps(x)}' for name, x in data["lights"].items()]
    head = f'{{\n  "versions": {json.dumps(data["versions"])},\n  "lights": {{\n'
    FILE.write_text(head + ",\n".join(lines) + "\n  }\n}\n")


if __name__ == "__main__":
    main()
