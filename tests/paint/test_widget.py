"""The painter of a notebook, over a comm that only notes: what it hears, what it says."""

import asyncio
import gc
import importlib
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import fields, replace
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from weakref import ref

import numpy as np
import pytest
from nightly import nightly
from patience import PATIENCE_S
from picture_files import layered
from renderer import LIGHTS, REPOSITORY, write_room

import lightpaint as lp
from lightpaint.errors import ConstraintError, OutputError, PaintError
from lightpaint.paint import background_threads, protocol
from lightpaint.paint.notebook import widget, widget_arguments
from lightpaint.paint.store import database
from lightpaint.paint.store.history_steps import Identity, Pixels
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.studio import session_bases
from lightpaint.paint.studio.session_studio import Studio
from lightpaint.paint.subject import Subject
from lightpaint.pipeline.job.settings import Settings, SettingsByName
from lightpaint.viewer import BundleError, bundled, source

pytest.importorskip("anywidget", reason="anywidget")
comm = pytest.importorskip("comm", reason="comm")
traitlets = pytest.importorskip("traitlets", reason="traitlets")
ipywidgets = pytest.importorskip("ipywidgets", reason="ipywidgets")

SIZE = (12, 20)
PAGE, OTHER = 7, 9

#: The answer is what was painted, and nothing else.
HOW = {"colors": "free", "hold": 0.0, "space": "linear"}


#: What is painted through, where that says something.
VIEW = lp.ViewTransform("srgb", 0.5)


class RecordingComm(comm.base_comm.BaseComm):  # type: ignore[misc,name-defined]
    """A line to a page that there is none of."""

    def publish_msg(self, msg_type: str, **message: Any) -> None:
        data, buffers = message.get("data") or {}, message.get("buffers") or []
        if data.get("method") == "custom":
            self.messages.append((data["content"], [bytes(x) for x in buffers]))
        elif data.get("method") == "update":
            self.synced |= data["state"]


@pytest.fixture(autouse=True)
def page_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """Widgets have such a line, where no kernel runs; nor any loop, as Playwright leaves one."""
    monkeypatch.setattr("lightpaint.paint.notebook.cell_views._running_loop", lambda: None)
    noted = type("Line", (RecordingComm,), {"messages": [], "synced": {}})
    monkeypatch.setattr(comm, "create_comm", lambda *_, **options: noted(**options))


@pytest.fixture
def basis(make_basis: Any) -> lp.Basis:
    """Three lights whose colours are free."""
    return make_basis(3, SIZE, names=("key", "fill", "back"))


@pytest.fixture
def open_painter(basis: lp.Basis, tmp_path: Path) -> Iterator[Callable[..., Any]]:
    """Painters that are closed at the end."""
    painters = []

    def make(**options: Any) -> Any:
        painters.append(lp.Painter(basis, folder=tmp_path, **{**HOW, **options}))
        painters[-1].comm.messages = []
        return painters[-1]

    yield make
    for painter in painters:
        painter.close()


class Page:
    """What a page does."""

    def __init__(self, painter: Any, page: int = PAGE) -> None:
        self.painter, self.page, self.seq = painter, page, page * 2**32

    def say(self, kind: str, arrays: Any = None, **fields: Any) -> dict[str, Any]:
        """Say something; the answer, with its arrays."""
        self.seq += 1
        arrays = arrays or {}
        arrays_info = [
            {"name": k, "dtype": x.dtype.name, "shape": x.shape} for k, x in arrays.items()
        ]
        about = [{**one, "shape": list(one["shape"])} for one in arrays_info]
        content = {"kind": kind, "seq": self.seq, **fields, "buffers": about}
        data = {"method": "custom", "content": content}
        buffers = [memoryview(x.tobytes()) for x in arrays.values()]
        self.painter.comm.handle_msg({"content": {"data": data}, "buffers": buffers})
        [(answer, buffers)] = [x for x in self.messages() if x[0].get("reply") == self.seq]
        return answer | {"arrays": _arrays(answer, buffers)}

    def messages(self) -> list[Any]:
        """What this page was told."""
        return [x for x in self.painter.comm.messages if x[0].get("page") == self.page]

    def paint(self, image: Any, stroke: int = 0) -> dict[str, Any]:
        """Over everything."""
        arrays = {"image": np.float32(image), "importance": np.ones(SIZE, np.float32)}
        region = [0, SIZE[0], 0, SIZE[1]]
        return self.say("paint", arrays, stroke=stroke, region=region, is_final=True)


def _arrays(content: Any, buffers: Any) -> dict[str, Any]:
    return {
        about["name"]: np.frombuffer(buffer, about["dtype"]).reshape(about["shape"])
        for about, buffer in zip(content["buffers"], buffers, strict=True)
    }


def wait_for(condition: Callable[[], Any]) -> Any:
    """What it gives, once it does."""
    end_s = time.monotonic() + PATIENCE_S
    while not (result := condition()):
        assert time.monotonic() < end_s
        time.sleep(0.01)
    return result


