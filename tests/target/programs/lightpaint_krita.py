"""Paints on the template in LIGHTPAINT_FOLDER with Krita and saves what Krita can.

For kritarunner, which knows `__main__`. Runs in Krita's own Python.
"""

import array
import math
import os
import traceback

from krita import InfoObject, Krita

FOLDER = os.environ["LIGHTPAINT_FOLDER"]
#: Red, green, blue as shown; centre in pixels.
STROKES = (((1, 0.78, 0.47), 60, 48), ((0.27, 0.43, 0.86), 140, 92))


def soft(x, y):
    """Colour and coverage of the strokes at a pixel."""
    near = [(math.hypot(x - u, y - v), colour) for colour, u, v in STROKES]
    distance, colour = min(near)
    return colour, 0.8 * min(1, max(0, (26 - distance) / 12))


def painted(name):
    """The template with a layer of paint on it, flattened."""
    document = Krita.instance().openDocument(f"{FOLDER}/template/{name}")
    document.setBatchmode(True)
    width, height = document.width(), document.height()
    is_light = document.colorDepth() == "F32"
    values = array.array("f" if is_light else "H")
    for y in range(height):
        for x in range(width):
            colour, alpha = soft(x, y)
            if is_light:
                values.extend([*(v**2.2 for v in colour), alpha])
            else:
                values.extend(int(65535 * v) for v in (*colour[::-1], alpha))
    layer = document.createNode("paint", "paintlayer")
    document.rootNode().addChildNode(layer, None)
    layer.setPixelData(values.tobytes(), 0, 0, width, height)
    document.refreshProjection()
    document.waitForDone()
    return document


def save(document, name, **options):
    info = InfoObject()
    for key, value in options.items():
        info.setProperty(key, value)
    assert document.exportImage(f"{FOLDER}/{name}", info), name


def shown():
    document = painted("template.png")
    # A layered file has a merged picture; only an EXR has none.
    save(document, "shown-layers.kra")
    save(document, "shown-layers.exr")
    document.flatten()
    document.waitForDone()
    save(document, "shown-png16.png", alpha=False, compression=6)
    save(document, "shown-tif16.tif")
    save(document, "shown-half.exr")
    save(document, "shown-8.ora")
    save(document, "shown-q95.jpg", quality=95, subsampling=0)
    save(document, "shown-q85.jpg", quality=85, subsampling=0)
    document.setColorSpace("RGBA", "U8", "sRGB-elle-V2-srgbtrc.icc")
    document.waitForDone()
    save(document, "shown-png8.png", alpha=False, compression=6)


def light():
    document = painted("template.exr")
    save(document, "light-layers.exr")
    document.flatten()
    document.waitForDone()
    save(document, "light-float.exr")
    save(document, "light-float.tif")
    # 16 bits of linear light, with a profile that says so.
    save(document, "light-png16.png", alpha=False, compression=6)


def __main__(*_):  # noqa: N807 (what kritarunner calls)
    try:
        Krita.instance().setBatchmode(True)
        light()
        shown()
    except Exception:
        with open(f"{FOLDER}/error", "w") as file:
            traceback.print_exc(file=file)
    os._exit(0)  # it would ask whether to save
