"""How many of anything a file or a message may give, and that work on too many can be given up."""

import asyncio
import json
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import run_refused
from live_server import run_in_loop
from patience import PATIENCE_S

import lightpaint as lp
from lightpaint.batch.manifest.looks_file import read_manifest
from lightpaint.errors import BatchError, ConstraintError, LightingError, PaintError, SceneError
from lightpaint.lighting.algebra.optimum import minimise
from lightpaint.lighting.answer.lighting_file import MAX_BYTES, read_lighting
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.paint.message_frames import parse_request
from lightpaint.paint.protocol import Message
from lightpaint.paint.server.session_clients import Connections
from lightpaint.pipeline.job.settings import Settings
from lightpaint.progress import cancellable, cancellation_check
from lightpaint.scene.lights.light_choice import choose_lights
from lightpaint.scene.lights.lights_file import read_lights_file
from lightpaint.storage.json_records import strict_toml
from lightpaint.threads import parallel_map
from lightpaint.validation import MAX_LISTED, MAX_NAME, MAX_PRIMARIES

MANY = ["#ff0000", "#00ff00"] * 1500


def test_no_light_mixes_more_colours_than_a_fixture_has(tmp_path: Path) -> None:
    assert MAX_PRIMARIES == 16
    Constraints.of({"a": {"primaries": MANY[:16]}})
    message = "lists {} colours: at most 16 can be mixed"
    for count in (17, len(MANY)):
        with pytest.raises(ConstraintError, match=message.format(count)):
            Constraints.of({"a": {"primaries": MANY[:count]}})
    path = tmp_path / "hall.lights.toml"
    path.write_text(f"[light.a]\nprimaries = {json.dumps(MANY)}\n")
    with pytest.raises(ConstraintError, match=r"hall.*light.a.primaries lists 3000 colours"):
        lp.read_constraints(path)


@pytest.mark.parametrize(
    "constraints",
    [
        {"lock": "3200K" + " " * 10**6 + "40%"},
        {"limits": {"min": "0" * 10**6}},
        {"color": "#" + "f" * 10**6},
        {"kelvin": [3000.0] * 10**5},
        {"primaries": ["3200K" + " " * 10**6]},
        {"x" * 10**6: True},
    ],
)
def test_a_value_that_is_too_long_is_said_in_one_short_line(constraints: dict[str, Any]) -> None:
    with pytest.raises(ConstraintError) as refusal:
        Constraints.of({"a": constraints})
    assert len(str(refusal.value)) < 1000


def test_lists_of_lights_have_an_end(tmp_path: Path) -> None:
    names = [f"light {k}" for k in range(MAX_LISTED + 1)]
    with pytest.raises(ConstraintError, match=f"at most {MAX_LISTED} are read"):
        Constraints.of({name: {} for name in names})
    with pytest.raises(ConstraintError, match=f"at most {MAX_LISTED} are read"):
        Constraints.of(tie=[names[:2]] * len(names))
    with pytest.raises(SceneError, match=f"at most {MAX_LISTED}"):
        choose_lights([], scene="hall.xml", groups={"all": names})
    with pytest.raises(SceneError, match=f"at most {MAX_NAME} characters"):
        choose_lights([], scene="hall.xml", groups={"x" * 10**6: ["a"]})
    path = tmp_path / "hall.lights.toml"
    for text, message in (
        (f"lights = {json.dumps(names)}", f"at most {MAX_LISTED}"),
        (f"[groups]\n{'x' * 10**6} = ['a']", f"a name of more than {MAX_NAME} characters"),
    ):
        path.write_text(text)
        with pytest.raises(SceneError, match=message):
            read_lights_file(path)