def test_a_page_opens_fetches_and_paints(basis: lp.Basis, open_painter: Any) -> None:
    painter = open_painter()
    page = Page(painter)
    state = page.say("hello", version=protocol.VERSION)
    assert state["kind"] == "state"
    assert [x["name"] for x in state["lights"]] == list(basis.names)
    plane = page.say("fetch", name="plane/1")["arrays"]["data"]
    unit = plane.astype(np.float32) * state["lights"][1]["scale"]
    np.testing.assert_allclose(unit, basis.images[1], rtol=2**-10, atol=1e-6)  # halves
    lightings: list[Any] = []
    painter.observe(lambda change: lightings.append(change.new), "lighting")
    weights = np.array([[1, 0.5, 0.2], [0.1, 0.7, 0.3], [0, 0.2, 0.9]])
    answer = page.paint(basis.mix(weights))
    assert answer["kind"] == "answer"
    np.testing.assert_allclose(answer["arrays"]["weights"], weights, atol=1e-5)

    def exact() -> list[Any]:
        return [content for content, _ in page.messages() if content.get("exact")]

    wait_for(lambda: len(exact()) > 1)  # the second has all that is known of the first
    wait_for(lambda: lightings)
    assert not any("reply" in content for content in exact())
    np.testing.assert_allclose(painter.lighting.weights_for(basis), weights, atol=1e-5)
    [lighting] = lightings
    assert lighting is painter.lighting
    np.testing.assert_array_equal(painter.target.image, np.float32(basis.mix(weights)))
    np.testing.assert_allclose(painter.solution.weights, weights, atol=1e-5)


def test_what_is_set_from_a_cell_shows(basis: lp.Basis, open_painter: Any, tmp_path: Path) -> None:
    painter = open_painter()
    page = Page(painter)
    page.say("hello", version=protocol.VERSION)
    weights = np.array([[1, 0.5, 0.2], [0.1, 0.7, 0.3], [0.4, 0.2, 0.9]])
    image = basis.mix(weights).astype(np.float32)
    trait_names: list[str] = []
    painter.observe(lambda change: trait_names.append(change.name))
    painter.target = lp.Target("cell", image, np.ones(SIZE, np.float32), everything=True)
    assert sorted(set(trait_names)) == ["lighting", "target", "targets"]
    patch, buffers = next(x for x in page.messages() if x[0]["kind"] == "patch")
    np.testing.assert_array_equal(_arrays(patch, buffers)["image"], image)
    assert patch["history"]["undo"] == ["painting from a cell"]
    np.testing.assert_allclose(painter.lighting.weights_for(basis), weights, atol=1e-5)
    painter.constraints = lp.Constraints.of({"k*": {"off": True}})
    assert painter.constraints == lp.Constraints.of({"key": {"off": True}})
    assert painter.lighting.emission["key"] == (0, 0, 0)
    page.say("undo")
    wait_for(lambda: not painter.constraints)
    lighting = lp.Lighting.of_weights(basis, np.full((3, 3), 0.25))
    painter.lighting = lighting
    assert painter.lighting.emission == lighting.emission
    assert painter.solution.lighting.emission == lighting.emission
    state = page.say("hello", version=protocol.VERSION)
    assert state["constraints"]["fill"] == {"lock": [0.25, 0.25, 0.25]}
    painter.save(tmp_path / "evening.json")
    assert lp.read_lighting(tmp_path / "evening.json").emission == lighting.emission
    painter.save(tmp_path / "evening.exr")
    np.testing.assert_array_equal(lp.read_target(tmp_path / "evening.exr").image, image)
    painter.target = None
    assert painter.target is None
    assert painter.solution is None


