"""Both views show what NumPy mixes and lightpaint encodes, and so the same."""

from typing import Any

import numpy as np
import pytest
from nightly import nightly
from scipy.interpolate import RegularGridInterpolator

from lightpaint.colour.display.view_transform import ViewTransform

N, H, W = 5, 27, 40
GAP = 4
#: Half a code of rounding in each of two places, and the steps of tables and lattices.
CODES = 2


@pytest.fixture
def pictures(site: Any) -> dict[str, np.ndarray]:
    """Planes as halves with their scales, weights, a painting; on the site, too."""
    rng = np.random.default_rng(3)
    shape = np.exp(rng.normal(-3, 1.5, (N, H, W, 3)))
    scales = rng.uniform(0.5, 8, N)
    planes = (shape / scales[:, None, None, None]).astype(np.float16)
    weights = rng.uniform(0, 2, (N, 3))
    arrays = {
        "planes": planes.astype(np.float64) * scales[:, None, None, None],
        "scales": scales,
        "weights": weights,
        "painting": np.exp(rng.normal(-1, 1.5, (H, W, 3))).astype(np.float32),
        "importance": rng.choice(np.float32([0, 1, 4]), (H, W)),
        "beyond": rng.integers(0, 256, (H, W)).astype(np.uint8),
    }
    site.arrays |= {f"plane/{k}": plane for k, plane in enumerate(planes)}
    site.arrays |= {name: arrays[name] for name in ("weights", "painting", "importance", "beyond")}
    return arrays


def draw_panes(
    page: Any,
    kind: str,
    pictures: dict[str, Any],
    params: Any = None,
    lut: Any = None,
    planes: list[int] | None = None,
) -> np.ndarray:
    """Codes of the left and the right picture, pixel by pixel, (2, H, W, 3).

    planes: height and width of the planes, where these are others.
    """
    parameters = {"count": N, "scales": pictures["scales"].tolist(), "lut": lut}
    parameters |= {"width": 2 * W + GAP, "height": H, "planeSize": planes}
    drawn = page.evaluate("([which, asked]) => bench.viewOf(which, asked)", [kind, parameters])
    assert drawn == kind
    rgba = page.evaluate("(params) => bench.shown(params)", params or {})
    codes = np.reshape(rgba, (H, 2 * W + GAP, 4))[..., :3]
    return np.stack([codes[:, :W], codes[:, W + GAP :]])


def mix_planes(pictures: dict[str, np.ndarray]) -> np.ndarray:
    return np.einsum("khwc,kc->hwc", pictures["planes"], pictures["weights"])


def codes(light: np.ndarray, name: str = "srgb", stops: float = 0.0) -> np.ndarray:
    return np.round(ViewTransform(name, stops).encode(light) * 255)


def lattice(name: str, side: int, low: float, high: float) -> np.ndarray:
    """Display values over log2 of light, as the session makes it."""
    light = 2 ** np.linspace(low, high, side)
    light[0] = 0
    axes = np.stack(np.meshgrid(light, light, light, indexing="ij"), axis=-1)
    return ViewTransform(name).encode(axes).astype(np.float16)


