"""The spectra of the lamps of a lighting, as a table."""

import csv
import io

from lightpaint.colour import WAVELENGTHS
from lightpaint.errors import LightpaintError
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.relit.export.exports import plain_cell


def spectra_csv(lighting: Lighting) -> str:
    """Return a table with a row for each wavelength, and a column for each lamp: power per
    nanometre, for the luminance of its emission in the scene's unit.

    Raises LightpaintError for a lighting without spectra.
    """
    spectra = {
        light.name: light.powers for light in lighting.of_lamps().lights if light.powers is not None
    }
    if not spectra:
        raise LightpaintError(
            "the lighting has no spectra: give the emitters of its lamps a spectrum in the lights "
            "file, and solve again"
        )
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["nm", *map(plain_cell, spectra)])
    for k, wave in enumerate(WAVELENGTHS.tolist()):
        table.writerow([wave, *(f"{powers[k]:.6g}" for powers in spectra.values())])
    return text.getvalue()
