"""A studio answers at once, says later what takes longer, and exports what `solve` finds."""

import re
import sqlite3
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from patience import PATIENCE_S
from studio_client import StudioClient

import lightpaint as lp
from lightpaint.basis.cache.denoised_planes import (
    DenoisedPlanes,
    cache_denoised_planes,
    read_denoised_planes,
)
from lightpaint.lighting import DEFAULT_HOLD
from lightpaint.lighting.analysis.noise.noise_correction import correct_noise
from lightpaint.paint import protocol, subject
from lightpaint.paint.background_threads import SOLVE_DELAY_S
from lightpaint.paint.protocol import Message
from lightpaint.paint.session import picture_table
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.session_access import Publisher
from lightpaint.paint.store import database
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.studio import session_bases, session_exports
from lightpaint.paint.studio.session_studio import Studio
from lightpaint.paint.subject import Subject
from lightpaint.report.phrases import spoken_amount

SIZE = (18, 32)


@pytest.fixture
def basis(make_basis: Any) -> lp.Basis:
    """Soft lights with a little noise."""
    rng = np.random.default_rng(2)
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] / SIZE[0]
    images = np.array(
        [
            (np.exp(-((y - a) ** 2 + (x - b) ** 2) / 0.3) + 0.02)[..., None]
            * rng.uniform(0.3, 1, 3)
            for a, b in ((0.2, 0.3), (0.6, 0.8), (0.4, 1.4))
        ]
    )
    noise = 0.01 * images * rng.standard_normal(images.shape)
    return make_basis(  # type: ignore[no-any-return]
        images=images + noise, half_differences=noise, emission=[[0.5, 0.5, 0.5]] * 3
    )


@pytest.fixture
def client(basis: lp.Basis, tmp_path: Path) -> Iterator[StudioClient]:
    """A studio that is open."""
    studio_client = StudioClient(tmp_path, basis)
    yield studio_client
    studio_client.studio.close()


