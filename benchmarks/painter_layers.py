"""Layers of a painting: what they cost under the brush, at the start and in memory.

Run by `benchmarks/painter.py --layers N`. One layer and N are measured in turns, stroke by stroke,
so that what else runs on the machine meets both; every fifth layer covers the whole picture.
"""

import hashlib
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

import lightpaint as lp
from lightpaint.paint import protocol
from lightpaint.paint.layers.layer_stack import Layer
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.store.history_steps import Identity, Region, slices
from lightpaint.paint.store.session_file import MemoryStore, Store
from lightpaint.pipeline.job.settings import Settings

#: Makes layers, as adjustments of the whole picture and as strokes of their own.
LAYERS = """async (count) => {
  const { engine } = document.getElementById('lightpaint').painter;
  const [height, width] = engine.screen.size, { mirror } = engine;
  for (let k = 0; k < count; k++) {
    if (k % 5 === 0) engine.adjust({ stops: 0.05, mired: 5, object: null });
    else {
      engine.layers.isWishDone = true;
      engine.begin({ x: 0.2 * width, y: (0.1 + 0.04 * k) * height, pressure: 1 });
      engine.move([{ x: 0.8 * width, y: (0.1 + 0.04 * k) * height, pressure: 1 }]);
      engine.end();
    }
    while (mirror.strokes.isPending) await new Promise((done) => setTimeout(done, 10));
  }
  engine.layers.isWishDone = true;
}"""


#: Whether a page has its session with all layers, and all pictures.
LOADED = """() => {
  const painter = document.getElementById('lightpaint')?.painter;
  const mirror = painter?.engine.mirror;
  return mirror?.isReady && !mirror.loader.missingSlots().length;
}"""


def made_session(basis: lp.Basis, count: int, store: Store) -> Session:
    """A session with so many layers."""
    height, width = basis.size
    session = Session(
        [basis], [basis.current_look], store, settings=Settings(), transform=lp.ViewTransform()
    )
    rng = np.random.default_rng(0)
    for k in range(count):
        if k % 5 == 0:
            layer = Layer(k + 1, "adjust", f"Whole {k}", gain=1.03, tint=(1.01, 1.0, 0.99))
            region, arrays = (0, height, 0, width), {"importance": np.ones(basis.size, np.float32)}
        else:
            layer = Layer(k + 1, "paint", f"1 stroke {k}")
            y = int((0.1 + 0.8 * rng.random()) * height)
            region = (max(0, y - 20), min(height, y + 20), int(0.2 * width), int(0.8 * width))
            rows, columns = region[1] - region[0], region[3] - region[2]
            soft = np.clip(1.2 - np.abs(np.arange(rows) - rows / 2) / 20, 0, 1)
            look = basis.current_look[region[0] : region[1], region[2] : region[3]]
            arrays = {
                "image": (1.2 * look).astype(np.float32),
                "importance": np.repeat(soft[:, None], columns, 1).astype(np.float32),
            }
        session.handle(protocol.Paint(k + 1, region, True, layer=k + 1, properties=layer), arrays)
    return session


def print_session(basis: lp.Basis, count: int, strokes: int) -> None:
    """Print the processor's time of the session for a piece of a stroke, on one layer and on the
    topmost and the lowest of several.
    """
    sessions = {
        "the only layer": (made_session(basis, 1, _memory(basis)), 2),
        f"the topmost of {count}": (made_session(basis, count - 1, _memory(basis)), count),
        f"the second of {count}": (made_session(basis, count, _memory(basis)), 2),
    }
    height, width = basis.size
    times: dict[str, list[float]] = {name: [] for name in sessions}
    for stroke in range(strokes):
        y = int((0.1 + 0.8 * (stroke * 0.37 % 1)) * height)
        for k in range(30):
            x = int((0.1 + 0.75 * k / 30) * width)
            region = (max(0, y - 32), min(height, y + 32), x, x + 64)
            shape = (region[1] - region[0], 64)
            arrays = {
                "image": np.full((*shape, 3), 0.3, np.float32),
                "importance": np.full(shape, 0.7, np.float32),
            }
            for name, (session, number) in sessions.items():
                known = number in session.views.layers.ids
                layer = session.views.layers[number] if known else Layer(number, "paint")
                request = protocol.Paint(
                    1000 + stroke, region, k == 29, layer=number, properties=layer
                )
                start = time.process_time()
                session.handle(request, arrays)
                times[name].append(1e3 * (time.process_time() - start))
    print("Python's part of a piece of a stroke, 64 x 64 pixels, ms of the processor")
    base = np.percentile(times["the only layer"], [50, 99])
    for name, values in times.items():
        middle, worst = np.percentile(values, [50, 99])
        print(
            f"{name:20s} median {middle:6.1f} ({middle / base[0]:.2f}x)"
            f"   99 % {worst:6.1f} ({worst / base[1]:.2f}x)",
            flush=True,
        )


