"""The engine as the interface calls it, over a session that is none."""

from typing import Any

import numpy as np
import pytest

from lightpaint.colour.display.view_transform import ViewTransform

N, H, W = 3, 30, 40


@pytest.fixture
def site_of(site: Any) -> dict[str, Any]:
    """A session's pictures on the site, and what `state` says of them."""
    rng = np.random.default_rng(5)
    planes = rng.random((N, H, W, 3)).astype(np.float16)
    objects = np.full((H, W), -1, np.int16)
    objects[:, W // 2 :] = 1
    site.arrays |= {f"plane/{k}": plane for k, plane in enumerate(planes)}
    site.arrays |= {f"clean/{k}": plane / 2 for k, plane in enumerate(planes)}
    site.arrays |= {
        "weights": np.array([[1.0, 1, 1], [0.5, 0.25, 0], [0, 0, 2]]),
        "present": np.full((H, W, 3), 0.25, np.float16),
        "painting": np.full((H, W, 3), 0.25, np.float32),
        "importance": np.zeros((H, W), np.float32),
        "objects": objects,
    }
    resources = {name: 1 for name in site.arrays if name != "weights"}
    lights = [{"name": f"light {k}", "scale": 2.0**k} for k in range(N)]
    return {
        "size": [H, W],
        "lights": lights,
        "objects": ["floor", "wall"],
        "resources": resources,
        "stroke": 4,
        "first": True,
        "lut": {"side": 2, "low": -8, "high": 0},
    }


SHOW = """{ left: "painting", right: "solution", layout: "side", wipe: 0.5, blink: "left",
    zoom: 1, pan: [0, 0], stops: 0, transform: "srgb", clean: false, overlay: null,
    visibleLights: null, solutionWeights: null, otherWeights: null }"""


@pytest.fixture
def run(page: Any, site_of: Any) -> Any:
    """What a script says that has `engine` and `host`, all pictures there."""

    def call(script: str, view: str = "cpu") -> Any:
        return page.evaluate(
            f"""async ([state, view, W, H]) => {{
                const {{ SiteHost, until }} = await import("/session.js");
                const {{ openEngine }} = await import("/engine/picture_engine.js");
                const host = new SiteHost(state);
                const engine = openEngine(host, {{ view }});
                document.body.replaceChildren(engine.element);
                const show = {SHOW};
                const use = {{ tool: "brush", rgb: [1, 0.5, 0.25], paintMode: "colour", size: 8,
                    hardness: 1, flow: 1, importance: 1 }};
                const loads = [];
                engine.on("loading", ({{ done, total }}) => loads.push([done, total]));
                engine.setTool(use);
                engine.resize(2 * W + 4, H);
                engine.show(show);
                await host.begin();
                const isThere = await until(() => engine.paintTarget && loads.at(-1)[1] === 0);
                const at = (x, y) => ({{ x, y, pressure: 1 }});
                const codes = (x, y, side = 0) => {{
                    engine.screen.drawNow();
                    return Array.from(engine.screen.view.read(x + side * (W + 4), y, 1, 1))
                        .slice(0, 3);
                }};
                const rest = async () => {{
                    await until(() => !engine.mirror.strokes.isPending);
                    return host.requests.map(({{ kind, fields }}) => [kind, fields]);
                }};
                {script}
            }}""",
            [site_of, view, W, H],
        )

    return call


def code(*light: float) -> list[int]:
    return np.round(255 * ViewTransform().encode(np.array(light))).astype(int).tolist()


@pytest.mark.parametrize("view", ["cpu", "gl"])
def test_a_stroke_is_seen_and_said(run: Any, view: str):
    before, after, neighbour_code, messages = run(
        """
        const before = codes(10, 10);
        engine.begin(at(10, 10)); engine.move([at(14, 10)]); engine.end();
        return [before, codes(12, 10), codes(12, 20), await rest()];
        """,
        view,
    )
    assert (before, after, neighbour_code) == (
        code(*[0.25] * 3),
        code(1, 0.5, 0.25),
        code(*[0.25] * 3),
    )
    assert {kind for kind, _ in messages} == {"paint"}
    assert {fields["stroke"] for _, fields in messages} == {5}
    assert [fields["is_final"] for _, fields in messages][-1] is True
    assert messages[-1][1]["label"] == "brush"


@pytest.mark.parametrize("view", ["cpu", "gl"])
def test_solo_clean_and_other_weights_are_shown(run: Any, site: Any, view: str):
    planes = [np.float64(site.arrays[f"plane/{k}"][5, 7]) * 2**k for k in range(N)]
    weights = site.arrays["weights"]
    full, solo, replaced, other, clean = run(
        """
        const seen = (more) => { engine.show({ ...show, ...more }); return codes(7, 5, 1); };
        const made = [seen({}), seen({ visibleLights: [false, true, false] }),
            seen({ solutionWeights: [[0, 0, 0], [0, 0, 0], [0.1, 0.1, 0.1]] }),
            seen({ right: "other", otherWeights: [[0.5, 0, 0], [0, 0, 0], [0, 0, 0]] })];
        engine.show({ ...show, clean: true });
        await until(() => host.fetched.filter((x) => x.startsWith("clean/")).length === 3
            && loads.at(-1)[1] === 0);
        return [...made, codes(7, 5, 1)];
        """,
        view,
    )
    expected = [
        code(*sum(p * w for p, w in zip(planes, weights, strict=True))),
        code(*planes[1] * weights[1]),
        code(*planes[2] * 0.1),
        code(*planes[0] * [0.5, 0, 0]),
        code(*sum(p * w / 2 for p, w in zip(planes, weights, strict=True))),
    ]
    np.testing.assert_allclose([full, solo, replaced, other, clean], expected, atol=1)


def test_a_dropped_stroke_leaves_the_picture_as_it_was(run: Any):
    mid_stroke, after, messages = run(
        """
        engine.begin(at(10, 10)); const during = codes(10, 10);
        engine.cancel();
        return [during, codes(10, 10), await rest()];
        """
    )
    assert (mid_stroke, after) == (code(1, 0.5, 0.25), code(*[0.25] * 3))
    assert [kind for kind, _ in messages] == ["paint", "drop_stroke"]


def test_asking_by_drag_says_how_much(run: Any):
    requests, colour, messages = run(
        """
        const asked = [];
        engine.on("adjustment", (event) => asked.push(event));
        engine.setTool({ ...use, tool: "adjust" });
        engine.begin(at(20.5, 15.5)); engine.move([at(20.5, -64.5)]);
        const colour = engine.lightAt("painting", 20.2, 15.9);
        engine.end();
        engine.begin(at(5, 5)); engine.end(); // no drag, no stroke
        return [asked, colour, await rest()];
        """
    )
    assert requests == [{"stops": 1, "mired": 0}]
    np.testing.assert_allclose(colour, 0.5)
    labels = [fields.get("label") for _, fields in messages if fields.get("is_final")]
    assert labels == ["Spot on Wall, +1.0 stop"]


def test_asking_by_numbers_line_fill_and_undo(run: Any):
    wall, floor, undone, line, messages = run(
        """
        engine.adjust({ stops: -1, mired: 0, object: 1 });
        const light = (x, y) => engine.lightAt("painting", x, y)[0];
        const [wall, floor] = [light(30, 3), light(3, 3)];
        await rest();
        const arrays = { image: { data: new Float32Array(3 * H * W).fill(0.125), shape: [H, W, 3] },
            importance: { data: new Float32Array(H * W), shape: [H, W] } };
        const painting = { id: 0, kind: "pixels", name: "Painting", is_visible: true, strength: 1,
            importance: 1, group: null, gain: 1, tint: [1, 1, 1], times: 1,
            regions: [[0, 0, 0, 0]], accents: [1], revision: 1 };
        const layers = { layers: [painting], next: 2 };
        host.emit("patch", { kind: "patch", region: [0, H, 0, W], arrays, layers });
        const back = light(30, 3);
        engine.line(at(2, 25), at(18, 25));
        return [wall, floor, back, [light(2, 25), light(10, 25), light(10, 20)], await rest()];
        """
    )
    assert (wall, floor, undone) == (0.125, 0.25, 0.125)
    assert line == [1, 1, 0.125]
    labels = [fields["label"] for _, fields in messages if fields.get("is_final")]
    assert labels == ["Wall, −1.0 stop", "brush"]


def test_what_is_undone_while_the_painting_is_fetched_stays_undone(run: Any):
    light = run(
        """
        const fetch = host.fetch.bind(host);
        let go; const gate = new Promise((done) => { go = done; });
        host.fetch = async (name) => { const made = await fetch(name); await gate; return made; };
        const synced = engine.mirror.sync();
        await until(() => host.fetched.includes("importance"));
        const arrays = { image: { data: new Float32Array(3 * H * W).fill(0.125), shape: [H, W, 3] },
            importance: { data: new Float32Array(H * W), shape: [H, W] } };
        host.emit("patch", { kind: "patch", region: [0, H, 0, W], arrays });
        go();
        await synced;
        return engine.lightAt("painting", 5, 5)[0];
        """
    )
    assert light == 0.125


@pytest.mark.nightly
@pytest.mark.parametrize("stops", [0.0, -1.3])
def test_paint_is_shown_beside_its_colour_as_the_pictures_show_it(run: Any, stops: float):
    light = [0.02, 0.4, 3.0]
    codes = run(f"return engine.codes({light}, {stops});")
    expected = ViewTransform("srgb", stops).encode(np.array(light)) * 255
    np.testing.assert_allclose(codes, expected, atol=0.75)  # rounded, from a table


@pytest.mark.nightly
@pytest.mark.parametrize("view", ["cpu", "gl"])
def test_what_is_picked_paints_the_same(run: Any, view: str):
    """As light it is what falls there, and not what comes back of it."""
    picked_colour, look, on_black = run(
        """
        const { canvas } = engine.mirror;
        canvas.albedo = new Uint16Array(W * H * 3).fill(0x3400);  // a quarter
        canvas.albedo.fill(0, 0, 3);
        engine.setTool({ ...use, paintMode: "light" });
        engine.begin(at(10, 10)); engine.end();
        const picked = [engine.paintAt("painting", 10, 10), engine.lightAt("painting", 10, 10)];
        const black = engine.paintAt("painting", 0, 0);
        engine.setTool(use);
        return [...picked, [black, engine.paintAt("painting", 0, 0)]];
        """,
        view,
    )
    np.testing.assert_allclose(picked_colour, [1, 0.5, 0.25], rtol=1e-3)
    np.testing.assert_allclose(look, [0.25, 0.125, 0.0625], rtol=1e-3)
    np.testing.assert_allclose(on_black, np.outer([12.5, 0.25], [1, 1, 1]), rtol=1e-3)


def test_what_is_pointed_at(run: Any, site: Any):
    pointed_light, outside, (data, shape) = run(
        "const { data, width, height } = engine.objects();"
        " return [engine.probe(25.7, 8.1), engine.probe(-1, 3), [[...data], [height, width]]];"
    )
    np.testing.assert_array_equal(np.reshape(data, shape), site.arrays["objects"])
    assert pointed_light["index"] == site.arrays["objects"][8, 25]
    levels = [
        np.float64(site.arrays[f"plane/{k}"][8, 25])
        * 2**k
        * site.arrays["weights"][k]
        @ [0.2126, 0.7152, 0.0722]
        for k in range(N)
    ]
    assert (pointed_light["object"], outside) == ("wall", None)
    np.testing.assert_allclose(pointed_light["shares"], np.array(levels) / sum(levels), rtol=1e-5)


def test_places_stay_under_the_pointer_when_zoomed(run: Any):
    before, after = run(
        """
        const under = (x, y) => {
            const pane = engine.panes().find((one) => x >= one.x && x < one.x + one.width);
            return [(x - pane.left) / pane.scale, (y - pane.top) / pane.scale];
        };
        engine.show({ ...show, zoom: 2 });
        const before = under(60, 11);
        engine.show({ ...show, ...engine.zoomAt(60, 11, 3) });
        return [[...before, ...under(16, 11)], [...under(60, 11), ...under(16, 11)]];
        """
    )
    # Both pictures, to half a pixel of the display, which is 1/6 of the picture's.
    np.testing.assert_allclose(after, before, atol=0.5 / 2 + 0.5 / 6)


def test_newer_pictures_are_fetched_and_others_are_not(run: Any):
    fetched = run(
        """
        const before = host.fetched.length;
        host.emit("renewed", { kind: "renewed", resources: { "plane/1": 2 } });
        await until(() => loads.at(-1)[1] === 0 && host.fetched.length > before);
        return host.fetched.slice(before);
        """
    )
    assert fetched == ["plane/1"]


@pytest.mark.nightly
def test_of_another_view_only_its_pictures_are_fetched(run: Any, site_of: Any):
    names = {f"{name}@1": 1 for name in site_of["resources"]}
    view = {"size": [H, W], "scales": [1, 2, 4], "objects": site_of["objects"]}
    site_of |= {"views": [view, view], "resources": site_of["resources"] | names}
    fetched = run(
        """
        const { array } = await import("/bench.js");
        const before = host.fetched.length;
        host.fetch = (name) => { host.fetched.push(name); return array(name.replace("@1", "")); };
        engine.showView(1);
        await until(() => loads.at(-1)[1] === 0 && engine.paintTarget);
        return host.fetched.slice(before);
        """
    )
    planes = [f"plane/{k}@1" for k in range(N)]
    pictures = ["present@1", "objects@1", "painting@1", "importance@1"]
    assert sorted(fetched) == sorted([*planes, *pictures])


def test_old_answers_do_not_come_back(run: Any):
    weights = run(
        """
        const say = (version, value) => host.emit("answer", { kind: "answer", version,
            arrays: { weights: { data: new Float64Array(9).fill(value), shape: [3, 3] } } });
        say(7, 1); say(6, 2);
        return Array.from(engine.mirror.weights);
        """
    )
    assert weights == [1] * 9


def test_an_answer_to_what_was_undone_does_not_come_back(run: Any):
    weights = run(
        """
        const say = (kind, version, value) => host.emit(kind, { kind, version, region: [0, 0, 0, 0],
            arrays: { weights: { data: new Float64Array(9).fill(value), shape: [3, 3] } } });
        say("patch", 7, 1); say("answer", 6, 2); say("patch", 6, 3);
        return Array.from(engine.mirror.weights);
        """
    )
    assert weights == [1] * 9


@pytest.mark.nightly
def test_a_gpu_that_comes_back_is_filled_again(run: Any):
    before, after = run(
        """
        const before = codes(7, 5, 1);
        const away = engine.screen.view.gl.getExtension("WEBGL_lose_context");
        away.loseContext();
        await until(() => engine.screen.view.isLost);
        away.restoreContext();
        await until(() => !engine.screen.view.hasLostContext() && loads.at(-1)[1] === 0);
        return [[before, codes(7, 5)], [codes(7, 5, 1), codes(7, 5)]];
        """,
        "gl",
    )
    assert before[0] == after[0]
    assert after[1] == code(*[0.25] * 3)


@pytest.mark.nightly
def test_a_gpu_that_does_not_come_back_is_done_without(run: Any):
    before, after, name = run(
        """
        const before = [codes(7, 5, 1), codes(7, 5)];
        engine.screen.recoveryMs = 1;
        engine.screen.view.gl.getExtension("WEBGL_lose_context").loseContext();
        await until(() => engine.screen.view.name === "cpu" && loads.at(-1)[1] === 0);
        return [before, [codes(7, 5, 1), codes(7, 5)], engine.screen.view.name];
        """,
        "gl",
    )
    assert name == "cpu"
    np.testing.assert_allclose(after, before, atol=1)


@pytest.mark.nightly
def test_a_view_that_is_closed_is_no_gpu_that_is_lost(run: Any):
    """It gives its context up, and is told so when the next view is there already."""
    names, canvases = run(
        """
        const { screen } = engine;
        screen.recoveryMs = 1;
        const [first, names] = [screen.view, []];
        screen.begin([H, W], 3, first.name);
        const second = screen.view;
        let told = 0;
        for (const { canvas } of [first, second])
            canvas.addEventListener("webglcontextlost", () => told++);
        await until(() => told === 1);
        await new Promise((done) => setTimeout(done, 20));
        names.push(screen.view.name);
        screen.close();
        await until(() => told === 2);
        await new Promise((done) => setTimeout(done, 20));
        names.push(screen.view?.name);
        return [names, engine.element.querySelectorAll("canvas").length];
        """,
        "gl",
    )
    assert (names, canvases) == (["gl", None], 0)


@pytest.mark.nightly
def test_another_view_does_not_wait_for_the_gpu_of_the_one_before(run: Any):
    name = run(
        """
        const { screen } = engine;
        const before = screen.view;
        screen.recoveryMs = 20;
        before.gl.getExtension("WEBGL_lose_context").loseContext();
        await until(() => before.isLost);
        screen.begin([H, W], 3, before.name);
        await new Promise((done) => setTimeout(done, 2 * screen.recoveryMs));
        return screen.view.name;
        """,
        "gl",
    )
    assert name == "gl"