@pytest.mark.usefixtures("without_reasons")
def test_selections_start_no_solve(client: StudioClient, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither does undo of them, nor redo; undo of the stroke before them does."""
    client.paint(1, 0.8)
    client.exact()
    solved = []
    solution = SessionSnapshot.solution

    def counted(snapshot: SessionSnapshot) -> Any:
        solved.append(snapshot.version)
        return solution(snapshot)

    monkeypatch.setattr(SessionSnapshot, "solution", counted)
    solve_count = -1  # what was asked for at the start may be solved after the stroke
    while solve_count != len(solved):
        solve_count = len(solved)
        time.sleep(8 * SOLVE_DELAY_S)
    solved.clear()
    version = client.studio.session.version
    mask = {"mask": np.full((2, 3), 255, np.uint8)}
    client.studio.handle(protocol.Select((0, 2, 0, 3), "rectangle"), mask)
    picture = client.studio.session.history.picture
    selected, stroke = (client.studio.session.store.step_ids[k] for k in (-1, -2))
    np.testing.assert_array_equal(picture(selected), picture(stroke))
    for request in (protocol.Undo(), protocol.Redo(), protocol.GoToStep(stroke)):
        [patch] = client.studio.handle(request, {})
        assert patch.fields["version"] == client.studio.session.version == version
    time.sleep(2 * SOLVE_DELAY_S)
    assert not solved
    client.studio.handle(protocol.Undo(), {})
    client.exact()
    assert solved == [version + 1]


@pytest.mark.usefixtures("without_reasons")
def test_what_is_exported_is_solved_alike(client: StudioClient, basis: lp.Basis, tmp_path: Path):
    client.paint(1, 0.8)
    client.studio.handle(protocol.ConstrainLight(1, {"limits": {"min": 0.1, "max": 0.45}}), {})
    client.studio.handle(protocol.ChangeSettings({"colors": "free"}), {})
    exact = client.exact()
    client.studio.handle(protocol.Export(("target", "picture", "lighting")), {})
    exported = client.wait(lambda m: m.kind == "exported")
    assert set(exported.fields["files"]) == {
        str(tmp_path / "painting.exr"),
        str(tmp_path / "answer.png"),
        str(tmp_path / "lighting.json"),
    }
    words = exported.fields["command"]
    assert "--limit" in words
    assert "--colors free" in words
    constraints = lp.Constraints.of({basis.names[1]: {"limits": {"min": 0.1, "max": 0.45}}})
    look = lp.paint_with_light(
        None,
        tmp_path / "painting.exr",
        tmp_path / "again",
        basis=basis,
        constraints=constraints,
        colors="free",
    )
    np.testing.assert_allclose(look.solution.weights, exact.arrays["weights"], rtol=1e-12)
    emission = lp.read_lighting(tmp_path / "lighting.json").emission
    np.testing.assert_allclose(
        [emission[name] for name in basis.names], exact.arrays["weights"], rtol=1e-12
    )
    client.studio.handle(protocol.SetMaster(0.5), {})
    client.messages.clear()
    client.studio.handle(protocol.Export(("lighting",)), {})
    assert client.wait(lambda m: m.kind == "exported").fields["command"] == ""
    emission = lp.read_lighting(tmp_path / "lighting.json").emission
    np.testing.assert_allclose(
        [emission[name] for name in basis.names], 0.5 * exact.arrays["weights"], rtol=1e-12
    )


def test_what_is_not_of_a_painting_is_exported_without_one(client: StudioClient, tmp_path: Path):
    client.studio.handle(protocol.Export(("target", "picture", "lighting", "report")), {})
    exported = client.wait(lambda m: m.kind == "exported").fields
    files = [str(tmp_path / "answer.png"), str(tmp_path / "lighting.json")]
    assert exported == {"files": files, "command": "", "is_unpainted": True}
    client.studio.handle(protocol.Export(("target",)), {})
    notice = client.wait(lambda m: m.kind == "notice" and "nothing is painted" in m.fields["text"])
    assert notice.fields["task"] == "export"


@pytest.mark.nightly
@pytest.mark.usefixtures("without_reasons")
def test_a_named_export_replaces_no_earlier_one(client: StudioClient, tmp_path: Path):
    """Its command names the painting beside it."""

    def export(name: str) -> dict[str, Any]:
        client.exact()
        client.messages[:] = [m for m in client.messages if m.kind != "exported"]
        client.studio.handle(protocol.Export(("target", "lighting"), name=name), {})
        return client.wait(lambda m: m.kind == "exported").fields

    for k, folder in enumerate(("Act 1", "Act 1 2")):
        client.paint(k + 1, 0.3 + 0.5 * k)
        exported = export("Act 1")
        place = tmp_path / "exports" / folder
        assert exported["files"] == [str(place / x) for x in ("painting.exr", "lighting.json")]
        assert str(place / "painting.exr") in exported["command"]
    first, second = (
        lp.read_target(tmp_path / "exports" / folder / "painting.exr").image[5, 5, 0]
        for folder in ("Act 1", "Act 1 2")
    )
    np.testing.assert_allclose([first, second], [0.3, 0.8], atol=1e-3)  # half floats
    assert not (tmp_path / "painting.exr").exists()
    with pytest.raises(lp.LightpaintError, match="another name"):
        client.studio.handle(protocol.Export(("lighting",), name="/"), {})


def test_a_stroke_whose_end_was_never_heard_is_kept_at_the_end(
    client: StudioClient, tmp_path: Path
):
    arrays = {"image": np.ones((4, 4, 3), np.float32), "importance": np.ones((4, 4), np.float32)}
    client.studio.handle(protocol.Paint(1, (0, 4, 0, 4), False), arrays)
    identity = client.studio.session.store.identity
    client.studio.close()
    with Store.open(tmp_path / "session.db", identity) as store:
        assert [step.kind for step in store.steps] == ["stroke"]
        np.testing.assert_array_equal(store.steps[0].patches[0].after.image, arrays["image"])


@pytest.mark.nightly
@pytest.mark.usefixtures("without_reasons")
def test_one_export_is_written_at_a_time(client: StudioClient, monkeypatch: pytest.MonkeyPatch):
    """Also of what needs no render: they go to the same files."""
    at_work, most = 0, 0
    real = session_exports.export

    def export(*arguments: Any) -> Any:
        nonlocal at_work, most
        at_work += 1
        most = max(most, at_work)
        time.sleep(0.1)
        try:
            yield from real(*arguments)
        finally:
            at_work -= 1

    monkeypatch.setattr(session_exports, "export", export)
    client.paint(1, 0.8)
    client.exact()
    for _ in range(3):
        client.studio.handle(protocol.Export(("target", "lighting")), {})
    client.wait(lambda _: sum(m.kind == "exported" for m in client.messages) == 3)
    assert most == 1


@pytest.mark.usefixtures("without_reasons")
def test_an_export_can_be_stopped(
    client: StudioClient, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """What is there by then stays, and is named; one that begins later is not stopped with it."""
    has_begun = threading.Event()

    def report(_subjects: Any, _moment: Any, progress: Any) -> Iterator[Path]:
        for k in range(10_000):
            progress("verification", k, 10_000)
            has_begun.set()
            time.sleep(0.001)
        yield tmp_path / "never.html"

    monkeypatch.setattr(session_exports, "_write_report", report)
    client.paint(1, 0.8)
    client.exact()
    client.studio.handle(protocol.Export(("lighting", "report")), {})
    assert has_begun.wait(PATIENCE_S)
    client.studio.handle(protocol.Export((), run=False), {})
    exported = client.wait(lambda m: m.kind == "exported")
    files = [str(tmp_path / name) for name in ("painting.exr", "lighting.json")]
    assert exported.fields == {"files": files, "command": "", "is_stopped": True}
    client.messages.clear()
    client.studio.handle(protocol.Export(("lighting",)), {})
    assert "is_stopped" not in client.wait(lambda m: m.kind == "exported").fields


def test_an_exact_answer_tells_of_each_light(client: StudioClient, basis: lp.Basis):
    client.paint(1, 0.8)
    fields = client.exact().fields
    assert fields["exact"]
    assert fields["delta_e"] >= 0
    assert sum(light["share"] for light in fields["lights"]) == pytest.approx(1)
    assert [len(light["emission"]) for light in fields["lights"]] == [3, 3, 3]
    assert any(light["error"] for light in fields["lights"])


def test_denoised_planes_of_few_samples_do_until_there_are_better_ones(
    basis: lp.Basis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """A picture without grain is not shown with it again while the lights are still rendered."""
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))
    better = replace(basis, planes=basis.images * np.float32(1.5))
    is_taken, release = threading.Event(), threading.Event()
    cleaned: list[lp.Basis] = []
    real = session_bases.denoise_to_halves

    def denoise_to_halves(noisy_basis: lp.Basis, k: int, factor: int) -> Any:
        if noisy_basis.images is better.images:
            is_taken.set()
            release.wait(PATIENCE_S)
        cleaned.append(noisy_basis)
        return real(noisy_basis, k, factor)

    monkeypatch.setattr(session_bases, "denoise_to_halves", denoise_to_halves)
    monkeypatch.setattr(session_bases, "obtain_bases", lambda *_: iter([[basis], [better]]))
    client = StudioClient(tmp_path, basis)
    assert is_taken.wait(PATIENCE_S)
    assert len(cleaned) == len(basis.lights)
    fields = client.studio.state().fields
    for k, light in enumerate(fields["lights"]):
        assert f"clean/{k}" in fields["resources"]
        display = client.studio.resource(f"clean/{k}").astype(np.float64) * light["scale"]
        assert display.mean() == pytest.approx(basis.images[k].mean(), rel=0.1)
    release.set()
    client.wait(lambda m: m.kind == "progress" and m.fields["done"] == 1)
    for k, light in enumerate(fields["lights"]):
        display = client.studio.resource(f"clean/{k}").astype(np.float64) * light["scale"]
        assert display.mean() == pytest.approx(better.images[k].mean(), rel=0.1)
    client.studio.close()


def test_lights_of_unknown_noise_are_cleaned_too(
    basis: lp.Basis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Another renderer's groups come with their grain, and nobody says how much."""
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))
    origin = replace(basis.origin, halves=(0, 0))
    none = np.zeros_like(basis.half_differences)
    unknown = replace(basis, noise=none, origin=origin)
    assert not unknown.knows_noise
    client = StudioClient(tmp_path, unknown)
    client.wait(lambda m: m.kind == "renewed" and "clean/2" in m.fields["resources"])
    client.studio.close()


