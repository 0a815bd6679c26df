"""Round trips through paint programs, where they are installed: the same lighting in all formats.

Each program paints on a template, by a script and with its own means, and saves that in all formats
it has. What docs/benchmarks.md says of formats was measured in the same way on a real scene.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from displays import FREE_DISPLAY
from paint_programs import needs, run

import lightpaint as lp
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import ImageError, TargetError
from lightpaint.target.template import Template, write_template

SCRIPTS = Path(__file__).parent / "programs"
HEIGHT, WIDTH = 144, 192

#: Where the strokes lie: centre (x, y) and a radius outside of which no program paints.
STROKES, REACH = ((60, 48), (140, 92)), 34

#: How far lights may be from those of the program's most exact file, relative to all of them: two
#: to four times what was measured. Floats: profiles hold matrices of 16 bits. Half: 2^-11. 8 bits:
#: 1/255, halved by rounding or cut off. JPEG: chroma is kept at half the size.
PRECISION = {
    "float.exr": 1e-4,
    "float.tif": 1e-4,
    "half.exr": 1e-3,
    "png16.png": 1e-4,
    "tif16.tif": 1e-4,
    "psd16.psd": 1e-4,
    "png8.png": 0.015,
    "8.ora": 0.015,
    "layers.kra": 0.015,
    "cut8.png": 0.05,
    "q95.jpg": 0.06,
    "q85.jpg": 0.09,
}

y, x = np.mgrid[:HEIGHT, :WIDTH]
DISTANCE = np.min([np.hypot(x - u, y - v) for u, v in STROKES], axis=0)


@pytest.fixture(scope="module")
def basis(make_basis: Callable[..., lp.Basis]) -> lp.Basis:
    """Five lamps over a spotted wall."""
    rng = np.random.default_rng(1)
    albedo = 0.3 + 0.5 * rng.random((HEIGHT // 8, WIDTH // 8, 1)) * rng.uniform(0.8, 1, 3)
    albedo = albedo.repeat(8, 0).repeat(8, 1)
    places = ((20, 20), (160, 16), (96, 80), (30, 120), (170, 124))
    falloff = [1 / (1 + ((x - u) ** 2 + (y - v) ** 2) / 2000) for u, v in places]
    images = [f[..., None] * albedo * rng.gamma(400, 0.0025, (HEIGHT, WIDTH, 3)) for f in falloff]
    return make_basis(images=images, emission=[(0.4, 0.35, 0.3)] * 5)


@pytest.fixture(scope="module")
def folder(basis: lp.Basis, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Holds the template: the wall as it is, and a lamp in view that is brighter than white."""
    folder = tmp_path_factory.mktemp("programs")
    image = np.asarray(lp.combine(basis, lp.Lighting.current(basis)).image).copy()
    image[120:136, 12:28] = 3, 2.5, 2
    write_template(
        folder / "template",
        Template(image.astype(np.float32), ViewTransform("srgb")),
        normals=np.zeros((HEIGHT, WIDTH, 3)),
        depth=np.ones((HEIGHT, WIDTH)),
        mattes={},
        lights={},
    )
    return folder


def check(folder: Path, basis: lp.Basis, exact: str, *names: str) -> None:
    """Each file holds the paint and nothing else, and asks for the lights that `exact` asks for."""
    expected = lights(basis, read(folder / exact))
    for name in (exact, *names):
        target = read(folder / name)
        is_lossy = name.endswith("jpg")
        reach = REACH + 6 * is_lossy
        away, near = reach < DISTANCE, DISTANCE < 8
        assert target.importance[away].max() < (0.05 if is_lossy else 1e-6), name
        assert target.importance[near].mean() > 0.95, name
        error = np.linalg.norm(lights(basis, target) - expected) / np.linalg.norm(expected)
        assert error <= PRECISION[name.partition("-")[2]], f"{name}: lights are off by {error:.2g}"


def read(path: Path) -> lp.Target:
    target = lp.read_target(path)
    assert "painted: what differs from " in target.notes[0]
    return target


def lights(basis: lp.Basis, target: lp.Target) -> np.ndarray:
    solution = lp.solve(basis, target, literal=True)
    return np.array(list(solution.lighting.emission.values()), np.float64)