def print_long_session(path: str, layers: int, strokes: int, pieces: int = 20) -> None:
    """Print what strokes over more and more layers cost the session, ten by ten, and its memory.

    path: of a saved basis. The first strokes make a layer each, of which every fifth adjusts what
    it covers; later ones are on any of them. Nothing else runs: no page, and no exact answers.
    """
    from painter import largest_gb, trim

    basis = lp.read_basis(path)
    look, (height, width), rng = basis.current_look, basis.size, np.random.default_rng(0)
    print(f"{len(basis.lights)} lights at {width}x{height}, {layers} layers, ms of the processor")
    heads = "strokes", "median", "95 %", "last piece", "MB", "largest MB"
    print("{:>8s} {:>8s} {:>8s} {:>11s} {:>8s} {:>11s}".format(*heads))
    with tempfile.TemporaryDirectory() as folder:
        store = Store.open(Path(folder) / "session.db", Identity.of([basis]))
        session = Session([basis], [look], store, settings=Settings(), transform=lp.ViewTransform())
        times: list[list[float]] = []
        for stroke in range(1, strokes + 1):
            number = stroke if stroke <= layers else int(rng.integers(1, layers + 1))
            y = int((0.1 + 0.8 * rng.random()) * height)
            times.append([])
            for k in range(pieces):
                x = int((0.1 + 0.75 * k / pieces) * width)
                region = (max(0, y - 20), min(height, y + 20), x, min(width, x + 40))
                request = _piece(session, stroke, number, region, is_final=k == pieces - 1)
                light = (1.2 * look[slices(region)]).astype(np.float32)
                arrays = {"image": light, "importance": np.full(light.shape[:2], 0.7, np.float32)}
                start = time.process_time()
                session.handle(request, arrays)
                times[-1].append(1e3 * (time.process_time() - start))
            if stroke % 10 == 0:
                trim()
                moving = [x for each in times for x in each[:-1]]
                middle, worst = np.percentile(moving, [50, 95])
                last = np.median([each[-1] for each in times])
                largest = 1e3 * largest_gb(os.getpid())
                print(
                    f"{stroke:8d} {middle:8.1f} {worst:8.1f} {last:11.1f}"
                    f" {_memory_mb():8.0f} {largest:11.0f}",
                    flush=True,
                )
                times = []
        store.close()


def _piece(
    session: Session, stroke: int, number: int, region: Region, *, is_final: bool
) -> protocol.Paint:
    """Return the request of a piece of a stroke on a layer, which the first one makes."""
    if number in session.views.layers.ids:
        layer = session.views.layers[number]
    elif number % 5 == 0:
        layer = Layer(number, "adjust", f"Adjusted {number}", gain=1.03, tint=(1.01, 1.0, 0.99))
    else:
        layer = Layer(number, "paint", f"1 stroke {number}")
    return protocol.Paint(stroke, region, is_final, layer=number, properties=layer)


def print_pages(opened: Any, count: int, strokes: int) -> None:
    """Print times from pointer to screen through two pages in turns, and their ratios.

    opened: returns an open painter, as a context.
    """
    print("through the page, in turns")
    print("times in ms; of the processor for each answer")
    heads = ("layers", "median", "99 %", "answers", "server, CPU", "page, CPU")
    print("{:>8s} {:>7s} {:>6s} {:>8s} {:>13s} {:>12s}".format(*heads))
    with opened() as one, opened(beside=one) as many:
        clocks = {}
        for page, layers in ((one, 1), (many, count)):
            page.page.evaluate(LAYERS, layers - 1)
            page.page.wait_for_timeout(3000)
            page.page.evaluate("() => { window.times.length = 0; }")
            clock = page.page.context.new_cdp_session(page.page)
            clock.send("Performance.enable", {"timeDomain": "threadTicks"})
            clocks[id(page)] = clock
        spent = {id(page): np.zeros(2) for page in (one, many)}
        for number in range(strokes):
            for page in (one, many) if number % 2 else (many, one):
                before = _spent_s(page, clocks[id(page)])
                page.stroke(number)
                spent[id(page)] += _spent_s(page, clocks[id(page)]) - before
                page.page.wait_for_timeout(1500)
        ratio = np.ones(4)
        for page, layers in ((one, 1), (many, count)):
            times = page.page.evaluate("() => window.times")
            values = [*np.percentile(times, [50, 99]), *(1e3 * spent[id(page)] / len(times))]
            ratio = np.array(values) / ratio
            print(
                f"{layers:8d} {values[0]:7.0f} {values[1]:6.0f} {len(times):8d}"
                f" {values[2]:13.1f} {values[3]:12.1f}",
                flush=True,
            )
    print(
        f"{'ratio':>8s} {ratio[0]:7.2f} {ratio[1]:6.2f} {'':8s} {ratio[2]:13.2f} {ratio[3]:12.2f}"
    )