def test_what_is_said_comes_in_the_order_in_which_it_came_about(
    basis: lp.Basis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Else a page forgets a picture that another thread made while all there is was told."""
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))
    release, is_telling, better = threading.Event(), threading.Event(), replace(basis)
    tell = Publisher.publish

    def obtain_bases(*_: Any) -> Iterator[list[lp.Basis]]:
        yield [basis]
        assert release.wait(PATIENCE_S)
        yield [better]

    def slow(self: Publisher, message: Message | None) -> None:
        if message is not None and message.kind == "state" and release.is_set():
            is_telling.set()
            time.sleep(0.2)
        tell(self, message)

    monkeypatch.setattr(Publisher, "publish", slow)
    monkeypatch.setattr(session_bases, "obtain_bases", obtain_bases)
    client = StudioClient(tmp_path, basis)
    release.set()
    assert is_telling.wait(PATIENCE_S)
    client.studio.publisher.publish_picture("verified", np.zeros((*SIZE, 3), np.float16))
    client.wait(lambda _: sum(m.kind == "state" for m in client.messages) == 2)
    client.wait(lambda m: m.kind == "renewed" and "verified" in m.fields["resources"])
    known_versions: dict[str, int] = {}
    for message in client.messages:
        if message.kind in ("state", "renewed"):
            versions = message.fields["resources"]
            known_versions = versions if message.kind == "state" else known_versions | versions
    assert "verified" in known_versions
    client.studio.close()


def test_denoised_planes_come_later_and_keep_the_light(
    basis: lp.Basis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))
    # A studio of another test, which is about to end, may write its own planes into this cache.
    basis = replace(basis, planes=np.float32(1.25) * basis.images)
    client = StudioClient(tmp_path / "first", basis)
    client.wait(lambda m: m.kind == "renewed" and "clean/2" in m.fields["resources"])
    state = client.studio.state().fields
    for k, light in enumerate(state["lights"]):
        raw, clean = (
            client.studio.resource(f"{kind}/{k}").astype(np.float64) * light["scale"]
            for kind in ("plane", "clean")
        )
        # Half floats have 11 bits; a denoiser may move light, and not make any.
        np.testing.assert_allclose(raw, basis.images[k], rtol=2**-11, atol=1e-7)
        assert clean.mean() == pytest.approx(raw.mean(), rel=0.1)
    np.testing.assert_allclose(
        client.studio.resource("painting"), client.studio.session.views[0].image
    )
    until = time.monotonic() + 60
    while not read_denoised_planes(basis) and time.monotonic() < until:
        time.sleep(0.01)
    # The next session has the same at once, and one of other pixels has not.
    second_client = StudioClient(tmp_path / "again", basis)
    first = second_client.wait(lambda m: m.kind == "state").fields
    for k in range(len(basis.lights)):
        assert f"clean/{k}" in first["resources"]
        same = (one.studio.resource(f"clean/{k}") for one in (client, second_client))
        np.testing.assert_array_equal(*same)
    current_looks = (one.studio.session.views[0].current for one in (client, second_client))
    np.testing.assert_array_equal(*current_looks)
    assert read_denoised_planes(replace(basis, planes=2 * basis.images)) is None
    for one in (client, second_client):
        one.studio.close()


def test_kept_pictures_that_are_damaged_are_made_again(
    basis: lp.Basis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path))
    scales = np.ones(len(basis.lights))
    clean = DenoisedPlanes(basis.images.astype(np.float16), scales, basis.current_look)
    assert read_denoised_planes(basis) is None
    assert cache_denoised_planes(basis, clean)
    [path] = tmp_path.iterdir()
    data = path.read_bytes()
    for damage in (b"", b"no file", data[: len(data) // 2], data[:2000] + bytes(99) + data[2099:]):
        path.write_bytes(damage)
        assert read_denoised_planes(basis) is None
    assert cache_denoised_planes(basis, replace(clean, halves=clean.halves[:1]))
    assert read_denoised_planes(basis) is None
    assert cache_denoised_planes(basis, clean)
    planes = read_denoised_planes(basis)
    assert planes is not None
    np.testing.assert_array_equal(planes.halves, clean.halves)


def test_a_look_is_gone_back_to_and_undone(client: StudioClient):
    client.paint(1, 0.8)
    [looks] = client.studio.handle(protocol.SaveLook("  bright \n day "), {})
    [look] = looks.fields["looks"]
    assert look["name"] == "bright day"
    first = client.studio.session.views[0].image.copy()
    client.paint(2, 0.1)
    second = client.studio.session.views[0].image.copy()
    client.studio.handle(protocol.LoadLook(look["id"]), {})
    np.testing.assert_array_equal(client.studio.session.views[0].image, first)
    client.studio.handle(protocol.Undo(), {})
    np.testing.assert_array_equal(client.studio.session.views[0].image, second)
    client.studio.handle(protocol.CopyLook(look["id"]), {})
    client.studio.handle(protocol.RenameLook(look["id"], "noon"), {})
    [message] = client.studio.handle(protocol.DropLook(look["id"]), {})
    assert [x["name"] for x in message.fields["looks"]] == ["bright day copy"]
    with pytest.raises(lp.LightpaintError, match="no look"):
        client.studio.handle(protocol.LoadLook(99), {})


@pytest.mark.usefixtures("without_reasons")
def test_a_look_that_is_gone_back_to_has_its_own_answer_at_once(client: StudioClient):
    """Not one that comes from that of another look, until the exact one is there."""
    client.paint(1, 0.8)
    kept_weights = client.exact().arrays["weights"]
    [looks] = client.studio.handle(protocol.SaveLook("day"), {})
    client.paint(2, 0.02, (0, 12, 0, 16))
    other = client.exact().arrays["weights"]
    assert np.abs(other - kept_weights).max() > 0.1 * kept_weights.max()
    [patch] = client.studio.handle(protocol.LoadLook(looks.fields["looks"][0]["id"]), {})
    np.testing.assert_array_equal(patch.arrays["weights"], kept_weights)
    np.testing.assert_allclose(client.exact().arrays["weights"], kept_weights, rtol=1e-6)


def test_rounds_of_samples_are_counted_as_one_work():
    """In samples per pixel of those that are wanted, whatever the passes are of."""
    reports: list[tuple[int, int, str]] = []
    tell = lambda _, done, total, unit="passes": reports.append((done, total, unit))  # noqa: E731
    one, other = subject.joint_progress(tell, 2)
    for part in (one, other):
        hear = subject.progress_in_samples(part, 0, 8, 64, lights=3)
        for k in range(5):
            hear("basis", k, 4)
    for part in (one, other):
        hear = subject.progress_in_samples(part, 8, 64, 64, lights=3)
        for light in ("key", "fill", "rim"):  # rendered each alone
            for k in range(3):
                hear(f"basis: {light}", k, 2)
    assert {unit for *_, unit in reports} == {"samples per pixel"}
    assert {total for _, total, _ in reports} == {128}
    shares = [done for done, *_ in reports[5:]]
    assert shares == sorted(shares)
    assert reports[-1][:2] == (128, 128)


@pytest.mark.usefixtures("without_reasons")
def test_what_lies_between_two_looks_is_kept(client: StudioClient):
    answers = []
    for stroke, light in ((1, 0.8), (2, 0.1)):
        client.paint(stroke, light)
        answers.append(client.exact().arrays["weights"])
        [message] = client.studio.handle(protocol.SaveLook(f"look {stroke}"), {})
    one, two = (look["id"] for look in message.fields["looks"])
    [message] = client.studio.handle(protocol.MixLooks(one, two, 0.25, "between"), {})
    client.studio.handle(protocol.LoadLook(message.fields["looks"][-1]["id"]), {})
    between = client.exact().arrays["weights"]
    np.testing.assert_allclose(between, 0.75 * answers[0] + 0.25 * answers[1], rtol=1e-9)
    with pytest.raises(lp.LightpaintError, match="part is 2"):
        client.studio.handle(protocol.MixLooks(one, two, 2, "beyond"), {})


def test_what_was_done_is_there_again(client: StudioClient, basis: lp.Basis, tmp_path: Path):
    client.paint(1, 0.8)
    client.paint(2, 0.3, (0, 6, 10, 30))
    client.studio.handle(protocol.ConstrainLight(0, {"lock": True}), {})
    client.studio.handle(protocol.SaveLook("a"), {})
    session = client.studio.session
    client.studio.close()
    second_client = StudioClient(tmp_path, basis)
    np.testing.assert_array_equal(
        second_client.studio.session.views[0].image, session.views[0].image
    )
    assert second_client.studio.session.requests == session.requests
    state = second_client.studio.state().fields
    assert len(state["history"]["undo"]) == 3
    assert [look["name"] for look in state["looks"]] == ["a"]
    second_client.studio.handle(protocol.Undo(), {})
    second_client.studio.handle(protocol.Undo(), {})
    assert second_client.studio.session.views[0].importance[2, 20] == 0
    second_client.studio.close()


@pytest.mark.nightly
@pytest.mark.usefixtures("without_reasons")
def test_a_full_disk_is_said_to_pages_and_to_the_terminal(
    client: StudioClient, monkeypatch: pytest.MonkeyPatch
):
    @contextmanager
    def full(_: Any) -> Iterator[None]:
        raise sqlite3.OperationalError("database or disk is full")
        yield

    def is_disk_notice(message: Message) -> bool:
        return message.kind == "notice"

    at_terminal: list[str] = []
    client.studio.on_unsaved = at_terminal.append
    with monkeypatch.context() as patch:
        patch.setattr(database, "transaction", full)
        client.paint(1, 0.8)
        text = client.wait(is_disk_notice).fields["text"]
        assert "disk is full" in text
    client.wait(lambda m: is_disk_notice(m) and m.fields["tone"] == "info")
    assert at_terminal == [text, "all that was painted is kept again"]
    assert [m.fields["text"] for m in client.messages if is_disk_notice(m)] == at_terminal


def test_why_it_is_not_closer(client: StudioClient, monkeypatch: pytest.MonkeyPatch):
    copied: list[str] = []  # by which threads all pixels were, for which strokes wait
    snapshot = Session.snapshot

    def copies(session: Session, requests: Any = None) -> SessionSnapshot:
        copied.append(threading.current_thread().name)
        return snapshot(session, requests)

    monkeypatch.setattr(Session, "snapshot", copies)

    def explained() -> Any:
        client.messages.clear()
        copied.clear()
        client.studio.handle(protocol.Explain(), {})
        message = client.wait(lambda m: m.kind == "explained")
        assert message.fields["sentences"]
        assert not message.fields["is_old"]
        assert copied.count("lightpaint-explain") == 1
        beyond = client.studio.resource("beyond")
        assert not beyond[client.studio.session.views[0].importance == 0].any()
        return beyond

    # Brighter than the lights are, and even: they come near. Black beside it: none of them does.
    client.paint(1, 0.8)
    assert explained().max() < 64
    client.paint(2, 0.0, (3, 12, 10, 15))
    assert explained()[3:12, 10:15].max() > 128


@pytest.mark.nightly
@pytest.mark.usefixtures("without_reasons")
def test_a_preview_shows_what_the_change_does_then(
    client: StudioClient, monkeypatch: pytest.MonkeyPatch
):
    """To the last pixel, where no clean planes are there; and nothing is done before."""
    monkeypatch.setattr(
        session_bases.PlaneDenoiser, "planes_for", lambda _, bases: [None] * len(bases)
    )
    client.paint(1, 1.2)
    client.paint(2, 0.02, (3, 12, 20, 30))
    client.exact()
    studio = client.studio
    version, before = studio.session.version, studio.session.weights.copy()
    for number, values in enumerate(({"hold": 0.0}, {"colors": "white"})):
        assert studio.handle(protocol.Preview(number, values), {})[0].kind == "started"
        preview = client.wait(lambda m, n=number: m.kind == "previewed" and m.fields["number"] == n)
        assert studio.session.version == version + 2 * number
        np.testing.assert_array_equal(studio.session.weights, before)
        assert not preview.fields["is_old"]
        assert re.search("closer to the paint|no closer", preview.fields["text"])
        studio.handle(protocol.ChangeSettings(values), {})
        client.exact()
        mixed = studio.session.views[0].basis.mix(studio.session.weights)
        display = picture_table.display_thumbnail(mixed, studio.session.transform)
        np.testing.assert_array_equal(preview.arrays["after"], display)
        assert (preview.arrays["after"] != preview.arrays["before"]).any()
        studio.handle(protocol.Undo(), {})
        if not number:
            client.exact()
    with pytest.raises(lp.LightpaintError, match="nothing is called 'holds'"):
        studio.handle(protocol.Preview(9, {"holds": 1}), {})


@pytest.mark.nightly
def test_letting_go_gradually_is_judged_on_the_whole_picture(client: StudioClient):
    """The offered hold gives the ΔE that it promises, and changes the rest less than no hold does.

    From a hold above the usual one, as a weaker one here changes the rest more than it gains.
    """
    client.studio.handle(protocol.ChangeSettings({"hold": 2 * DEFAULT_HOLD}), {})
    client.paint(1, 1.2, (0, 15, 0, 10))
    answer = client.exact()
    advised = answer.fields["help"]
    assert advised is not None
    assert advised["kind"] == "hold"
    assert 0 < advised["hold"] < 3
    [preview] = [
        client.wait(lambda m: m.kind == "previewed" and m.fields["number"] == 1)
        for _ in client.studio.handle(protocol.Preview(1, {"hold": advised["hold"]}), {})
    ]
    now, then = advised["delta_e"]
    numbers = f"(mean ΔE {spoken_amount(then)} instead of {spoken_amount(now)})"
    assert preview.fields["text"].startswith(f"Comes closer to the paint {numbers}")
    changed = []
    for hold in (advised["hold"], 0.0):
        client.studio.handle(protocol.ChangeSettings({"hold": hold}), {})
        client.exact()
        session = client.studio.session
        view = session.views[0]
        look, mixed = (view.basis.mix(x) for x in (view.basis.current_weights, session.weights))
        changed.append(np.abs(look - mixed)[view.importance == 0].mean())
    assert changed[0] < changed[1]


def test_without_a_scene_there_is_nothing_to_render(client: StudioClient):
    with pytest.raises(lp.LightpaintError, match="no scene to render"):
        client.studio.handle(protocol.Verify(), {})
    with pytest.raises(lp.LightpaintError, match="no picture"):
        client.studio.resource("../secret")


class EndlessVerification:
    """Stands for the verifying render: it goes on for as long as it is wanted."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.views: list[str] = []  # of those that have begun
        self.at_work = self.most = 0
        self.is_enough = threading.Event()
        monkeypatch.setattr(session_exports, "render_verification", self.render_verification)

    def render_verification(self, subject: Subject, basis: lp.Basis, _: Any, progress: Any) -> Any:
        self.views.append(subject.source)
        self.at_work += 1
        self.most = max(self.most, self.at_work)
        try:
            while not self.is_enough.wait(0.01):
                progress("verify", 1, 4)
        finally:
            self.at_work -= 1
        return np.zeros((*basis.size, 3), np.float32), "Rendered again: equal within noise.", True


@pytest.fixture
def studio_of_scenes(
    basis: lp.Basis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[StudioClient, EndlessVerification]]:
    """A studio of two views, and what stands for their renders."""
    side = replace(basis, origin=replace(basis.origin, sensor="side"))
    scene: Any = SimpleNamespace(spp=4)
    verification = EndlessVerification(monkeypatch)
    client = StudioClient(tmp_path, basis, side, scene=scene)
    yield client, verification
    verification.is_enough.set()
    client.studio.close()


def is_stopped(message: Message) -> bool:
    """Whether it says that a render has been stopped."""
    return message.kind == "stopped" and message.fields["task"] == "verify"


def test_a_verifying_render_can_be_stopped(
    studio_of_scenes: tuple[StudioClient, EndlessVerification],
):
    client, renders = studio_of_scenes
    client.studio.handle(protocol.Verify(), {})
    client.wait(lambda m: m.kind == "progress" and m.fields["task"] == "verify")
    [message] = client.studio.handle(protocol.Verify(run=False), {})
    assert (message.kind, message.fields["task"]) == ("started", "stop")
    client.wait(is_stopped)
    assert renders.at_work == 0
    # And there can be another.
    client.studio.handle(protocol.Verify(view=1), {})
    renders.is_enough.set()
    assert client.wait(lambda m: m.kind == "verified").fields["view"] == 1
    assert client.studio.resource("verified@1").shape == (*SIZE, 3)
    # A page that begins anew is told of it, and whether the answer is another one since.
    about = {"agrees": True, "text": "Rendered again: equal within noise.", "view": 1}
    assert client.studio.state().fields["verifications"] == [about | {"is_old": False}]
    client.paint(1, 0.8)
    assert client.studio.state().fields["verifications"] == [about | {"is_old": True}]


@pytest.mark.usefixtures("without_reasons")
def test_a_render_that_is_stopped_before_it_begins_does_not_begin(
    studio_of_scenes: tuple[StudioClient, EndlessVerification], monkeypatch: pytest.MonkeyPatch
):
    """The exact answer comes first, and may take longer than somebody waits."""
    client, renders = studio_of_scenes
    client.paint(1, 0.8)
    client.exact()
    has_begun, release = threading.Event(), threading.Event()
    solution = SessionSnapshot.solution

    def slow(snapshot: SessionSnapshot) -> Any:
        has_begun.set()
        release.wait(PATIENCE_S)
        return solution(snapshot)

    monkeypatch.setattr(SessionSnapshot, "solution", slow)
    client.studio.handle(protocol.Verify(), {})
    assert has_begun.wait(PATIENCE_S)
    client.studio.handle(protocol.Verify(run=False), {})
    release.set()
    client.wait(is_stopped)
    assert not renders.views


def test_who_verifies_again_stops_the_render_before(
    studio_of_scenes: tuple[StudioClient, EndlessVerification],
):
    """Somebody has painted on, or come back with another page."""
    client, renders = studio_of_scenes
    client.studio.handle(protocol.Verify(), {})
    client.wait(lambda _: renders.at_work)
    for view in (0, 1):
        client.studio.handle(protocol.Verify(view=view), {})
    client.wait(lambda _: renders.views[-1] == "view 1")
    renders.is_enough.set()
    assert client.wait(lambda m: m.kind == "verified").fields["view"] == 1
    assert renders.most == 1
    # The page was not told that nothing is rendered while the last one was still to come.
    assert not any(is_stopped(message) for message in client.messages)


@pytest.mark.usefixtures("without_reasons")
def test_what_is_painted_while_an_answer_is_sought_is_answered_too(
    client: StudioClient, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    has_begun, release = threading.Event(), threading.Event()
    solution = SessionSnapshot.solution

    def slow(snapshot: SessionSnapshot) -> Any:
        if threading.current_thread().name == "lightpaint-export":
            has_begun.set()
        release.wait(PATIENCE_S)
        return solution(snapshot)

    monkeypatch.setattr(SessionSnapshot, "solution", slow)
    client.paint(1, 0.8)
    client.studio.handle(protocol.Export(("target", "lighting")), {})
    assert has_begun.wait(PATIENCE_S)
    painted = client.studio.session.views[0].image.copy()
    answer = client.paint(2, 0.1, (3, 12, 16, 30))
    assert answer.fields["stroke"] == 2  # at once
    release.set()
    exact = client.exact()
    np.testing.assert_array_equal(exact.arrays["weights"], client.studio.session.weights)
    client.wait(lambda m: m.kind == "exported")
    painting = lp.read_target(tmp_path / "painting.exr")
    np.testing.assert_allclose(painting.image[10, 20], painted[10, 20], rtol=1e-3)


@pytest.fixture
def two_bases(basis: lp.Basis) -> list[lp.Basis]:
    """The same lights, from another place, too."""
    part = {
        "planes": np.ascontiguousarray(basis.images[:, 2:12, 4:20]),
        "noise": np.ascontiguousarray(basis.half_differences[:, 2:12, 4:20]),
        "emitters_seen": basis.emitters_seen[2:12, 4:20],
    }
    return [basis, replace(basis, **part, origin=replace(basis.origin, sensor="side"))]


@pytest.mark.nightly
@pytest.mark.usefixtures("without_reasons")
def test_several_views_are_painted_kept_and_exported(two_bases: list[lp.Basis], tmp_path: Path):
    client = StudioClient(tmp_path, *two_bases)
    studio = client.studio
    names = [basis.origin.sensor for basis in two_bases]
    state = studio.state().fields
    assert [view["name"] for view in state["views"]] == names
    assert [view["size"] for view in state["views"]] == [list(basis.size) for basis in two_bases]
    assert studio.resource("plane/2@1").shape == (10, 16, 3)
    client.paint(1, 0.8)
    assert client.exact().fields["closeness"][0]["delta_e"] >= 0
    client.paint(2, 0.1, (1, 6, 2, 9), view=1)
    exact = client.exact()
    assert [one["delta_e"] >= 0 for one in exact.fields["closeness"]] == [True, True]
    assert exact.fields["delta_e"] == max(one["delta_e"] for one in exact.fields["closeness"])
    for shares in exact.fields["shares"]:
        assert sum(shares) == pytest.approx(1)
    [looks] = studio.handle(protocol.SaveLook("two"), {})
    studio.handle(protocol.Undo(), {})
    assert not studio.session.views[1].is_painted
    messages = studio.handle(protocol.LoadLook(looks.fields["looks"][0]["id"]), {})
    assert [message.fields["view"] for message in messages] == [0, 1]
    assert studio.resource("look/1@1").dtype == np.uint8
    exact_again = client.exact()
    np.testing.assert_allclose(exact_again.arrays["weights"], exact.arrays["weights"], rtol=1e-9)
    studio.handle(protocol.Explain(1), {})
    assert client.wait(lambda m: m.kind == "explained").fields["view"] == 1
    assert studio.resource("beyond@1").shape == (10, 16)
    studio.handle(protocol.Export(("target", "picture", "lighting")), {})
    exported = client.wait(lambda m: m.kind == "exported").fields
    files = [tmp_path / f"painting-{name}.exr" for name in names]
    pictures = [tmp_path / f"answer-{name}.png" for name in names]
    assert exported["files"] == [*map(str, files + pictures), str(tmp_path / "lighting.json")]
    assert [lp.read_target(path).image.shape[:2] for path in pictures] == [
        x.size for x in two_bases
    ]
    targets = [f"--target {name}={file}" for name, file in zip(names, files, strict=True)]
    assert " ".join(targets) in exported["command"]
    solution = correct_noise(lp.solve(two_bases, [lp.read_target(file) for file in files]))
    np.testing.assert_allclose(solution.weights, exact.arrays["weights"], rtol=1e-9)
    studio.handle(protocol.Export(("report",)), {})
    notice = client.wait(lambda m: m.kind == "notice" and "needs their scene" in m.fields["text"])
    assert notice.fields["task"] == "export"
    with pytest.raises(lp.LightpaintError, match="no view 2"):
        studio.handle(protocol.Explain(2), {})
    studio.close()


def test_a_view_that_comes_later_finds_the_session(two_bases: list[lp.Basis], tmp_path: Path):
    client = StudioClient(tmp_path, two_bases[0])
    client.paint(1, 0.8)
    client.studio.handle(protocol.SaveLook("alone"), {})
    painted = client.studio.session.views[0].image.copy()
    client.studio.close()
    client = StudioClient(tmp_path, *two_bases)
    studio = client.studio
    client.paint(2, 0.1, (1, 6, 2, 9), view=1)
    client.paint(3, 0.4, (0, 6, 2, 9))
    undo_labels = studio.state().fields["history"]["undo"]
    assert undo_labels == [f"stroke, {name}" for name in ("sensor", "side", "sensor")]
    # The look knows nothing of the view, and leaves it as it was before it was painted.
    studio.handle(protocol.LoadLook(1), {})
    np.testing.assert_array_equal(studio.session.views[0].image, painted)
    assert [view.is_painted for view in studio.session.views] == [True, False]
    [looks] = studio.handle(protocol.SaveLook("both"), {})
    [looks] = studio.handle(protocol.MixLooks(1, 2, 0.5, "between"), {})
    assert len(looks.fields["looks"]) == 3
    studio.handle(protocol.DropLook(2), {})
    with pytest.raises(lp.LightpaintError, match="no picture"):
        studio.resource("look/2@1")
    studio.close()


def test_a_render_that_fails_is_said_to_who_waits(tmp_path: Path):
    class Broken(Subject):
        def bases(self, progress: Any = None) -> Any:
            progress("lights", 1, 4)
            raise ZeroDivisionError("of our own")
            yield

    messages: list[Message] = []
    studio = Studio([Broken("room.xml", tmp_path)], lambda _: Store.open(tmp_path / "x.db", _))
    studio.on_message = messages.append
    studio._obtain_bases()
    assert messages[0].fields["done"] == studio.state().fields["progress"]["done"] == 1
    assert messages[-1].kind == "waiting"
    assert "ZeroDivisionError: of our own" in messages[-1].fields["text"]


@pytest.mark.usefixtures("without_reasons")
def test_a_render_that_comes_after_another_stroke_is_of_an_earlier_answer(
    studio_of_scenes: tuple[StudioClient, EndlessVerification],
):
    client, renders = studio_of_scenes
    client.paint(1, 0.8)
    client.exact()
    client.studio.handle(protocol.Verify(), {})
    client.wait(lambda m: m.kind == "progress" and m.fields["task"] == "verify")
    client.paint(2, 0.3)
    renders.is_enough.set()
    assert client.wait(lambda m: m.kind == "verified").fields["is_old"] is True
    [verification] = client.studio.state().fields["verifications"]
    assert verification["is_old"] is True


@pytest.mark.usefixtures("without_reasons")
def test_planes_of_many_lights_reach_a_page_reduced(
    basis: lp.Basis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And so do denoised ones, while the answer is that of all pixels."""
    monkeypatch.setattr(picture_table, "MAX_PAGE_VALUES", 3 * SIZE[0] * SIZE[1] // 4)
    monkeypatch.setattr(picture_table, "MAX_OPENING_VALUES", 0)
    client = StudioClient(tmp_path, basis)
    try:
        state = client.wait(lambda m: m.kind == "state")
        [view] = state.fields["views"]
        assert tuple(view["plane_size"]) == (SIZE[0] // 2, SIZE[1] // 2)
        assert tuple(view["size"]) == SIZE
        for k, scale in enumerate(view["scales"]):
            plane = client.studio.resource(f"plane/{k}").astype(np.float32) * scale
            blocks = basis.planes.plane(k).reshape(SIZE[0] // 2, 2, SIZE[1] // 2, 2, 3)
            # Halves have eleven bits.
            np.testing.assert_allclose(plane, blocks.mean(axis=(1, 3)), rtol=2.0**-11, atol=1e-7)
        client.wait(lambda m: m.kind == "renewed" and "clean/2" in m.fields["resources"])
        assert client.studio.resource("clean/2").shape == (SIZE[0] // 2, SIZE[1] // 2, 3)
        assert client.studio.resource("present").shape == (*SIZE, 3)
        client.paint(1, 0.8)
        client.exact()
        expected = client.studio.session.snapshot().solution().weights
        np.testing.assert_array_equal(client.studio.session.weights, expected)
    finally:
        client.studio.close()


def test_the_scales_of_planes_are_found_once(
    basis: lp.Basis, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every state has them, of all lights."""
    found = []
    monkeypatch.setattr(picture_table, "scale_of", lambda plane: found.append(1) or 2.0)
    assert [picture_table.plane_scale(basis, k) for k in (0, 1, 2, 3, 0)] == [2, 2, 2, 1, 2]
    assert len(found) == len(basis.lights)


def test_a_page_of_very_many_planes_opens_before_kept_ones_are_looked_for(
    basis: lp.Basis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(picture_table, "MAX_OPENING_VALUES", 0)
    clean = DenoisedPlanes(
        (2 * basis.images).astype(np.float16), np.ones(len(basis.lights)), basis.current_look
    )
    assert cache_denoised_planes(basis, clean)
    client = StudioClient(tmp_path, basis)
    try:
        first = client.wait(lambda m: m.kind == "state").fields["resources"]
        assert "plane/0" in first
        assert "clean/0" not in first
        client.wait(lambda m: m.kind == "renewed" and "clean/2" in m.fields["resources"])
        for k in range(len(basis.lights)):
            np.testing.assert_array_equal(client.studio.resource(f"clean/{k}"), clean.halves[k])
    finally:
        client.studio.close()