@pytest.mark.parametrize(
    "options",
    [
        {"everything": True},
        {},
        nightly({"through_view": True, "transform": VIEW}),
        nightly({"through_view": True, "over_look": True, "transform": VIEW}),
    ],
)
def test_a_target_is_answered_as_by_solve(basis: lp.Basis, open_painter: Any, options: Any) -> None:
    """And so is the painter's own target, and so are both of them with something left out."""
    image = np.random.default_rng(3).random((*SIZE, 3)).astype(np.float32)
    counts = np.ones(SIZE, np.float32)
    if "everything" not in options:
        counts[:, :8] = 0
    target = lp.Target("t", image, counts, **{"everything": False, **options})
    painter = open_painter(target=target, colors=None, hold=None, space=None)
    expected = lp.solve(basis, target)
    assert painter.solution.problem.space == expected.problem.space
    np.testing.assert_allclose(painter.solution.weights, expected.weights, rtol=1e-6, atol=1e-9)
    painter.target = painter.target
    np.testing.assert_allclose(painter.solution.weights, expected.weights, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("options", [{}, {"through_view": True, "over_look": True}])
def test_the_first_answer_to_an_untouched_target_is_the_present(
    basis: lp.Basis, open_painter: Any, options: Any
) -> None:
    painter = open_painter(colors=None, hold=None, space=None)
    lightings: list[Any] = []
    painter.observe(lambda change: lightings.append(change.new), "lighting")
    counts = np.ones(SIZE, np.float32)
    painter.target = lp.Target("t", basis.current_look.copy(), counts, False, **options)
    assert painter.solution is not None
    for lighting in (*lightings, painter.lighting):
        weights = lighting.weights_for(basis)
        np.testing.assert_allclose(weights, basis.current_weights, atol=1e-6)


def test_two_threads_may_tell_at_once(
    basis: lp.Basis, open_painter: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As at the start, where the exact answer comes while the first one is told."""
    painter = open_painter()
    set_trait, pauses_s = painter.set_trait, threading.local()

    def slowly(name: str, value: Any) -> None:
        time.sleep(getattr(pauses_s, "each", 0))
        set_trait(name, value)

    def tell(pause_s: float) -> None:
        pauses_s.each = pause_s
        time.sleep(pause_s)  # one begins, and ends, before the other
        weights = np.full((3, 3), pause_s)
        constraints = lp.Constraints.of({"key": {"lock": pause_s}})
        painter._session_traits.update(
            {"lighting": lp.Lighting.of_weights(basis, weights), "constraints": constraints}
        )

    monkeypatch.setattr(painter, "set_trait", slowly)
    with ThreadPoolExecutor(2) as threads:
        for future in [threads.submit(tell, pause_s) for pause_s in (0.02, 0.03)]:
            future.result()
    # What was told is not a wish of a cell, and a cell is heard again.
    assert not painter._studio.session.store.steps
    painter.constraints = lp.Constraints.of({"fill": {"off": True}})
    assert len(painter._studio.session.store.steps) == 1


def test_what_is_told_is_of_one_time(
    basis: lp.Basis, open_painter: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where something is painted by another thread just then."""
    painter, paint = open_painter(), np.full((*SIZE, 3), 0.5, np.float32)
    now, snapshot = painter._studio.snapshot_and_lighting, painter._studio.snapshot

    def painted_on(look: Callable[[], Any]) -> Any:
        values = look()
        monkeypatch.undo()
        pixels = Pixels(paint, np.ones(SIZE, np.float32), None)
        painter._studio.load({0: pixels}, painter._studio.session.requests, "by another")
        return values

    before = painter._studio.session.weights.copy()
    monkeypatch.setattr(painter._studio, "snapshot_and_lighting", lambda: painted_on(now))
    monkeypatch.setattr(painter._studio, "snapshot", lambda: painted_on(snapshot))
    current_values = painter._session_traits.current_values()
    assert current_values["target"] is None
    assert not np.allclose(painter._studio.session.weights, before)
    np.testing.assert_array_equal(current_values["lighting"].weights_for(basis), before)


def test_it_is_called_as_what_is_painted(basis: lp.Basis, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    lp.write_basis("hall.basis.exr", basis)
    lp.write_basis("annex.basis.exr", basis)
    side = replace(basis, origin=replace(basis.origin, sensor="side"))
    for subject, text in (
        (lp.read_basis("hall.basis.exr"), "Painter(hall, 3 lights, 20x12)"),
        (lp.read_basis("annex.basis.exr"), "Painter(annex, 3 lights, 20x12)"),
        ([replace(basis, source="hall/scene.xml"), side], "Painter(hall, 3 lights, 2 views)"),
    ):
        painter = lp.Painter(subject)
        painter.comm.messages = []
        assert repr(painter) == text
        name = text.split("(")[1].split(",")[0]
        state = Page(painter).say("hello", version=protocol.VERSION)
        assert (state["scene"], state["folder"]) == (name, str(tmp_path / f"{name}.paint"))
        painter.close()


def test_it_has_room_beside_other_widgets(open_painter: Any) -> None:
    assert (open_painter().layout.width, open_painter().layout.min_width) == ("100%", "320px")
    half = open_painter(layout={"width": "50%"})
    assert (half.layout.width, half.layout.min_width) == ("50%", "320px")
    own = ipywidgets.Layout(flex="1")
    assert open_painter(layout=own).layout is own


def test_several_views_have_a_target_each(basis: lp.Basis, tmp_path: Path) -> None:
    side = replace(basis, planes=basis.images[::-1], origin=replace(basis.origin, sensor="side"))
    painter = lp.Painter([basis, side], folder=tmp_path, **HOW)
    painter.comm.messages = []
    page = Page(painter)
    state = page.say("hello", version=protocol.VERSION)
    names = [basis.origin.sensor, "side"]
    assert [view["name"] for view in state["views"]] == names
    weights = np.array([[1, 0.5, 0.2], [0.1, 0.7, 0.3], [0.4, 0.2, 0.9]])
    images = [view.mix(weights).astype(np.float32) for view in (basis, side)]
    importance = np.ones(SIZE, np.float32)
    painter.targets = [None, lp.Target("side", images[1], importance, everything=True)]
    assert painter.target is None
    [patch] = [x for x, _ in page.messages() if x["kind"] == "patch" and x["view"] == 1]
    assert patch["views"] == [0, 1]
    # One view is as good as both where it shows all lights.
    np.testing.assert_allclose(painter.lighting.weights_for(basis), weights, atol=1e-5)
    painter.target = lp.Target("front", images[0], importance, everything=True)
    assert [target.name for target in painter.targets] == [f"painting {name}" for name in names]
    expected = lp.solve([basis, side], painter.targets, **HOW)
    np.testing.assert_allclose(painter.solution.weights, expected.weights, rtol=1e-12)
    painter.save(tmp_path / "side.exr", view=1)
    np.testing.assert_array_equal(lp.read_target(tmp_path / "side.exr").image, images[1])
    with pytest.raises(lp.LightpaintError, match=r"painter.targets is a list of 2"):
        painter.targets = [None]
    painter.close()
    for views, message in (([basis, basis], "a view is given twice"), ([], "at least one view")):
        with pytest.raises(lp.LightpaintError, match=message):
            lp.Painter(views)


def test_what_cannot_be_set_is_said_where_it_is_set(basis: lp.Basis, open_painter: Any) -> None:
    painter = open_painter()
    before = painter.lighting
    small = lp.Target("s", np.ones((3, 3, 3), np.float32), np.ones((3, 3), np.float32), True)
    with pytest.raises(lp.LightpaintError, match="3x3"):
        painter.target = small
    with pytest.raises(lp.LightpaintError, match=r"painter.lighting is a lp.Lighting"):
        painter.lighting = {"key": 1}
    with pytest.raises(lp.LightpaintError, match="no light 'lamp'"):
        painter.constraints = lp.Constraints.of({"lamp": {"off": True}})
    with pytest.raises(lp.LightpaintError, match="nothing is painted"):
        painter.save("a.exr")
    with pytest.raises(lp.LightpaintError, match=r"expected \.exr"):
        painter.save("a.png")
    assert painter.lighting == before
    assert painter.target is None
    with pytest.raises(lp.LightpaintError, match="not int"):
        lp.Painter(3)


def test_what_cannot_be_given_is_said_at_once(
    basis: lp.Basis, open_painter: Any, tmp_path: Path
) -> None:
    (tmp_path / "empty.ora").write_bytes(layered(None))
    for options, message in (
        ({"layers": tmp_path / "empty.ora"}, r"empty\.ora is damaged: the archive has no file"),
        ({"transform": "agx"}, r"transform is 'agx': expected a ViewTransform, like lp.ViewTran"),
        ({"constraints": {"key": {"off": True}}}, r"are a dict: give lp.Constraints.of\(\.\.\.\)"),
        ({"layers": 5}, "layers is 5: expected the path of a file"),
        ({"spp": 4}, r"spp=\.\.\. cannot change a saved basis: leave it out, or give the scene"),
    ):
        with pytest.raises(lp.LightpaintError, match=message):
            open_painter(**options)
    with pytest.raises(lp.LightpaintError, match="has no argument 'heigth': did you mean 'heig"):
        open_painter(heigth=300)
    with pytest.raises(TypeError, match=r"lp.Painter has no argument 'sp': did you mean 'spp'"):
        open_painter(sp=300)
    with pytest.raises(lp.LightpaintError, match="folder is 5: expected the path of a folder"):
        lp.Painter(basis, folder=5)
    for height in (-5, 10):
        with pytest.raises(lp.LightpaintError, match="expected a whole number of pixels from 240"):
            open_painter(height=height)
    with pytest.raises(lp.LightpaintError, match=r"give lp.read_basis\('x.basis.exr'\)"):
        lp.Painter("x.basis.exr")
    painter = open_painter(target=lp.Target.of(basis.images[0]))
    for name in ("x.exr", "x.json"):
        for view in (3, -1):
            with pytest.raises(lp.LightpaintError, match=f"view is {view}: expected one of 1"):
                painter.save(tmp_path / name, view=view)


def test_what_is_said_is_said_in_words_of_a_notebook(
    basis: lp.Basis, open_painter: Any, tmp_path: Path
) -> None:
    image = basis.images[0]
    painter = open_painter()
    with pytest.raises(lp.LightpaintError, match=r"not ndarray: give lp.Target.of\(array\)"):
        painter.target = image
    with pytest.raises(lp.LightpaintError, match=r"targets .* not ndarray: give lp.Target.of"):
        painter.targets = [image]
    with pytest.raises(lp.LightpaintError, match=r"a list of 1, a lp.Target or None for each"):
        painter.targets = lp.Target.of(image)
    with pytest.raises(lp.LightpaintError, match=r"painter.target .*: give lp.Target.of\(array\)"):
        open_painter(target=image)
    with pytest.raises(lp.LightpaintError, match=r"painter.target .*: give lp.read_target\(path\)"):
        open_painter(target="evening.exr")
    large = lp.Target.of(np.ones((30, 50, 3)))
    with pytest.raises(lp.LightpaintError, match=r"or give target.resized\(\(height, width\)\)$"):
        painter.target = large
    painter.target = large.resized(SIZE)
    (tmp_path / "junk.db").write_bytes(b"hello" * 1000)
    elsewhere = "give another file as its store"
    with pytest.raises(lp.LightpaintError, match=f"damaged .*: {elsewhere}, or give") as junk:
        open_painter(store=tmp_path / "junk.db")
    assert not any(word in str(junk.value) for word in ("folder", "new="))
    store = Store.open(tmp_path / "used.db", Identity.of([basis]))
    with pytest.raises(lp.LightpaintError, match=f"is in use: .*, or {elsewhere}$"):
        open_painter(store=tmp_path / "used.db")
    store.close()
    with pytest.raises(lp.LightpaintError, match="store is 3: expected the path of a file"):
        open_painter(store=3)


def test_names_are_found_and_slips_of_the_pen_are_said(open_painter: Any) -> None:
    assert "Painter" in dir(lp)
    painter = open_painter()
    with pytest.raises(AttributeError, match="no attribute 'lightning': did you mean 'lighting'"):
        painter.lightning = painter.lighting
    painter.shown_in = "the hall"  # whoever wants may keep something with it
    with pytest.raises(lp.LightpaintError, match="ligthing cannot be observed: did you mean 'lig"):
        painter.observe(print, "ligthing")
    with pytest.raises(lp.LightpaintError, match="hight cannot be observed"):
        painter.observe(print, ["target", "hight"])
    with pytest.raises(lp.LightpaintError, match="'told' cannot observe a painter: expected a fun"):
        painter.observe("told", "lighting")


def test_settings_by_name_are_those_there_are() -> None:
    names = {field.name for field in fields(Settings)} - {"transform"}
    assert set(SettingsByName.__annotations__) == names


@pytest.mark.nightly
@pytest.mark.skipif(find_spec("mypy") is None, reason="mypy")
def test_type_checkers_know_what_can_be_set(tmp_path: Path) -> None:
    right = "painter.target = None\npainter.targets = [None]\nassert painter.lighting\n"
    wrong = "painter.lighting = 3\npainter.target = 'a.exr'\nlp.Painter(basis, heigth=3)\n"
    text = "import lightpaint as lp\nbasis = lp.read_basis('x')\npainter = lp.Painter(basis)\n"
    (tmp_path / "script.py").write_text(text + right + wrong)
    # What mypy has found out of the package before, it need not again.
    ran = subprocess.run(
        [sys.executable, "-m", "mypy", tmp_path / "script.py"],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
    )
    lines = [line.split(":")[1] for line in ran.stdout.splitlines() if ": error:" in line]
    assert lines == ["7", "8", "9"], ran.stdout


class ProgressiveScene:
    """Stands for a scene whose basis is rendered meanwhile: a first one, and then a better one."""

    def __init__(self, basis: lp.Basis, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.basis, self.better = basis, replace(basis, planes=basis.images * np.float32(1.5))
        self.goes_on = threading.Event()
        scene: Any = SimpleNamespace(spp=4, size=basis.size)
        subject = Subject("room.xml", folder, scene=scene, settings=Settings(use_cache=False))
        monkeypatch.setattr(widget_arguments, "widget_subjects", lambda *_, **__: (subject,))
        monkeypatch.setattr(session_bases, "obtain_bases", self._bases)

    def _bases(self, *_: Any) -> Iterator[list[lp.Basis]]:
        self.goes_on.wait(30)
        yield [self.basis]
        yield [self.better]


def test_what_cannot_be_set_is_said_while_it_still_renders(
    basis: lp.Basis, open_painter: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ProgressiveScene(basis, tmp_path, monkeypatch)
    small = lp.Target("s", np.ones((3, 3, 3), np.float32), np.ones((3, 3), np.float32), True)
    for target, message in (
        (small, "3x3"),
        ([small], "3x3"),
        ([None, None], "list of 1"),
        (small.image, "not ndarray"),
        ([small.image], "lp.Target or None, not ndarray"),
    ):
        with pytest.raises(lp.LightpaintError, match=message):
            open_painter(target=target)


def test_messages_about_a_basis_come_while_nobody_holds_the_session(
    basis: lp.Basis, open_painter: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A cell may wait for the session meanwhile, and whoever gets messages for the cell."""
    rendered = ProgressiveScene(basis, tmp_path, monkeypatch)
    studio = open_painter()._studio
    forward, was_free = studio.on_message, []

    def is_free() -> bool:
        has_lock = studio._access.lock.acquire(timeout=PATIENCE_S)
        if has_lock:
            studio._access.lock.release()
        return has_lock

    def receive(message: Any) -> None:
        with ThreadPoolExecutor(1) as another:
            was_free.append(another.submit(is_free).result())
        forward(message)

    studio.on_message = receive
    rendered.goes_on.set()
    wait_for(lambda: studio.store is not None and studio.session.basis is rendered.better)
    assert len(was_free) >= 2
    assert all(was_free)


def test_what_cannot_be_set_later_ends_no_render(
    basis: lp.Basis, open_painter: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    def no(*_: Any) -> Any:
        raise PaintError("no room for it")

    rendered = ProgressiveScene(basis, tmp_path, monkeypatch)
    full_target = lp.Target("s", np.ones((*SIZE, 3), np.float32), np.ones(SIZE, np.float32), True)
    painter = open_painter(target=full_target)
    with monkeypatch.context() as patch:
        patch.setattr(Studio, "load", no)
        rendered.goes_on.set()
        wait_for(
            lambda: (
                painter._studio.store is not None
                and painter._studio.session.basis is rendered.better
            )
        )
    text = "painter.target was not set: no room for it"
    assert "PaintError: no room for it" in capsys.readouterr().err
    assert text in wait_for(
        lambda: [x["text"] for x, _ in painter.comm.messages if x["kind"] == "notice"]
    )
    assert painter.target is None
    painter.target = full_target
    np.testing.assert_array_equal(painter.target.image, full_target.image)


def test_what_is_set_while_it_renders_is_set_once_it_can_be(
    basis: lp.Basis, open_painter: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rendered = ProgressiveScene(basis, tmp_path, monkeypatch)
    full_target = lp.Target("s", np.ones((*SIZE, 3), np.float32), np.ones(SIZE, np.float32), True)
    painter = open_painter(target=full_target)
    assert painter.target is None
    rendered.goes_on.set()
    wait_for(lambda: painter.target is not None)
    np.testing.assert_array_equal(painter.target.image, full_target.image)


def test_a_callback_that_fails_is_shown(basis: lp.Basis, open_painter: Any, capsys: Any) -> None:
    painter = open_painter()
    page = Page(painter)
    page.say("hello", version=protocol.VERSION)
    painter.observe(lambda _: 1 / 0, "target")
    assert page.paint(basis.images[0])["kind"] == "answer"
    notices = wait_for(lambda: [x["text"] for x, _ in page.messages() if x["kind"] == "notice"])
    assert "callback of painter.target failed: ZeroDivisionError" in notices[0]
    assert "ZeroDivisionError" in capsys.readouterr().err
    # And it goes on.
    assert page.paint(basis.images[1], 1)["kind"] == "answer"


def test_a_callback_that_fails_silences_no_other(
    basis: lp.Basis, open_painter: Any, capsys: Any
) -> None:
    def fails(_: Any) -> None:
        raise ValueError("boom")

    painter = open_painter()
    lightings: list[str] = []
    painter.observe(fails, "lighting")
    painter.observe(lambda change: lightings.append(change.name), "lighting")
    painter.target = lp.Target.of(basis.images[0])
    assert "lighting" in lightings
    # Where it failed, and nothing of how it came to be called.
    frames = [x for x in capsys.readouterr().err.splitlines() if x.startswith("  File")]
    assert frames
    assert {frame.rpartition(" in ")[2] for frame in frames} == {"fails"}
    painter.unobserve(fails, "lighting")
    painter.target = None
    assert capsys.readouterr().err == ""
    painter.observe(fails, "lighting")
    painter.unobserve_all()
    painter.target = lp.Target.of(basis.images[0])
    assert capsys.readouterr().err == ""


def test_what_a_callback_sets_is_set_once_all_are_told(basis: lp.Basis, open_painter: Any) -> None:
    painter = open_painter()
    off_constraints = lp.Constraints.of({"key": {"off": True}})
    lightings: list[str] = []
    painter.observe(lambda _: setattr(painter, "constraints", off_constraints), "lighting")
    painter.observe(lambda change: lightings.append(change.name))
    painter.target = lp.Target.of(basis.images[0])
    assert painter.constraints == off_constraints
    assert painter.lighting.emission["key"] == (0, 0, 0)
    assert lightings.index("constraints") > lightings.index("target")
    # What is set again to what it is has changed nothing, and is no step to be undone.
    assert len(painter._studio.session.store.steps) == 2


def test_what_a_callback_cannot_set_is_shown(
    basis: lp.Basis, open_painter: Any, capsys: Any
) -> None:
    painter = open_painter()
    page = Page(painter)
    page.say("hello", version=protocol.VERSION)
    key, fill = (lp.Constraints.of({name: {"lock": True}}) for name in ("key", "lamp"))
    painter.observe(lambda _: setattr(painter, "constraints", 3), "target")
    painter.observe(lambda _: setattr(painter, "constraints", fill), "targets")
    painter.observe(lambda _: setattr(painter, "constraints", key), "lighting")
    painter.target = lp.Target.of(basis.images[0])
    notices = [x["text"] for x, _ in page.messages() if x["kind"] == "notice"]
    assert any("painter.constraints is a lp.Constraints or None, not int" in x for x in notices)
    assert any("no light 'lamp'" in x for x in notices)
    assert "no light 'lamp'" in capsys.readouterr().err
    assert painter.constraints == key


def test_callbacks_that_never_come_to_an_end_are_stopped(
    basis: lp.Basis, open_painter: Any
) -> None:
    painter = open_painter()
    page = Page(painter)
    page.say("hello", version=protocol.VERSION)
    levels = iter(np.linspace(0.1, 0.9, 1000).tolist())

    def set_again(_: Any) -> None:
        painter.constraints = lp.Constraints.of({"key": {"lock": next(levels)}})

    painter.observe(set_again, "lighting")
    painter.target = lp.Target.of(basis.images[0])
    notices = [x["text"] for x, _ in page.messages() if x["kind"] == "notice"]
    assert "callbacks of the painter set something again" in notices[0]


@pytest.mark.filterwarnings("ignore")
def test_junk_is_answered(
    basis: lp.Basis, open_painter: Any, monkeypatch: Any, capsys: Any
) -> None:
    painter = open_painter()
    page = Page(painter)
    page.say("hello", version=protocol.VERSION)
    assert page.say("nothing")["kind"] == "failed"
    assert page.say("fetch", name="../secret")["kind"] == "failed"
    invalid = {"image": np.full((*SIZE, 3), np.nan, np.float32)}
    assert "NaN" in page.say("paint", invalid, stroke=0, region=[0, 12, 0, 20])["text"]
    monkeypatch.setattr(painter._studio, "handle", lambda *_: 1 / 0)
    assert "failed inside lightpaint: ZeroDivisionError" in page.say("undo")["text"]
    assert "Traceback" in capsys.readouterr().err
    monkeypatch.undo()
    other = page.say("hello", version=protocol.VERSION + 1)
    assert (other["kind"], other["reason"]) == ("closed", "version")


def test_constraints_that_cannot_be_met_are_refused_in_their_cell(tmp_path: Path) -> None:
    """Before anything of the scene is rendered."""
    scene = lp.load_scene(write_room(tmp_path, lights=LIGHTS["bulb"]))
    constraints = lp.Constraints.of({"no such light": {"off": True}})
    with pytest.raises(ConstraintError, match="no light 'no such light'"):
        lp.Painter(scene, constraints=constraints, folder=tmp_path)


def test_what_cannot_begin_is_told_to_who_asked(open_painter: Any) -> None:
    """Also where nobody has begun, and by a page of a version that says more."""
    painter = open_painter()
    reply = Page(painter).say("hello", version=protocol.VERSION + 1, with_news=True)
    assert (reply["kind"], reply["reason"]) == ("closed", "version")
    assert Page(painter, OTHER).say("nothing")["kind"] == "failed"


def test_who_is_shown_last_has_it(basis: lp.Basis, open_painter: Any) -> None:
    painter = open_painter()
    first, second = Page(painter), Page(painter, OTHER)
    first.say("hello", version=protocol.VERSION)
    second.say("hello", version=protocol.VERSION)
    assert first.messages()[-1][0]["reason"] == "taken"
    assert first.paint(basis.images[0])["reason"] == "taken"
    assert second.paint(basis.images[0])["kind"] == "answer"
    assert first.say("take_over")["kind"] == "state"
    assert second.messages()[-1][0]["reason"] == "taken"


def test_callbacks_come_in_the_thread_of_the_kernel(
    basis: lp.Basis, open_painter: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    thread_ids: list[Any] = []

    async def cell() -> None:
        loop = asyncio.get_running_loop()
        monkeypatch.setattr("lightpaint.paint.notebook.cell_views._running_loop", lambda: loop)
        painter = open_painter()
        page = Page(painter)
        page.say("hello", version=protocol.VERSION)
        painter.observe(lambda _: thread_ids.append(threading.current_thread()), "lighting")
        page.paint(basis.images[0])
        for _ in range(3000):
            if thread_ids:
                break
            await asyncio.sleep(0.01)

    # Playwright's loop, which may be there, is not a thread's but its own.
    thread = threading.Thread(target=lambda: asyncio.run(cell()))
    thread.start()
    thread.join()
    assert thread_ids[0] is thread


def test_a_session_with_a_file_goes_on(basis: lp.Basis, open_painter: Any, tmp_path: Path) -> None:
    painter = open_painter(store=tmp_path / "evening.db")
    page = Page(painter)
    page.say("hello", version=protocol.VERSION)
    page.paint(basis.images[2])
    painter.close()
    second_painter = open_painter(store=tmp_path / "evening.db")
    np.testing.assert_array_equal(second_painter.target.image, basis.images[2])


def test_a_full_disk_is_said_and_tried_again(
    basis: lp.Basis, open_painter: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    @contextmanager
    def full(_: Any) -> Iterator[None]:
        raise sqlite3.OperationalError("database or disk is full")
        yield

    def notices(tone: str) -> Any:
        return [
            x["text"] for x, _ in page.messages() if x["kind"] == "notice" and x["tone"] == tone
        ]

    monkeypatch.setattr(background_threads, "RETRY_S", 0.01)
    painter = open_painter(store=tmp_path / "evening.db")
    page = Page(painter)
    page.say("hello", version=protocol.VERSION)
    with monkeypatch.context() as patch:
        patch.setattr(database, "transaction", full)
        assert page.paint(basis.images[2])["kind"] == "answer"
        [notice] = wait_for(lambda: notices("warn"))
        assert "evening.db cannot be written (database or disk is full)" in notice
        assert not notices("info")
    assert wait_for(lambda: notices("info")) == ["all that was painted is kept again"]
    assert painter._studio.store.unsaved is None
    assert notices("warn") == [notice]  # once, however often it was tried


def test_a_cell_with_a_file_runs_again(
    basis: lp.Basis, open_painter: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    painter = open_painter(store=tmp_path / "evening.db")
    page = Page(painter)
    page.say("hello", version=protocol.VERSION)
    page.paint(basis.images[2])
    monkeypatch.chdir(tmp_path)
    second_painter = open_painter(store="evening.db")
    assert painter.comm is None
    np.testing.assert_array_equal(second_painter.target.image, basis.images[2])


def test_who_is_closed_cannot_be_set(basis: lp.Basis, open_painter: Any) -> None:
    target = lp.Target.of(basis.images[0])
    painter = open_painter(target=target)
    painter.close()
    with pytest.raises(lp.LightpaintError, match=r"painter.target cannot be set: it is closed"):
        painter.target = None
    # What was painted last is still there to look at, and a second time there is nothing to end.
    np.testing.assert_array_equal(painter.target.image, target.image)
    assert painter.solution is not None
    painter.close()


def test_who_closes_waits_for_no_other_painter(
    open_painter: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whose renders may go on for as long as they like."""
    monkeypatch.setattr(Studio, "has_scenes", property(lambda _: True))
    one, _ = open_painter(), open_painter()
    threads = list(one._studio._threads._threads)
    begun_s = time.monotonic()
    one.close()
    assert time.monotonic() - begun_s < 30
    assert not any(thread.is_alive() for thread in threads)


def test_who_is_closed_is_let_go_of(basis: lp.Basis, monkeypatch: pytest.MonkeyPatch) -> None:
    """A notebook whose cells run again keeps no painter of before, nor its pictures."""
    monkeypatch.setattr(Studio, "has_scenes", property(lambda _: True))

    def closed() -> Any:
        painter = lp.Painter(basis)
        painter.close()
        return ref(painter)

    reference = closed()
    gc.collect()
    assert reference() is None


def test_who_cannot_keep_what_was_done_has_ended_all_the_same(
    open_painter: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_: Store) -> None:
        raise OutputError("the last steps are lost")

    painter = open_painter()
    with monkeypatch.context() as patch:
        patch.setattr(Store, "close", full)
        with pytest.raises(OutputError, match="are lost"):
            painter.close()
    assert painter.comm is None


def test_a_cell_that_is_put_right_finds_its_file(
    basis: lp.Basis, open_painter: Any, tmp_path: Path
) -> None:
    """Whatever was wrong with it, and also where an exception keeps what it was raised in."""
    path = tmp_path / "evening.db"
    open_painter(store=path)._studio.handle(protocol.TieLights((("key", "fill"),)), {})
    constraints = {"key": {"lock": [1, 1, 1]}, "fill": {"lock": [3, 1, 1]}}
    with pytest.raises(lp.LightpaintError, match="share a dimmer") as refusal:
        open_painter(store=path, constraints=lp.Constraints.of(constraints))
    small = lp.Target("s", np.ones((3, 3, 3), np.float32), np.ones((3, 3), np.float32), True)
    with pytest.raises(lp.LightpaintError, match="3x3") as also_kept:
        open_painter(store=path, target=small)
    # It is anybody's, not only the next painter's of this kernel.
    with Store.open(path, Identity.of([basis])) as store:
        assert [step.kind for step in store.steps] == ["requests"]
    del refusal, also_kept


def test_without_the_extra_there_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    importlib.import_module("lightpaint.paint.notebook.widget")
    monkeypatch.delitem(sys.modules, "lightpaint.paint.notebook.widget")
    monkeypatch.delitem(vars(lp), "Painter", raising=False)
    monkeypatch.setitem(sys.modules, "anywidget", None)
    with pytest.raises(lp.LightpaintError) as raised:
        _ = lp.Painter
    assert str(raised.value) == "lp.Painter needs anywidget: pip install 'lightpaint[notebook]'"


def test_the_script_is_one_module() -> None:
    text = widget.widget_script()
    assert text.endswith(".default\n")
    assert text.count("\nexport ") == 1
    assert "\nimport " not in text
    assert "http:" not in text.replace("http://www.w3.org", "")
    assert ".lightpaint" in widget.widget_style()
    # Of what others wrote, who wrote it and under which licence.
    assert "MIT" in text
    assert text == bundled.__wrapped__("paint/page/widget.js")


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"a.js": "export default 3\n"}, "cannot bundle `export default 3`"),
        ({"a.js": "export let x = 3\n"}, "cannot bundle `export let x = 3`"),
        ({"a.js": "import { x } from 'x'\n"}, "a path that begins with a dot"),
        (
            {"a.js": "import { x } from './b.js'\n", "b.js": "import './a.js'\n"},
            "a.js > b.js > a.js",
        ),
        ({"a.js": "const here = import.meta.url\n"}, "import.meta"),
        ({"a.js": "import { x } from './b.js'\n", "b.js": "export const y = 3\n"}, "not export"),
        ({"a.js": "import x from './b.js'\n", "b.js": "\n"}, "imports 'x'"),
    ],
)
def test_what_is_not_understood_is_refused(files: Any, message: str, monkeypatch: Any) -> None:
    monkeypatch.setattr("lightpaint.viewer.source", lambda path: files[path])
    monkeypatch.setattr("lightpaint.viewer._code", lambda path: files[path])
    with pytest.raises(BundleError, match=message):
        bundled.__wrapped__("a.js")


def test_sources_are_read_below_the_page_only() -> None:
    assert source("paint/page/widget.js").startswith("/**")