def interpolate(lut: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Codes by a lattice, as SciPy has them."""
    axis = np.linspace(-14, 6, len(lut))
    interpolator = RegularGridInterpolator((axis, axis, axis), lut.astype(np.float64))
    return np.round(255 * interpolator(np.clip(np.log2(light), -14, 6)))


@pytest.mark.parametrize("kind", ["cpu", "gl"])
@pytest.mark.parametrize("stops", [0.0, -2.3])
def test_both_pictures_are_shown_in_srgb(page: Any, pictures: Any, kind: str, stops: float):
    left, right = draw_panes(page, kind, pictures, {"stops": stops})
    assert np.abs(left - codes(pictures["painting"], stops=stops)).max() <= 1
    assert np.abs(right - codes(mix_planes(pictures), stops=stops)).max() <= 1


@pytest.mark.parametrize("kind", [nightly("cpu"), "gl"])
@pytest.mark.parametrize("name", ["agx", "filmic"])
def test_view_transforms_are_those_of_the_library(
    page: Any, site: Any, pictures: Any, kind: str, name: str
):
    lut = {"name": name, "side": 48, "low": -14.0, "high": 6.0}
    site.arrays["lut"] = lattice(name, 48, -14, 6)
    for codes_of_view, light in zip(
        draw_panes(page, kind, pictures, {"stops": 0.7}, lut),
        (pictures["painting"], mix_planes(pictures)),
        strict=True,
    ):
        assert (
            np.abs(codes_of_view - interpolate(site.arrays["lut"], light * 2**0.7)).max() <= CODES
        )
        # Between its points a lattice is straight, which the transform is not.
        assert np.abs(codes_of_view - codes(light, name, 0.7)).mean() < 0.5


@pytest.mark.parametrize(
    "overlay", [None, *map(nightly, ["missed", "beyond", "importance"]), "falsecolor"]
)
def test_views_agree(page: Any, pictures: Any, overlay: str | None):
    params = {"overlay": overlay, "stops": 0.4}
    by_cpu, other = (draw_panes(page, kind, pictures, params) for kind in ("cpu", "gl"))
    difference = np.abs(by_cpu - other).max(axis=-1)
    # On the border of two bands of false colour, or of too dark and too bright, they may differ.
    assert (difference <= 1).mean() > 0.99
    if overlay:
        plain = draw_panes(page, "cpu", pictures, {"stops": 0.4})
        changed = [bool((by_cpu[k] != plain[k]).any()) for k in (0, 1)]
        assert changed == [overlay in ("importance", "falsecolor"), overlay != "importance"]


@pytest.mark.parametrize("kind", [nightly("cpu"), "gl"])
def test_a_view_gives_the_light_of_its_mix(page: Any, pictures: Any, kind: str):
    """Row by row from the top, in halves on a GPU; what it shows stays the same."""
    before = draw_panes(page, kind, pictures)
    mix = page.evaluate(
        "() => { const mix = window.view.mixedLight(); return { ...mix, data: [...mix.data] }; }"
    )
    light = np.reshape(mix["data"], (mix["height"], mix["width"], mix["channels"]))[..., :3]
    np.testing.assert_allclose(light, mix_planes(pictures), rtol=N * 2.0**-11)
    after = page.evaluate("() => bench.shown({})")
    codes_after = np.reshape(after, (H, 2 * W + GAP, 4))[:, :W, :3]
    np.testing.assert_array_equal(codes_after, before[0])


@pytest.mark.parametrize("kind", [nightly("cpu"), "gl"])
def test_the_small_picture_lies_over_the_large_one(page: Any, pictures: Any, kind: str):
    """In its corner is an even painting, and around it are the pixels of the answer."""
    pictures["painting"][:] = (0.1, 0.3, 0.5)
    draw_panes(page, kind, pictures)
    rgba = page.evaluate("() => bench.shown({ layout: 'inset', corner: 'top-left', zoom: 1 })")
    shown = np.reshape(rgba, (H, 2 * W + GAP, 4))[..., :3]
    left = (2 * W + GAP - W) // 2
    answer = codes(mix_planes(pictures))
    assert np.abs(shown[12:, left + 20 : left + W] - answer[12:, 20:]).max() <= 1
    assert np.abs(shown[2:8, 2:12] - codes(pictures["painting"])[0, 0]).max() <= 1


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["cpu", "gl"])
def test_wipe_blink_and_zoom(page: Any, pictures: Any, kind: str):
    draw_panes(page, kind, pictures)
    painting, solution = codes(pictures["painting"]), codes(mix_planes(pictures))
    width = 2 * W + GAP

    def full_picture(params: Any) -> np.ndarray:
        rgba = page.evaluate("(params) => bench.shown(params)", params)
        return np.reshape(rgba, (H, width, 4))[..., :3]

    offset = (width - W) // 2  # one picture in the middle
    blinked = full_picture({"layout": "blink", "blink": "left"})[:, offset : offset + W]
    assert np.abs(blinked - painting).max() <= 1
    wiped = full_picture({"layout": "wipe", "wipe": 0.5})[:, offset : offset + W]
    half = width // 2 - offset
    assert np.abs(wiped[:, :half] - painting[:, :half]).max() <= 1
    assert np.abs(wiped[:, half:] - solution[:, half:]).max() <= 1
    # Three times as large around pixel (12, 10): single pixels are squares.
    pan = [12.5 - W / 2, 10.5 - H / 2]
    near = full_picture({"layout": "blink", "blink": "right", "zoom": 3, "pan": pan})
    middle = near[H // 2, width // 2]
    assert np.abs(middle - solution[10, 12]).max() <= 1


@pytest.mark.parametrize("kind", ["cpu", "gl"])
def test_light_at_a_pixel_is_light(page: Any, pictures: Any, kind: str):
    draw_panes(page, kind, pictures, {"stops": 3})
    planes = page.evaluate("() => Array.from(view.planesAt(7, 9))")
    expected = pictures["planes"][:, 9, 7]
    # Halves times a scale, in float32.
    np.testing.assert_allclose(np.reshape(planes, (N, 3)), expected, rtol=1e-6)
    solution = page.evaluate("() => view.lightAt('solution', 7, 9)")
    np.testing.assert_allclose(solution, mix_planes(pictures)[9, 7], rtol=1e-6)
    painting = page.evaluate("() => view.lightAt('painting', 7, 9)")
    np.testing.assert_array_equal(painting, pictures["painting"][9, 7].astype(float))


@pytest.mark.parametrize("kind", [nightly("cpu"), "gl"])
def test_a_region_of_the_painting_changes_alone(page: Any, pictures: Any, kind: str):
    draw_panes(page, kind, pictures)
    rgba = page.evaluate(
        """([H, W]) => {
            const image = new Float32Array(3 * H * W).fill(1), full = new Float32Array(H * W);
            view.setCanvas([0, H, 0, W], image, full);
            bench.shown({});
            image.fill(0.25);
            view.setCanvas([5, 9, 3, 20], image, full);
            return bench.shown({});
        }""",
        [H, W],
    )
    left = np.reshape(rgba, (H, 2 * W + GAP, 4))[:, :W, 0]
    expected = np.full((H, W), 255)
    expected[5:9, 3:20] = codes(np.array(0.25))
    np.testing.assert_array_equal(left, expected)


def test_what_is_added_to_a_mix_is_what_a_new_mix_has(page: Any, pictures: Any):
    draw_panes(page, "cpu", pictures)
    differences = page.evaluate(
        """() => {
            const weights = Array.from(view.mixes.solution.weights);
            bench.shown({ live: true });
            for (let k = 0; k < 20; k++) {
                weights[3] = k / 10;
                view.setWeights(weights);
                bench.shown({ live: true });
            }
            const carried = view.mixes.solution.light.slice();
            bench.shown({});
            const { light } = view.mixes.solution;
            return Array.from(light, (x, i) => Math.abs(carried[i] - x) / (1e-3 + x));
        }"""
    )
    assert max(differences) < 1e-4  # 20 sums in float32


def test_half_size_is_every_second_pixel(page: Any, pictures: Any):
    draw_panes(page, "cpu", pictures)
    light = page.evaluate(
        "() => { view.mixMs = 60; bench.shown({ live: true }); "
        "return [Array.from(view.mixes.solution.light), view.step] }"
    )
    assert light[1] == 2
    half = np.reshape(light[0], ((H + 1) // 2, W // 2, 3))
    np.testing.assert_allclose(half, mix_planes(pictures)[::2, ::2], rtol=1e-5)  # float32
    step = page.evaluate("() => { bench.shown({}); return view.step }")
    assert step == 1


def test_a_draft_of_every_second_pixel_is_mixed_as_it_is(page: Any, pictures: Any):
    """Beside planes of all pixels, of which every second counts then; until a whole one comes."""
    draw_panes(page, "cpu", pictures)
    steps, light = page.evaluate(
        """async ([width, height, scale]) => {
            const { data } = await bench.array("plane/1");
            const draft = [];
            for (let y = 0; y < height; y += 2)
              for (let x = 0; x < width; x += 2)
                draft.push(...data.slice(3 * (y * width + x), 3 * (y * width + x + 1)));
            view.setPlane(1, Uint16Array.from(draft), scale, 2);
            bench.shown({});
            const { step, light } = view.mixes.solution;
            const [shown, steps] = [Array.from(light), [step]];
            view.setPlane(1, data, scale);
            bench.shown({});
            steps.push(view.mixes.solution.step);
            return [steps, shown];
        }""",
        [W, H, pictures["scales"][1]],
    )
    assert steps == [2, 1]
    half = np.reshape(light, ((H + 1) // 2, W // 2, 3))
    np.testing.assert_allclose(half, mix_planes(pictures)[::2, ::2], rtol=1e-5)  # float32


@pytest.mark.parametrize("kind", ["cpu", "gl"])
def test_a_draft_stands_for_the_pixels_around_its_own(page: Any, pictures: Any, kind: str):
    draw_panes(page, kind, pictures)
    light = page.evaluate(
        """([width, height]) => {
            const [rows, columns] = [height, width].map((n) => Math.ceil(n / 2));
            const halves = new Uint16Array(3 * rows * columns);
            halves.fill(0x3c00, 3 * columns, 6 * columns); // the second row of the draft is 1
            view.setPlane(2, halves, 4, 2);
            bench.shown({});
            return [1, 2, 3, 4].map((y) => view.planesAt(width - 1, y)[3 * 2]);
        }""",
        [W, H],
    )
    assert light == [0, 4, 4, 0]


@pytest.mark.parametrize("kind", [nightly("cpu"), "gl"])
def test_bright_halves_spread_nothing(page: Any, site: Any, pictures: Any, kind: str):
    plane = site.arrays["plane/0"].copy()
    plane[0, 0], plane[0, 1] = np.inf, np.nan
    site.arrays["plane/0"] = plane
    site.arrays["weights"] = np.zeros((N, 3))
    _, right = draw_panes(page, kind, pictures)
    np.testing.assert_array_equal(right, 0)  # and no Inf · 0
    site.arrays["weights"] = np.ones((N, 3))
    _, right = draw_panes(page, kind, pictures)
    np.testing.assert_array_equal(right[0, 0], 255)
    other_pictures = mix_planes(pictures | {"weights": np.ones((N, 3))})[1:]
    assert np.abs(right[1:] - codes(other_pictures)).max() <= 1


def test_a_lost_context_comes_back_empty(page: Any, pictures: Any):
    draw_panes(page, "gl", pictures)
    pixels_after = page.evaluate(
        """async () => {
            const away = view.gl.getExtension("WEBGL_lose_context");
            away.loseContext();
            await new Promise((done) => setTimeout(done, 50));
            const lost = view.hasLostContext();
            const back = new Promise((done) =>
                view.canvas.addEventListener("webglcontextrestored", done, { once: true }));
            away.restoreContext();
            await back;
            return [lost, view.hasLostContext(), view.planes.count];
        }"""
    )
    assert pixels_after == [True, False, 0]


def test_without_a_gpu_the_view_is_chosen_that_is_faster_there(page: Any):
    # WebGL2 in software says that it is slow; and where there is none, nothing else is left.
    view_kind = page.evaluate(
        """async () => {
            const { chooseView } = await import("/viewer/drawing/choose_renderer.js");
            const names = [chooseView(document.body, [30, 40], 3).name];
            const real = HTMLCanvasElement.prototype.getContext;
            HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
                return kind === "webgl2" ? null : real.call(this, kind, ...rest);
            };
            names.push(chooseView(document.body, [30, 40], 3).name);
            HTMLCanvasElement.prototype.getContext = real;
            return [...names, document.querySelectorAll("canvas").length];
        }"""
    )
    assert view_kind == ["cpu", "cpu", 2]


@pytest.mark.parametrize("kind", ["cpu", "gl"])
def test_memory_for_each_pixel_and_light_is_bounded(page: Any, pictures: Any, kind: str):
    draw_panes(page, kind, pictures)
    planes = {"cpu": 6, "gl": 8}[kind] * N * H * W
    overhead = page.evaluate("() => view.memory()") - planes
    rows = 8 * 2**18 if kind == "gl" else 0  # on their way to the GPU
    # Mix and two canvases of codes, or their textures; painting and codes; nothing by the light.
    assert 0 < overhead <= 40 * H * W + rows + 8 * (2 * W + GAP) * H


@pytest.mark.parametrize("kind", [nightly("cpu"), "gl"])
def test_planes_of_fewer_pixels_are_stretched_over_the_picture(
    page: Any, pictures: Any, site: Any, kind: str
):
    """Light that changes slowly looks as it does in whole planes, at each place."""
    rows, columns = 9, 10  # a third of H, a quarter of W
    y, x = np.mgrid[:H, :W] / W
    whole = 0.2 + 0.05 * np.stack([x + k * y / N for k in range(N)])[..., None] * [1, 0.9, 0.8]
    blocks = whole.reshape(N, rows, 3, columns, 4, 3).mean(axis=(2, 4)).astype(np.float16)
    scaled = blocks.astype(np.float64) * pictures["scales"][:, None, None, None]
    site.arrays |= {f"plane/{k}": plane for k, plane in enumerate(blocks)}
    light = np.einsum("khwc,kc->hwc", whole, pictures["scales"][:, None] * pictures["weights"])
    stops = float(np.log2(0.5 / light.mean()))

    def drawn(**params: Any) -> np.ndarray:
        return draw_panes(page, kind, pictures, {"stops": stops, **params}, planes=[rows, columns])

    left, right = drawn()
    assert np.abs(left - codes(pictures["painting"], stops=stops)).max() <= 1
    assert np.abs(right - codes(light, stops=stops)).max() <= CODES + 1  # and half a block of slope
    probed = page.evaluate("() => [...window.view.planesAt(39, 26)]")
    np.testing.assert_allclose(np.reshape(probed, (N, 3)), scaled[:, -1, -1], rtol=2.0**-11)
    lit = page.evaluate("() => window.view.lightAt('solution', 4, 3)")
    expected = np.einsum("kc,kc->c", scaled[:, 1, 1], pictures["weights"])
    np.testing.assert_allclose(lit, expected, rtol=N * 2.0**-11)
    for overlay in ("missed", "falsecolor", "beyond"):
        assert (drawn(overlay=overlay)[1] != right).any()
