"""How soon a stroke is answered on screen, through the real page.

    pip install '.[test]'
    python benchmarks/painter.py [--cases 12x960x540 64x960x540 ...] [--strokes N] [--minutes M]
    python benchmarks/painter.py --start scenes/gallery/scene.xml [--times N]
    python benchmarks/painter.py --layers 20 [--cases 12x960x540] [--strokes N]
    python benchmarks/painter.py --long BASIS --layers 75 --strokes 200
    python benchmarks/painter.py --answers
    python benchmarks/painter.py --many 64 256 1000
    python benchmarks/painter.py --moves scenes/gallery/scene.xml

A basis of soft lights that is made up, the painter's own server, and headless Chromium that
renders in software. A pointer is moved 60 times a second over the picture. For every answer that
comes on screen, the time since the last move or press of the pointer that it answers; Python's part
of a stroke is timed in this process. Up to a frame of the display, 16.7 ms, of each figure is
waiting for it. With --minutes, how the memory of page and server grows while somebody paints.

With --start, how soon `lightpaint paint SCENE` can be used: a first time with nothing kept, then
with what that has kept, from the start of its process, until a first stroke is answered; the
largest resident memories of the painter and of a process of the browser until then; and the median
from pointer to screen in the next stroke. The browser is open already. SCENE may be a saved basis.
With --exact, also the time from the end of that stroke until the exact answer and its analysis are
found, and the painter's memory after them.

With --moves, the same while a light of the scene is dragged at 960x540, from the move of the
pointer until its picture is drawn: its plane along frozen paths, the lights solved around it.

With --layers, the same for the brush on the topmost of N layers, in turns with that on one, and
what layers cost at the start of a session; with --session, its part of a stroke alone.

With --long, Python's part of strokes over more and more layers of a saved basis, ten by ten, and
its memory.

With --many, Python's part of a stroke with so many lights at 320x180, in seconds of the clock and
of the processor.

With --answers, how long a small answer over a connection that is kept takes, beside what it takes
where the system may wait for more before it sends (Nagle).
"""

import argparse
import ctypes
import gc
import json
import os
import resource
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from http.client import HTTPConnection
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
from playwright.sync_api import Page, sync_playwright

import lightpaint as lp
from lightpaint.basis.light_basis import Origin
from lightpaint.basis.lights import BasisLight
from lightpaint.lighting.fit import resolve_fit
from lightpaint.lighting.live.live_solver import LiveSolver
from lightpaint.lighting.live.live_view import LiveView
from lightpaint.paint.launch import low_latency
from lightpaint.paint.server.page_server import Server
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.studio.session_studio import Studio
from lightpaint.paint.subject import Subject
from lightpaint.pipeline.job.settings import Settings

ARGUMENTS = ["--no-sandbox"]

#: Paint, as what it multiplies light by: the lamps' own colours make the first, not the other.
BRIGHTER, GREENER = (1.05, 1.05, 1.05), (0.95, 1.08, 0.95)

#: Watches a page: when the last move or press of the pointer was, of which of them an answer knows,
#: and when that is drawn.
WATCH = """() => {
  const { host, engine } = document.getElementById('lightpaint').painter;
  const { screen, mirror } = engine;
  const times = [], send = host.send.bind(host), draw = screen.drawNow.bind(screen);
  let moved = 0, answered = 0, mixing = 0;
  for (const kind of ['pointerrawupdate', 'pointermove', 'pointerdown'])
    addEventListener(kind, (event) => { moved = Math.max(moved, event.timeStamp); }, true);
  host.send = async (kind, fields, arrays) => {
    const at = kind === 'mix' ? mixing : moved;
    const reply = await send(kind, fields, arrays);
    // Where the session mixes the picture, that comes with the answer or after it.
    const isLater = mirror.hasMixes && !reply.arrays?.draft;
    if (kind === 'paint' && !fields.is_final) [mixing, answered] = [at, isLater ? 0 : at];
    if (kind === 'mix' && fields.is_live) answered = at;
    return reply;
  };
  screen.drawNow = () => {
    draw();
    if (answered) times.push(performance.now() - answered);
    answered = 0;
  };
  window.times = times;
}"""