def _spent_s(page: Any, clock: Any) -> Any:
    """Seconds of the processor that the server and the page's main thread have taken."""
    metrics = {x["name"]: x["value"] for x in clock.send("Performance.getMetrics")["metrics"]}
    return np.array([_cpu_s(page.server.pid), metrics["TaskDuration"]])


def print_opening(case: tuple[int, ...], counts: tuple[int, ...] = (1, 200)) -> None:
    """Print what opening a session with so many layers takes, each in a process of its own."""
    print(f"opening a session of {case[0]} lights at {case[1]}x{case[2]}")
    with tempfile.TemporaryDirectory() as folder:
        for count in counts:
            for way in ("make", "afresh", "open", "open"):
                path = Path(folder) / f"{count}.lightpaint"
                words = [way, str(path), str(count), "x".join(map(str, case))]
                subprocess.run([sys.executable, __file__, *words], check=True)


def print_page_opening(
    case: tuple[int, ...], opened: Callable[[str, Any], Any], counts: tuple[int, int] = (1, 200)
) -> None:
    """Print how soon a page shows a session with so many layers, and all its pictures.

    opened: returns an open painter of a session file, as a context, in the browser of another one.
    Its page is loaded again, in turns with the page of the other count.
    """
    print("loading the page of such a session again, ms of the clock until all pictures are there")
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        painters: list[Any] = []
        for count in counts:
            path = str(Path(folder) / f"{count}.lightpaint")
            words = ["make", path, str(count), "x".join(map(str, case))]
            subprocess.run([sys.executable, __file__, *words], check=True)
            painters.append(stack.enter_context(opened(path, painters[0] if painters else None)))
        times: list[list[float]] = [[], []]
        for turn in range(8):
            for k in (0, 1) if turn % 2 else (1, 0):
                start = time.perf_counter()
                painters[k].page.reload()
                painters[k].page.wait_for_function(LOADED, timeout=120_000)
                times[k].append(1e3 * (time.perf_counter() - start))
    middles = [float(np.median(values)) for values in times]
    for count, middle in zip(counts, middles, strict=True):
        print(f"{count:4d} layers: {middle:6.0f} ({middle / middles[0]:.2f}x)", flush=True)


def open_session(way: str, path: Path, count: int, case: tuple[int, ...]) -> None:
    """Make a session file, or open it and print what that takes."""
    from painter import made_up, trim

    basis = made_up(case[0], case[2], case[1])
    look = basis.current_look
    if way == "make":
        with Store.open(path, Identity.of([basis])) as store:
            made_session(basis, count, store)
        return
    before, start, clock = _memory_mb(), time.process_time(), time.perf_counter()
    with Store.open(path, Identity.of([basis])) as store:
        session = Session([basis], [look], store, settings=Settings(), transform=lp.ViewTransform())
        cpu, wall = time.process_time() - start, time.perf_counter() - clock
        trim()
        digest = hashlib.sha256(session.views[0].image.tobytes()).hexdigest()[:8]
        print(
            f"{count:4d} layers, {'built afresh' if way == 'afresh' else 'opened again'}:"
            f" {1e3 * cpu:5.0f} ms of the processor, {1e3 * wall:5.0f} of the clock,"
            f" {_memory_mb() - before:+4.0f} MB, target {digest},"
            f" file {path.stat().st_size / 1e6:.1f} MB",
            flush=True,
        )
        if (compositions := session.compositions()) is not None:
            store.put_compositions(*compositions)


def _memory(basis: lp.Basis) -> Store:
    return MemoryStore(Identity.of([basis]))


def _memory_mb() -> float:
    pages = Path("/proc/self/statm").read_text().split()[1]
    return int(pages) * resource.getpagesize() / 1e6


def _cpu_s(process: int) -> float:
    ticks = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[11:13]
    return sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    open_session(
        sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), tuple(map(int, sys.argv[4].split("x")))
    )
