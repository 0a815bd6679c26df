"""Shared fixtures: small synthetic bases, so that the rooms without a renderer test in ms.

Where the renderer is needed there is one small room, loaded and rendered once, to look at only.
"""

import gc
import os
import shutil
import signal
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import settings
from patience import PATIENCE_MS, PATIENCE_S
from renderer import write_room
from threadpoolctl import threadpool_limits

from lightpaint import progress
from lightpaint.basis.light_basis import Basis, Origin
from lightpaint.basis.lights import BasisLight
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.placement.paths import view_paths
from lightpaint.placement.search import new_light_search, pose_search
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.runtime import kernel_threads
from lightpaint.scene.scene_reader import load_scene

# Shared machines are slow now and then, which is not a failure; a fixed choice of examples makes
# a run repeatable.
settings.register_profile("check", deadline=None, derandomize=True, max_examples=25)
settings.register_profile("nightly", deadline=None, derandomize=True, max_examples=100)
settings.load_profile("check")

BasisFactory = Callable[..., Basis]

#: WebGL2 in software, so that both views are tried where there is no GPU; pages themselves are put
#: together without it, which takes a third of the time then.
CHROMIUM = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",
]


def pytest_configure(config: pytest.Config) -> None:
    """Let tests press Ctrl-C, and workers of pytest-xdist share the cores."""
    if not config.getoption("markexpr"):
        settings.load_profile("nightly")  # ./check --all
    # What a shell starts in the background ignores it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if hasattr(config, "workerinput"):
        # For BLAS in this process, and in what is loaded or started later.
        os.environ["OPENBLAS_NUM_THREADS"] = "1"
        threadpool_limits(1, "blas")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run long tests first: no worker shall have one left when the others are done."""
    items.sort(key=lambda item: item.get_closest_marker("long") is None)


def pytest_unconfigure() -> None:
    """Have all collected at the end: libraries complain of what is left."""
    gc.unfreeze()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """One line for all skips, whose reasons are the names of what was not there."""
    skipped = terminalreporter.getreports("skipped")
    wanting = sorted({report.longrepr[2].removeprefix("Skipped: ") for report in skipped})
    if wanting:
        terminalreporter.write_line(
            f"not tried here, for want of: {', '.join(wanting)} ({len(skipped)} tests)"
        )


@pytest.fixture(autouse=True)
def quiet_stages(monkeypatch: pytest.MonkeyPatch) -> None:
    """No line on a stage that takes long because the machine is busy."""
    monkeypatch.setattr(progress, "QUIET_S", PATIENCE_S)


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """The system's Chromium, or the one that Playwright has installed.

    The shell without a window comes first: a tab of it costs a sixth of the processor time, since
    the whole program draws its own toolbar as a page beside each.
    """
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright")
    with playwright.sync_playwright() as started:
        shells = ("chromium-headless-shell", "chrome-headless-shell")
        names = (*shells, "chromium", "chromium-browser", "google-chrome")
        path = next(filter(None, map(shutil.which, names)), None)
        if path is None and not Path(started.chromium.executable_path).exists():
            pytest.skip("a browser (chromium)")
        chromium = started.chromium.launch(executable_path=path, args=CHROMIUM)
        for name in ("new_context", "new_page"):
            setattr(chromium, name, _patient(getattr(chromium, name)))
        yield chromium
        chromium.close()


def _patient(make: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that makes contexts or pages which wait as long as anything takes."""

    def made(**options: Any) -> Any:
        new = make(**options)
        new.set_default_timeout(PATIENCE_MS)
        return new

    return made


@pytest.fixture(scope="session")
def make_basis() -> BasisFactory:
    """A function that makes a Basis of random images, one light each.

    images, half_differences: (n, h, w, 3), instead of random ones. seen: (h, w) bool.
    """

    def make(
        n: int = 3,
        size: tuple[int, int] = (12, 10),
        *,
        seed: int = 0,
        names: Sequence[str] | None = None,
        emission: Sequence[Sequence[float]] | None = None,
        images: Any = None,
        half_differences: Any = None,
        seen: Any = None,
    ) -> Basis:
        rng = np.random.default_rng(seed)
        if images is None:
            images = rng.random((n, *size, 3))
        images = np.asarray(images, dtype=np.float32)
        n, height, width, _ = images.shape
        if half_differences is None:
            half_differences = np.zeros(images.shape)
        if emission is None:
            emission = rng.random((n, 3)).tolist()
        if seen is None:
            seen = np.zeros((height, width), dtype=bool)
        names = [f"light {k}" for k in range(n)] if names is None else names
        lights = tuple(
            BasisLight(name, "area", "radiance", "W/(m² sr)", tuple(map(float, rgb)), "1 m²")
            for name, rgb in zip(names, emission, strict=True)
        )
        origin = Origin("scene.xml", "0f" * 8, "sensor", 0, "synthetic", (32, 32), (1, 1))
        return Basis(lights, images, np.asarray(half_differences, np.float32), seen, origin)

    return make


@pytest.fixture(scope="session")
def small_room(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """The room of `renderer.py` with all its lights."""
    return load_scene(write_room(tmp_path_factory.mktemp("small_room")))


@pytest.fixture(scope="session")
def small_room_basis(small_room: Scene) -> BasisFactory:
    """A function that renders its basis: the same one for the same samples and seed."""
    return cache(partial(render_basis, small_room))


@pytest.fixture
def short_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """Search for places of lights with few trials and steps, along few paths.

    For tests of what a search is asked and what is said of it, not of what it finds: it takes most
    of their time.
    """
    monkeypatch.setattr(pose_search, "COMPARED", 10)
    monkeypatch.setattr(pose_search, "REFINED", 2)
    monkeypatch.setattr(new_light_search, "STARTS", 1)
    monkeypatch.setattr(new_light_search, "STEPS", 2)
    monkeypatch.setattr(view_paths, "FINE_SIDES", (1, 2))
    monkeypatch.setattr(view_paths, "NOISY_SIDE", 4)


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Neither take nor leave anything in the cache of whoever runs the tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LIGHTPAINT_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module", autouse=True)
def _one_kernel_thread(request: pytest.FixtureRequest) -> Iterator[None]:
    """Let each worker of pytest-xdist run kernels on one thread; alone, tests use all.

    Kernels of a few pixels wait for their slowest thread, which waits for the other workers. Other
    processes, such as commands of their own, use all threads.
    """
    with pytest.MonkeyPatch.context() as patch:
        if hasattr(request.config, "workerinput"):
            patch.setattr(kernel_threads, "_limit", 1)
        yield


@pytest.fixture(scope="module", autouse=True)
def _older_objects_are_not_looked_through() -> Iterator[None]:
    """Every scene that is let go of collects garbage: of what is new, not of all that is loaded.

    Each module's garbage is collected as it ends, and what is left is never looked through again:
    half a million objects of the tests and of what they import take 0.3 s each time.
    """
    gc.freeze()
    yield
    gc.collect()