#: Whether all planes have been made anew without grain, and are there.
CLEAN = """() => {
  const { loader, hasMixes } = document.getElementById('lightpaint').painter.engine.mirror;
  if (hasMixes) return true;
  const clean = Object.entries(loader.resources).filter(([name]) => name.startsWith('clean/'));
  return clean.length && clean.every(([, count]) => count > 0) && !loader.missingSlots().length;
}"""


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--cases", nargs="+", default=["12x960x540", "64x960x540", "12x1920x1080"], metavar="NxWxH"
    )
    parser.add_argument("--strokes", type=int, default=6)
    parser.add_argument("--view", choices=("gl", "cpu"), help="picture view (default: the quicker)")
    parser.add_argument("--minutes", type=float, default=0.0)
    parser.add_argument("--start", metavar="SCENE")
    parser.add_argument("--times", type=int, default=5)
    parser.add_argument("--exact", action="store_true", help="with --start: wait for the answer")
    parser.add_argument("--layers", type=int, metavar="N")
    parser.add_argument("--session", action="store_true", help="with --layers: without pages")
    parser.add_argument("--long", metavar="BASIS", help="with --layers and --strokes")
    parser.add_argument("--answers", action="store_true")
    parser.add_argument("--many", nargs="+", type=int, metavar="N")
    parser.add_argument("--moves", metavar="SCENE")
    options = parser.parse_args()
    if options.answers:
        print_answers()
        return
    if options.moves:
        print_moves(options.moves)
        return
    if options.long:
        import painter_layers

        painter_layers.print_long_session(options.long, options.layers or 75, options.strokes)
        return
    if options.many:
        print_many(options.many)
        return
    if options.start:
        print_starts(options.start, options.times, with_exact=options.exact)
        return
    cases = [tuple(map(int, case.split("x"))) for case in options.cases]
    if options.layers:
        import painter_layers

        basis = made_up(cases[0][0], cases[0][2], cases[0][1])
        painter_layers.print_session(basis, options.layers, options.strokes)
        if not options.session:
            painter_layers.print_opening(cases[0])
            words = made_up_painter(cases[0], {})
            painter_layers.print_page_opening(
                cases[0], lambda path, beside: Opened((*words, path), beside=beside)
            )
            opened = partial(Opened, made_up_painter(cases[0], {}), view=options.view)
            painter_layers.print_pages(opened, options.layers, options.strokes)
        return
    print_session(cases[0])
    print("\nthrough the page, ms from pointer to screen")
    heads = ("", "asked", "view", "median", "95 %", "99 %", "answers")
    print("{:16s} {:16s} {:4s} {:>7s} {:>6s} {:>6s} {:>8s}".format(*heads))
    for n, width, height in cases:
        constraints: dict[str, Any] = {}
        for name in ("defaults", "lock, two limits", "linear"):
            if name == "lock, two limits":
                constraints = {"light 0": {"lock": True}}
                constraints |= {f"light {k}": {"limits": {"min": 0.2, "max": 0.7}} for k in (1, 2)}
            space = "linear" if name == "linear" else ""
            with Opened(
                made_up_painter((n, width, height), constraints, space), view=options.view
            ) as session:
                view, times = session.painted(options.strokes)
            p50, p95, p99 = np.percentile(times, [50, 95, 99])
            case = f"{n} at {width}x{height}"
            print(
                f"{case:16s} {name:16s} {view:4s} {p50:7.0f} {p95:6.0f} {p99:6.0f} {len(times):8d}",
                flush=True,
            )
            constraints = {}
    if options.minutes:
        with Opened(made_up_painter(cases[0], {}), view=options.view) as session:
            session.print_growth(options.minutes)


def made_up(n: int, height: int, width: int) -> lp.Basis:
    """Soft lights of different colours, each with some texture."""
    rng = np.random.default_rng(1)
    y, x = np.mgrid[:height, :width].astype(np.float32)
    images = np.empty((n, height, width, 3), np.float32)
    texture = rng.uniform(0.7, 1, (height, width, 1)).astype(np.float32)
    for k in range(n):
        cy, cx, wide = rng.uniform(0, height), rng.uniform(0, width), rng.uniform(0.1, 0.5) * width
        soft = np.exp(-((y - cy) ** 2 + (x - cx) ** 2) / (2 * wide**2))[..., None]
        images[k] = (soft * rng.uniform(0.3, 1, 3) + 0.02) * texture * 3 / n
    lights = tuple(
        BasisLight(f"light {k}", "point", "intensity", "W/sr", (0.5, 0.5, 0.5)) for k in range(n)
    )
    origin = Origin("made up", "", "camera", 0, "separate", (0, 0), (0, 0))
    emitter_mask = np.zeros((height, width), bool)
    return lp.Basis(lights, images, np.zeros_like(images), emitter_mask, origin)