@pytest.mark.nightly
def test_gimp(folder: Path, basis: lp.Basis) -> None:
    gimp = needs("gimp-console-2.10", "GIMP 2.10")
    script = folder / "gimp.scm"
    paint = (SCRIPTS / "gimp.scm").read_text(encoding="utf-8")
    script.write_text(f'(define folder "{folder}/")\n{paint}', encoding="utf-8")
    evaluate = ("--batch-interpreter", "plug-in-script-fu-eval", "-b", f'(load "{script}")')
    run(folder, gimp, "-i", "-f", *evaluate, "-b", "(gimp-quit 1)")
    check(folder, basis, "light-float.exr", "light-float.tif", "light-half.exr", "light-png16.png")
    files = [f"shown-{n}" for n in ("tif16.tif", "psd16.psd", "png8.png", "q95.jpg", "q85.jpg")]
    check(folder, basis, "shown-png16.png", "shown-float.exr", *files)
    for name in ("same.png", "same.exr"):
        with pytest.raises(TargetError, match="nothing in"):
            lp.read_target(folder / name)


@pytest.mark.nightly
def test_krita(folder: Path, basis: lp.Basis) -> None:
    # It wants a display, and on Linux takes no other than X11's.
    krita, display = needs("kritarunner", "Krita"), needs("xvfb-run", "Xvfb")
    run(
        folder,
        *(display, *FREE_DISPLAY, krita, "-s", "lightpaint_krita"),
        PYTHONPATH=str(SCRIPTS),
        LIGHTPAINT_FOLDER=str(folder),
    )
    error = folder / "error"
    assert not error.exists(), error.read_text(encoding="utf-8")
    check(folder, basis, "light-float.exr", "light-float.tif", "light-png16.png")
    files = [f"shown-{n}" for n in ("half.exr", "png8.png", "8.ora", "layers.kra")]
    check(
        folder,
        basis,
        "shown-png16.png",
        *("shown-tif16.tif", *files, "shown-q95.jpg", "shown-q85.jpg"),
    )
    for name in ("light-layers.exr", "shown-layers.exr"):
        with pytest.raises(ImageError, match=r"layers of Krita .* flatten"):
            lp.read_target(folder / name)
        # Alone, the painted layer says by its alpha what counts.
        layer = lp.read_target(folder / name, layer="paint").importance
        assert layer[DISTANCE > REACH].max() == 0
        np.testing.assert_allclose(layer[DISTANCE < 8], 0.8, atol=1e-3)


def test_imagemagick(folder: Path, basis: lp.Basis) -> None:
    convert = needs("convert-im6", "ImageMagick")
    strokes = ("-fill", "rgba(255,200,120,0.8)", "-draw", "circle 60,48 72,48")
    strokes += ("-fill", "rgba(70,110,220,0.8)", "-draw", "circle 140,92 152,92", "-blur", "0x4")
    layer = ("(", "-size", f"{WIDTH}x{HEIGHT}", "xc:none", *strokes, ")")
    run(folder, convert, "template/template.png", *layer, "-composite", "shown-png16.png")
    png = (convert, "shown-png16.png")
    run(folder, *png, "-depth", "8", "shown-cut8.png")
    run(folder, *png, "shown-tif16.tif")
    run(folder, *png, "shown-psd16.psd")
    run(folder, *png, "-colorspace", "RGB", "shown-half.exr")
    names = ["shown-cut8.png", "shown-tif16.tif", "shown-psd16.psd", "shown-half.exr"]
    for quality in (95, 85):
        names.append(f"shown-q{quality}.jpg")
        run(folder, *png, "-quality", str(quality), names[-1])
    check(folder, basis, "shown-png16.png", *names)


@pytest.mark.nightly
def test_oiiotool(folder: Path, basis: lp.Basis) -> None:
    oiiotool = needs("oiiotool", "oiiotool")
    make = (oiiotool, "--create", f"{WIDTH}x{HEIGHT}", "4", "-d", "float")
    make += ("--fill:color=0.8,0.5,0.2,0.8", "32x32+44+32", "--fill:color=0.06,0.15,0.6,0.8")
    make += ("32x32+124+76", "--kernel", "gaussian", "13x13", "--convolve")
    under = ("template/template.exr", "--ch", "R,G,B,A=1.0", "--over", "--ch", "R,G,B")
    run(folder, *make, *under, "-d", "float", "-o", "light-float.exr")
    light = (oiiotool, "light-float.exr")
    run(folder, *light, "-d", "half", "-o", "light-half.exr")
    run(folder, *light, "-o", "light-float.tif")
    options = (*light, "--colorconvert", "linear", "sRGB")
    run(folder, *options, "-d", "uint16", "-o", "light-png16.png")
    run(folder, *options, "-d", "uint8", "--dither", "-o", "light-png8.png")
    names = ["half.exr", "float.tif", "png16.png", "png8.png"]
    for quality in (95, 85):
        names.append(f"q{quality}.jpg")
        run(folder, *options, "--compression", f"jpeg:{quality}", "-o", f"light-{names[-1]}")
    check(folder, basis, "light-float.exr", *(f"light-{name}" for name in names))