def test_dots_end_no_parser(tmp_path: Path) -> None:
    began_s = time.process_time()
    with pytest.raises(ValueError, match="line 2 has too many dots, 100000"):
        strict_toml("a = 1\n" + ".".join(["x"] * 100_001) + " = 1")
    path = tmp_path / "looks.toml"
    path.write_text(".".join(["x"] * 100_001) + " = 1")
    with pytest.raises(BatchError, match=r"looks.toml is not TOML: line 1 has too many dots"):
        read_manifest(path)
    assert time.process_time() - began_s < 5


def test_a_lighting_that_is_too_long_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "lighting.json"
    path.write_bytes(b"{" + b" " * MAX_BYTES)
    with pytest.raises(LightingError, match=f"no lighting file has more than {MAX_BYTES}"):
        read_lighting(path)


def test_names_of_lights_have_an_end(make_basis: Any) -> None:
    with pytest.raises(lp.LightpaintError, match="a name of more than 1000 characters"):
        make_basis(1, names=["x" * 1001])


@pytest.mark.parametrize(
    "content",
    [
        {"kind": "paint", "stroke": 1, "region": [0, 1, 0, 1], "label": "x" * 10**6},
        {"kind": "save_look", "name": "x" * 10**6},
        {"kind": "constrain_light", "light": 0, "constraints": {"lock": " " * 10**6 + "1"}},
        {"kind": "tie", "ties": [["a", "b"]] * 5000},
        {"kind": "constrain_lights", "constraints": {"a": {"primaries": MANY * 2}}},
        {"kind": "change_settings", "settings": {"x" * 10**6: 1}},
    ],
)
def test_a_message_has_no_more_than_a_page_has_use_for(content: dict[str, Any]) -> None:
    with pytest.raises(PaintError, match=r"and at most \d+ are taken"):
        parse_request({**content, "seq": 1}, [])


def test_samples_and_suggestions_have_an_end(tmp_path: Path) -> None:
    """Before passes are listed, which so many would fill the memory with."""
    for key, most in (("spp", 2**20), ("verify_spp", 2**20), ("suggest", 32)):
        Settings(**{key: most})
        with pytest.raises(lp.LightpaintError, match=f"at most {most}"):
            Settings(**{key: most + 1})
        option = f"--{key.replace('_', '-')}"
        refusal = run_refused(tmp_path, "solve", option, str(most + 1), "r.xml", "a.png")
        assert option in refusal
        assert "at most" in refusal


# Work that is given up


def _without_end(has_begun: threading.Event) -> None:
    check = cancellation_check()
    has_begun.set()
    while True:
        check()
        time.sleep(0.001)


def test_a_server_ends_while_its_session_is_at_work() -> None:
    class Slow:
        on_message: Callable[[Message], None] | None = None

    async def serve_and_end() -> None:
        line, has_begun = Connections(Slow(), None), threading.Event()  # type: ignore[arg-type]
        work = asyncio.ensure_future(line._thread.run(_without_end, has_begun))
        await asyncio.to_thread(has_begun.wait)
        await asyncio.wait_for(line.close(), PATIENCE_S)
        with pytest.raises(PaintError, match="the painter has ended"):
            await work

    run_in_loop(serve_and_end)


def test_ctrl_c_waits_for_no_job_beside() -> None:
    has_begun = threading.Event()

    def work(is_other: bool) -> None:
        if threading.current_thread() is threading.main_thread():
            has_begun.wait()
            raise KeyboardInterrupt
        _without_end(has_begun)

    with pytest.raises(KeyboardInterrupt):
        parallel_map(work, [False, True])


@pytest.mark.parametrize("method", ["polished", "gauss-seidel"])
def test_a_solve_asks_whether_it_is_wanted(method: Any) -> None:
    rng = np.random.default_rng(0)
    A = rng.standard_normal((60, 40))
    checks = []

    def check() -> None:
        checks.append(1)
        if len(checks) > 2:
            raise PaintError("over")

    with pytest.raises(PaintError, match="over"), cancellable(check):
        minimise(A.T @ A, A.T @ rng.random(60), upper=0.01, method=method)