def print_session(case: tuple[int, ...]) -> None:
    """Python's part of a stroke of 64 x 64 pixels, by what is asked."""
    n, width, height = case
    basis = made_up(n, height, width)
    lock_and_limit = {"light 0": {"lock": True}, "light 1": {"limits": {"min": 0.2, "max": 0.7}}}
    print(f"Python's part of a stroke, {n} lights at {width}x{height}, 64 x 64 pixels, ms")
    print(f"{'':30s} {'colour':>6s} {'importance':>11s}")
    for name, fit, constraints, paint in (
        ("literal", {"literal": True}, {}, BRIGHTER),
        ("linear, held, gentle", {"space": "linear"}, {}, BRIGHTER),
        ("linear, a lock, a limit", {"space": "linear"}, lock_and_limit, BRIGHTER),
        ("linear, beyond lamps' colours", {"space": "linear"}, {}, GREENER),
        ("display, as by default", {}, {}, BRIGHTER),
        ("display, a lock, a limit", {}, lock_and_limit, BRIGHTER),
        ("display, beyond lamps' colours", {}, {}, GREENER),
        ("white", {"colors": "white"}, {}, BRIGHTER),
    ):
        colour, importance = (stroke_ms(basis, fit, constraints, paint, x) for x in (False, True))
        print(f"{name:30s} {colour:6.1f} {importance:11.1f}", flush=True)


def stroke_ms(
    basis: lp.Basis,
    fit: dict[str, Any],
    constraints: Any,
    paint: Sequence[float],
    with_importance: bool,
) -> float:
    """Return the median of what `Live` takes for one more piece of a stroke, which multiplies the
    light by `paint`, (3,).
    """
    height = basis.size[0]
    image, importance = basis.current_look.copy(), np.zeros(basis.size, np.float32)
    importance[: height // 2] = 0.5
    resolved = resolve_fit(Settings(**fit), over_look=True, through_view=True)
    view = LiveView(basis, image, importance)
    live = LiveSolver([view], fit=resolved, constraints=lp.Constraints.of(constraints))
    weights, times = live.answer(basis.current_weights), []
    for k in range(40):
        region = slice(8 + 3 * k, 72 + 3 * k), slice(8 + 5 * k, 72 + 5 * k)
        begin = time.perf_counter()
        image[region] *= paint
        if with_importance:
            importance[region] = 0.5 + 0.01 * k
        view.update(region, with_importance=with_importance)
        weights = live.answer(weights, while_painting=True)
        times.append(1e3 * (time.perf_counter() - begin))
    return float(np.median(times))


def print_many(counts: Sequence[int]) -> None:
    """Print Python's part of a stroke of 32 x 32 pixels for each number of lights."""
    print("Python's part of a stroke at 320x180, the median of twenty answers")
    print(f"{'lights':>6s} {'ms':>8s} {'ms of the processor':>20s}")
    for n in counts:
        basis = made_up(n, 180, 320)
        image, importance = basis.current_look.copy(), np.zeros(basis.size, np.float32)
        view = LiveView(basis, image, importance)
        fit = resolve_fit(Settings(), over_look=True, through_view=True)
        live = LiveSolver([view], fit=fit, constraints=lp.Constraints(), is_sketch=True)
        live.prepare()
        weights, times = live.answer(basis.current_weights), []
        for k in range(24):
            region = slice(40 + 2 * k, 72 + 2 * k), slice(80 + 4 * k, 112 + 4 * k)
            image[region] *= BRIGHTER
            importance[region] = 1
            begin = time.perf_counter(), time.process_time()
            view.update(region)
            weights = live.answer(weights, while_painting=True)
            times.append((time.perf_counter() - begin[0], time.process_time() - begin[1]))
        clock, processor = 1e3 * np.median(times[4:], axis=0)
        print(f"{n:6d} {clock:8.0f} {processor:20.0f}", flush=True)


def serve(case: str, constraints: str, space: str, path: str = "") -> None:
    """A painter of a made-up basis, until it is ended; says where it is.

    path: of a session file, by default a new one.
    """
    n, width, height = map(int, case.split("x"))
    with tempfile.TemporaryDirectory() as folder:
        subject = Subject(
            "made up",
            Path(folder),
            basis=made_up(n, height, width),
            # Those that were kept would be there at once, as rough ones are.
            settings=Settings(space=space or None, use_cache=False),  # type: ignore[arg-type]
            constraints=lp.Constraints.of(json.loads(constraints)),
        )
        file = Path(path) if path else Path(folder) / "made_up.lightpaint"
        studio = Studio([subject], partial(Store.open, file))
        server = Server(studio, port=0)
        studio.start()
        signal.signal(signal.SIGUSR1, lambda *_: trim())
        print(server.url, flush=True)
        with low_latency():
            server.run()


def trim() -> None:
    """Give back to the system what is not in use, where its C library can: what is left is held."""
    gc.collect()
    with suppress(AttributeError, OSError):
        ctypes.CDLL(None).malloc_trim(0)


def made_up_painter(case: tuple[int, ...], constraints: Any, space: str = "") -> Sequence[str]:
    """Words that serve a painter of a made-up basis."""
    return "--serve", "x".join(map(str, case)), json.dumps(constraints), space


class Opened:
    """A painter that is served by a process of its own, and a page of it."""

    def __init__(
        self, words: Sequence[str], *, view: str | None = None, beside: "Opened | None" = None
    ) -> None:
        self.beside = beside
        self.server = subprocess.Popen(
            [sys.executable, __file__, *words], stdout=subprocess.PIPE, text=True
        )
        assert self.server.stdout is not None
        self.url, self.view = self.server.stdout.readline().strip(), view

    def __enter__(self) -> "Opened":
        self.playwright = (
            sync_playwright().start() if self.beside is None else self.beside.playwright
        )
        path = shutil.which("chromium")
        self.browser = self.playwright.chromium.launch(executable_path=path, args=ARGUMENTS)
        self.page: Page = self.browser.new_page(viewport={"width": 1600, "height": 900})
        self.page.goto(self.url.replace("#", f"?view={self.view}#" if self.view else "#"))
        self.page.wait_for_function(
            "() => document.getElementById('lightpaint').painter?.engine.mirror.isReady",
            timeout=120_000,
        )
        wait_until_idle(self.server.pid)  # clean planes of 64 lights take a minute
        self.page.wait_for_function(CLEAN, timeout=300_000)
        self.page.evaluate(WATCH)
        return self

    def __exit__(self, *_: object) -> None:
        self.browser.close()
        if self.beside is None:
            self.playwright.stop()
        self.server.terminate()
        self.server.wait()

    def stroke(self, number: int, moves: int = 60) -> None:
        """Over the painting and back, at 60 moves a second."""
        pane = self.page.evaluate(
            "() => { const { engine } = document.getElementById('lightpaint').painter;"
            " const box = engine.element.getBoundingClientRect(), [pane] = engine.panes();"
            " return [box.x + pane.x, box.y + pane.y, pane.width, pane.height]; }"
        )
        left, top, width, height = pane
        y = top + height * (0.2 + 0.06 * (number % 10))
        mouse = self.page.mouse
        mouse.move(left + 0.2 * width, y)
        mouse.down()
        begin = time.perf_counter()
        for k in range(moves):
            mouse.move(left + width * (0.2 + 0.6 * k / moves), y + 20 * np.sin(k / 8))
            time.sleep(max(0, begin + k / 60 - time.perf_counter()))
        mouse.up()
        time.sleep(0.6)

    def painted(self, strokes: int) -> tuple[str, list[float]]:
        """Which view it was, and the times of all answers."""
        for number in range(strokes):
            self.stroke(number)
        kind = self.page.evaluate(
            "() => { const { engine } = document.getElementById('lightpaint').painter;"
            " return engine.screen.view.constructor.name; }"
        )
        return str(kind)[:2].lower(), self.page.evaluate("() => window.times")

    def print_growth(self, minutes: float) -> None:
        """Memory of page and server while somebody paints."""
        print(f"\nmemory over {minutes:g} minutes of strokes, MB")
        session = self.page.context.new_cdp_session(self.page)
        until, number, samples = time.monotonic() + 60 * minutes, 0, []
        while time.monotonic() < until:
            self.stroke(number, moves=30)
            number += 1
            if number % 10 == 0:
                time.sleep(3)  # until the exact answer has been found, and its memory is free
                self.server.send_signal(signal.SIGUSR1)
                time.sleep(1)
                session.send("HeapProfiler.collectGarbage")
                heap = session.send("Runtime.getHeapUsage")["usedSize"] / 1e6
                pages = Path(f"/proc/{self.server.pid}/statm").read_text().split()[1]
                rss = int(pages) * resource.getpagesize() / 1e6
                samples.append((number, heap, rss))
                print(f"{number:5d} strokes: page {heap:7.1f}, server {rss:7.1f}", flush=True)
        each = np.array(samples[len(samples) // 3 :])
        for name, column in (("page", 1), ("server", 2)):
            slope = np.polyfit(each[:, 0], each[:, column], 1)[0] if len(each) > 1 else 0.0
            print(f"{name}: {1e3 * slope:+.0f} kB a stroke")


#: What of a page is there, in the order in which it comes: itself, the first picture to paint on
#: with the list of lights, all their planes.
PAINTER = "document.getElementById('lightpaint')?.painter"
STAGES = {
    "page": f"() => {PAINTER}",
    "picture": f"() => {PAINTER}?.engine.mirror.isReady"
    " && document.querySelector('.lightpaint .tag') && document.querySelector('.is-lights input')",
    "planes": f"() => {{ const {{ loader, state }} = {PAINTER}.engine.mirror;"
    " const areThere = state.basis.spp > 0 || state.basis.is_complete;"
    " return areThere && !loader.missingSlots().length && !loader.activeFetches.size; }",
}


def print_answers(count: int = 50) -> None:
    """Medians over one connection that is kept, and their ratio."""
    with tempfile.TemporaryDirectory() as folder:
        subject = Subject("made up", Path(folder), basis=made_up(2, 16, 16))
        studio = Studio([subject], partial(Store.open, Path(folder) / "made_up.lightpaint"))
        server = Server(studio, port=0)
        serving = Thread(target=server.run, daemon=True)
        serving.start()
        studio.start()
        asking = HTTPConnection("127.0.0.1", server.port)
        token = server.url.partition("token=")[2]
        key = answer_of(asking, "/key", token).decode()
        medians = []
        for at_once in (1, 0):
            assert server._uvicorn is not None
            for connection in server._uvicorn.server_state.connections:
                accepted = connection.transport.get_extra_info("socket")
                accepted.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, at_once)
            times = []
            for _ in range(count):
                begin = time.perf_counter()
                answer_of(asking, "/data/present", key)
                times.append(1e3 * (time.perf_counter() - begin))
            medians.append(float(np.median(times)))
        print(f"an answer over a connection that is kept, at once     {medians[0]:8.2f} ms")
        print(f"                         where the system may wait     {medians[1]:8.2f} ms")
        print(
            f"                                             ratio     {medians[1] / medians[0]:8.1f}"
        )
        asking.close()
        server.stop()
        serving.join()
        server.close()
        studio.close()


#: Watches a page whose lights are dragged: the time from the move of the pointer that an answer
#: knows of until its picture of the light is drawn.
WATCH_DRAGS = """() => {
  const { host, engine } = document.getElementById('lightpaint').painter;
  const { screen, mirror } = engine;
  const times = [], send = host.send.bind(host), draw = screen.drawNow.bind(screen);
  const take = mirror.takePicture.bind(mirror);
  let moved = 0, answered = 0, shown = 0;
  for (const kind of ['pointermove', 'pointerdown'])
    addEventListener(kind, (event) => { moved = event.timeStamp; }, true);
  host.send = async (kind, fields, arrays) => {
    const at = moved;
    const reply = await send(kind, fields, arrays);
    if ((kind === 'move' || kind === 'point') && !fields.is_final) answered = at;
    return reply;
  };
  mirror.takePicture = (slot, name, picture) => {
    take(slot, name, picture);
    if (slot.startsWith('plane ') && answered) [shown, answered] = [answered, 0];
  };
  screen.drawNow = () => {
    draw();
    if (shown) times.push(performance.now() - shown);
    shown = 0;
  };
  window.times = times;
}"""


def serve_scene(path: str, space: str) -> None:
    """Serve a painter of a scene at 960x540, until it is ended, and print its address."""
    from lightpaint.scene.scene_reader import load_scene

    scene = load_scene(path, parameters={"width": 960, "height": 540})
    with tempfile.TemporaryDirectory() as folder:
        settings = Settings(spp=2, space=space or None)  # type: ignore[arg-type]
        subject = Subject("moves", Path(folder), scene=scene, settings=settings)
        studio = Studio([subject], partial(Store.open, None))
        server = Server(studio, port=0)
        studio.start()
        print(server.url, flush=True)
        with low_latency():
            server.run()


def print_moves(path: str, drags: int = 4, moves: int = 90) -> None:
    """Print how soon a dragged light's picture is seen, and the processor's time of an answer."""
    print(f"{path} at 960x540, a spot is dragged in the page")
    heads = ("", "median", "99 %", "ms; answers", "a second", "processor of Python, ms an answer")
    print("{:8s} {:>7s} {:>6s} {:>11s} {:>9s} {:>11s}".format(*heads))
    for space in ("display", "linear"):
        with Opened(("--serve-scene", path, space)) as opened:
            page, pid = opened.page, opened.server.pid
            opened.stroke(0)
            page.keyboard.press("d")
            page.wait_for_selector(".lamp", timeout=300_000)
            wait_until_idle(pid)
            page.evaluate(WATCH_DRAGS)
            box = page.locator('[data-lamp^="spot_"]').first.bounding_box()
            assert box is not None
            x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
            page.mouse.move(x, y)
            seconds, cpu = 0.0, 0.0
            for _ in range(drags):
                page.mouse.down()
                begin, cpu_begin = time.perf_counter(), cpu_seconds(pid)
                for k in range(1, moves + 1):
                    page.mouse.move(x + 60 * np.sin(k / 14), y + 8 * np.sin(k / 9))
                    time.sleep(max(0, begin + k / 60 - time.perf_counter()))
                seconds += time.perf_counter() - begin
                cpu += cpu_seconds(pid) - cpu_begin
                page.mouse.move(x, y)
                page.mouse.up()
                wait_until_idle(pid)
            times = page.evaluate("() => window.times")
        p50, p99 = np.percentile(times, [50, 99])
        rate, each = len(times) / seconds, 1e3 * cpu / len(times)
        print(f"{space:8s} {p50:7.0f} {p99:6.0f} {len(times):11d} {rate:9.1f} {each:11.0f}")


def cpu_seconds(pid: int) -> float:
    """Seconds of processor that a process has taken."""
    ticks = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13]
    return sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")


def largest_gb(pid: int) -> float:
    """Largest resident memory of a process so far, in GB."""
    status = Path(f"/proc/{pid}/status").read_text()
    return int(status.partition("VmHWM:")[2].split()[0]) * 1024 / 1e9


def largest_page_gb() -> float:
    """Largest resident memory so far of a page of this program's browsers, in GB."""
    parents = {
        int(path.parent.name): int(path.read_text().rpartition(")")[2].split()[1])
        for path in Path("/proc").glob("[0-9]*/stat")
    }
    pages, found = set[int](), {os.getpid()}
    while found:
        found = {pid for pid, parent in parents.items() if parent in found}
        pages |= {x for x in found if b"type=renderer" in Path(f"/proc/{x}/cmdline").read_bytes()}
    return max(map(largest_gb, pages))


def median_ms(page: Page, place: Sequence[float], moves: int = 90) -> float:
    """Milliseconds from pointer to screen in a stroke around a place, the median."""
    page.evaluate(WATCH)
    page.mouse.move(*place)
    page.mouse.down()
    begin = time.perf_counter()
    for k in range(1, moves + 1):
        page.mouse.move(place[0] + 60 * np.sin(k / 14), place[1] + 30 * np.sin(k / 9))
        time.sleep(max(0, begin + k / 60 - time.perf_counter()))
    page.mouse.up()
    return float(np.median(page.evaluate("() => window.times")))


def is_saved(scene: str) -> bool:
    """Whether what is painted is a saved basis, of which no planes are kept."""
    return scene.endswith(".exr")


def wait_until_idle(pid: int) -> None:
    """Wait until a process takes less than a twentieth of a processor."""
    before = cpu_seconds(pid)
    while True:
        time.sleep(1)
        now = cpu_seconds(pid)
        if now - before < 0.05:
            return
        before = now


def answer_of(asking: HTTPConnection, path: str, key: str) -> bytes:
    """What is answered to whoever shows a key or a token."""
    asking.request("GET", path, headers={"Authorization": f"Bearer {key}"})
    return asking.getresponse().read()


def print_starts(scene: str, times: int, *, with_exact: bool = False) -> None:
    """How soon a stroke is answered after the start of a process, with and without a cache."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        path = shutil.which("chromium")
        browser = playwright.chromium.launch(executable_path=path, args=ARGUMENTS)
        # As installed packages have it, and a source tree may not.
        environment = {
            **os.environ,
            "LIGHTPAINT_CACHE": f"{folder}/cache",  # which holds nothing else
            "PYTHONPYCACHEPREFIX": f"{folder}/py",
        }
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        print(f"{scene}: s from the start of its process, and s of the processor that it took")
        heads = ("", "address", *STAGES, "stroke", "processor", "GB", "page, GB", "ms")
        heads += ("exact", "GB") if with_exact else ()
        print(f"{heads[0]:12s}" + "".join(f"{head:>10s}" for head in heads[1:]))
        run = partial(started, browser, scene, folder, environment, with_exact=with_exact)
        print_times("nothing kept", [run(is_first=True)])
        every = []
        for _ in range(times):
            every.append(run())
            print_times("kept", every[-1:])
        print_times("median", every)
        browser.close()


def print_times(name: str, every: list[list[float]]) -> None:
    """A row: the median of each column."""
    print(f"{name:12s}" + "".join(f"{x:10.2f}" for x in np.median(every, axis=0)), flush=True)


def started(
    browser: Any,
    scene: str,
    folder: str,
    environment: dict[str, str],
    *,
    is_first: bool = False,
    with_exact: bool = False,
) -> list[float]:
    """Seconds to each stage, and the figures after it. is_first: wait at the end until all that can
    be kept is.
    """
    place = tempfile.mkdtemp(dir=folder)
    words = [sys.executable, "-m", "lightpaint", "paint", scene, "-o", place]
    page = browser.new_context(viewport={"width": 1600, "height": 900}).new_page()
    begin = time.perf_counter()
    painter = subprocess.Popen(
        [*words, "--no-browser", "--port", "0"],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    assert painter.stdout is not None
    line = painter.stdout.readline()
    times = [time.perf_counter() - begin]
    page.goto(line.partition(" at ")[2].split()[0])
    for is_there in STAGES.values():
        page.wait_for_function(is_there, timeout=600_000)
        times.append(time.perf_counter() - begin)
    box = page.evaluate(
        f"() => {{ const {{ engine }} = {PAINTER}, [pane] = engine.panes();"
        " const box = engine.element.getBoundingClientRect();"
        " return [box.x + pane.x + pane.width / 2, box.y + pane.y + pane.height / 2]; }"
    )
    page.mouse.click(*box)
    page.wait_for_function(f"() => {PAINTER}.engine.mirror.strokes.count && {PAINTER}.engine.mirror"
                           ".strokes.isPending === false", timeout=60_000)  # fmt: skip
    times.append(time.perf_counter() - begin)
    times += [cpu_seconds(painter.pid), largest_gb(painter.pid), largest_page_gb()]
    times.append(median_ms(page, box))
    if with_exact:
        begin = time.perf_counter()
        wait_until_idle(painter.pid)
        times += [time.perf_counter() - begin, largest_gb(painter.pid)]
    if is_first:
        until, kept = time.monotonic() + 600, "*.opening.npz" if is_saved(scene) else "*.clean.npz"
        while not list(Path(folder, "cache").glob(kept)) and time.monotonic() < until:
            time.sleep(0.5)
    page.context.close()
    painter.terminate()
    painter.wait()
    return times


if __name__ == "__main__":
    if sys.argv[1:2] == ["--serve"]:
        serve(*sys.argv[2:])
    elif sys.argv[1:2] == ["--serve-scene"]:
        serve_scene(*sys.argv[2:])
    else:
        main()
