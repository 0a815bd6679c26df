"""Lights that may move are placed by a solve, verified, and written into the user's text."""

import html
import json
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import run
from nightly import nightly
from renderer import LIGHTS, write_room

import lightpaint as lp
from lightpaint.batch.plan.planner import plan_batch
from lightpaint.errors import BatchError, LightpaintError
from lightpaint.files import write_bytes
from lightpaint.images.estimate import Estimate
from lightpaint.images.formats.exr import write_rgb
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

AIMED = lp.Pose(target=(-0.6, 0, -0.3))


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return load_scene(write_room(tmp_path_factory.mktemp("room")))


@pytest.fixture(scope="module")
def painted(room: Scene) -> lp.Target:
    """The room with its spot aimed elsewhere."""
    goal = lp.render_basis(room.moved({"beam": AIMED}), spp=256, seed=2).current_look
    return lp.Target.of(goal)


@pytest.fixture(scope="module")
def answer(room: Scene, painted: lp.Target, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of an answer for whose sake the spot was turned."""
    folder = tmp_path_factory.mktemp("answers") / "turned"
    rigging = lp.Rigging.of({"beam": {"aim": True}})
    lp.paint_with_light(
        room, painted, folder, rigging=rigging, spp=64, space="linear", hold=0, verify=False
    )
    return folder


def test_a_spot_that_may_turn_is_turned_and_nothing_else_is_rendered_again(
    room: Scene, painted: lp.Target, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Other tests may keep planes of this room that have more samples.
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))
    passes: list[str] = []
    look = lp.paint_with_light(
        room,
        painted,
        tmp_path / "answer",
        rigging=lp.Rigging.of({"beam": {"aim": True}}),
        spp=256,
        space="linear",
        hold=0,
        progress=lambda label, done, total, unit="": passes.append(label),
    )
    assert look.placement is not None
    assert look.analysis is not None
    assert look.analysis.uncertainty is not None
    alone = lp.error_bars(look.solution)
    assert alone is not None
    relative = dict(look.placement.level_errors)["beam"]
    assert min(relative) > 0
    k = look.basis.names.index("beam")
    by_pose = look.solution.weights[k] * relative
    np.testing.assert_allclose(
        look.analysis.uncertainty.scatter[k], np.hypot(alone.scatter[k], by_pose), rtol=1e-9
    )
    [move] = look.placement.moves
    assert move.name == "beam"
    assert look.verification is not None
    assert look.verification.agrees
    site = room.moved({"beam": AIMED}).light("beam").members[0].site
    relit = load_scene(tmp_path / "answer" / "relit.xml")
    assert np.dot(relit.light("beam").members[0].site.direction, site.direction) > np.cos(0.07)
    # The planes of the others are those of the first basis, but for the rounding of its storage.
    first = lp.render_basis(room, spp=256)
    for k, name in enumerate(first.names):
        is_same = np.allclose(look.basis.image(name), first.image(name), rtol=2e-3, atol=1e-5)
        assert is_same == (name != "beam"), (k, name)


def test_the_text_of_the_scene_changes_only_where_the_light_hangs(
    room: Scene, painted: lp.Target, answer: Path, tmp_path: Path
) -> None:
    options = {"spp": 64, "space": "linear", "hold": 0, "verify": False, "report": False}
    lp.paint_with_light(room, painted, tmp_path / "fixed", **options)
    turned_text, fixed = (
        re.sub(r'value="[^"]*"', "", (folder / "relit.xml").read_text())
        for folder in (answer, tmp_path / "fixed")
    )
    without = [re.sub(r"\s*<lookat[^>]*>\s*", "", text) for text in (turned_text, fixed)]
    assert without[0] == without[1]
    assert re.findall("<lookat[^>]*>", turned_text) != re.findall("<lookat[^>]*>", fixed)


def test_no_move_leaves_all_where_it_is(room: Scene, painted: lp.Target, tmp_path: Path) -> None:
    look = lp.paint_with_light(
        room,
        painted,
        tmp_path / "answer",
        rigging=lp.Rigging.of({"beam": {"aim": True}}),
        spp=16,
        move_lights=False,
        verify=False,
        report=False,
    )
    assert look.placement is None


@pytest.mark.usefixtures("short_search")
@pytest.mark.parametrize(
    ("rigging", "count", "words"),
    [
        nightly(lp.Rigging.of({"bulb": {"move": 0.5}}), 1, "no light is moved: "),
        nightly(lp.Rigging.of(new=[{"kind": "point"}]), 1, "no light is added: "),
        nightly(
            lp.Rigging.of({"bulb": {"move": 0.5}}, new=[{"kind": "point"}]), 2, "moved or added: "
        ),
    ],
)
def test_where_nothing_moves_a_second_view_is_advised(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    rigging: lp.Rigging,
    count: int,
    words: str,
) -> None:
    """The room is painted as it is rendered."""
    # Other tests may keep planes of this room that have more samples.
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))
    path = write_room(tmp_path, sensors=SIDE)
    scenes = [load_scene(path, sensor=name) for name in ("camera", "side")[:count]]
    targets = [lp.Target.of(lp.render_basis(x, spp=16).current_look) for x in scenes]
    remarks = _Remarks()
    lp.paint_with_light(
        scenes,
        targets,
        tmp_path / "answer",
        rigging=rigging,
        spp=16,
        space="linear",
        hold=0,
        verify=False,
        report=False,
        progress=remarks,
    )
    [remark] = [x for x in remarks.texts if "no light is" in x]
    assert words in remark
    assert remark.endswith("paint a second view for lights that this one hardly shows") == (
        count == 1
    )


def test_places_need_a_scene(room: Scene, tmp_path: Path) -> None:
    basis = lp.render_basis(room, spp=4)
    with pytest.raises(LightpaintError, match="lights can only move in their scene"):
        lp.paint_with_light(
            None,
            lp.Target.of(basis.current_look),
            tmp_path / "answer",
            basis=basis,
            rigging=lp.Rigging.of({"beam": {"aim": 30}}),
        )


def test_the_lights_file_of_the_scene_lets_lights_move(tmp_path: Path) -> None:
    path = write_room(tmp_path)
    write_bytes(tmp_path / "room.lights.toml", b"[light.beam]\naim = 40\n")
    scene = load_scene(path)
    target = lp.Target.of(lp.render_basis(scene, spp=4).current_look)
    job = lp.Job((scene,), (target,), tmp_path / "answer")
    assert [name for name, _, _ in job.all_rigging.lights] == ["beam"]


def test_a_job_is_sent_with_what_may_move(tmp_path: Path) -> None:
    path = write_room(tmp_path)
    scene = load_scene(path)
    look = lp.render_basis(scene, spp=4).current_look
    write_rgb(tmp_path / "p.exr", look)
    rigging = lp.Rigging.of(
        {"beam": {"aim": 30, "move": {"on": "rail"}}},
        on={"rail": {"line": [[0, 1, 0], [1, 1, 0]]}},
    )
    sources = (lp.SceneFile(str(path)),), (lp.Painting(str(tmp_path / "p.exr")),)
    job = lp.Job(*sources, tmp_path / "out", rigging=rigging)
    reread = lp.Job.from_json(job.to_json())
    assert reread == job
    assert repr(reread.rigging) == repr(rigging)


@pytest.mark.parametrize("space", ["linear", "display"])
def test_what_is_not_painted_is_held_at_the_look_before_the_move(
    room: Scene, tmp_path: Path, space: str
) -> None:
    """A basis with lights elsewhere is solved for the look that was painted over."""
    basis = lp.render_basis(room, spp=64, seed=1)
    moved_basis = lp.render_basis(room.moved({"beam": AIMED}), spp=64, seed=1)
    look, half = basis.current_look, basis.noise.mix(basis.current_weights)
    with_hold = replace(moved_basis, former=Estimate(look, half))
    assert np.array_equal(with_hold.current_look, look)
    importance = np.zeros(basis.size, np.float32)
    importance[:2] = 1
    target = replace(lp.Target.of(look), importance=importance, everything=False)
    far, near = (
        lp.solve(each_basis, target, space=space, hold=4, colors="free")
        for each_basis in (moved_basis, with_hold)
    )

    # Where the look to hold is taken for that of the lights as they hang now, nothing is missed.
    error_far, error_near = (sum(x.certificate.relative_objective) for x in (far, near))
    assert error_far < 1e-6 < 1e-4 < error_near
    if space == "linear":
        is_counted = np.broadcast_to(near.weight > 0, look.shape)
        np.testing.assert_allclose(near.image[is_counted], look[is_counted], rtol=1e-5)


def test_the_report_says_what_moved(answer: Path) -> None:
    numbers = json.loads((answer / "report.json").read_text())["placement"]
    assert [change["name"] for change in numbers["changes"]] == ["beam"]
    assert numbers["missed_after"] < numbers["missed_before"]
    page = (answer / "report.html").read_text()
    assert numbers["changes"][0]["text"] in page
    assert "Plan and elevation" in page


LAMP = lp.NewEmitter("lamp", "point", lp.Pose(position=(0.5, 1.4, 0.6)), emission=(2.0, 1.4, 0.8))


@pytest.mark.nightly
def test_a_missing_lamp_is_added_with_its_constraint_and_written_behind_the_users_text(
    room: Scene, tmp_path: Path
) -> None:
    goal = lp.render_basis(room.with_new_emitters([LAMP]), spp=256, seed=2).current_look
    shares = []

    def listen(label: str, done: int, total: int, unit: str = "passes") -> None:
        if label == "poses":
            shares.append(done / total)

    look = lp.paint_with_light(
        room,
        lp.Target.of(goal),
        tmp_path / "answer",
        rigging=lp.Rigging.of(new=[{"kind": "point", "kelvin": [2000, 6500]}]),
        spp=256,
        space="linear",
        hold=0,
        progress=listen,
    )
    # The judgement, which follows the last step, takes its time as well.
    assert shares == sorted({*shares})
    assert (shares[0], shares[-1]) == (0, 1)
    assert shares[-2] < 0.9
    assert look.placement is not None
    [added] = look.placement.additions
    assert added.name == "new_point"
    assert added.site.position == pytest.approx(LAMP.pose.position, abs=0.1)
    assert look.verification is not None
    assert look.verification.agrees
    setting = look.lighting["new_point"]
    assert setting.constraint == "2000 to 6500 K"
    assert setting.emission == pytest.approx(LAMP.emission, rel=0.2)
    text, own = (tmp_path / "answer" / "relit.xml").read_text(), room.path.read_text()
    assert text.index('id="new_point"') > text.index('id="sky"')
    assert 'id="new_point"' not in own
    # The answer alone brings the lamp into the scene of the file, in which it is not.
    second = lp.relight(room, look.lighting, tmp_path / "again" / "relit.xml")
    assert second.light("new_point").emission == pytest.approx(setting.emission)


#: A second camera of the room.
SIDE = """<sensor type="perspective" id="side"><float name="fov" value="60"/>
    <transform name="to_world"><lookat origin="2.5 1.2 1.5" target="0 0.5 0" up="0 1 0"/>
    </transform><sampler type="independent"/>
    <film type="hdrfilm"><integer name="width" value="24"/>
    <integer name="height" value="20"/></film></sensor>"""


@pytest.mark.nightly
def test_two_views_place_a_light_together(tmp_path: Path) -> None:
    path = write_room(tmp_path, sensors=SIDE)
    scenes = [load_scene(path, sensor=name) for name in ("camera", "side")]
    moved_scenes = [scene.moved({"beam": AIMED}) for scene in scenes]
    targets = [lp.Target.of(lp.render_basis(x, spp=128, seed=2).current_look) for x in moved_scenes]
    looks = lp.paint_with_light(
        scenes,
        targets,
        tmp_path / "answer",
        rigging=lp.Rigging.of({"beam": {"aim": True}}),
        spp=128,
        space="linear",
        hold=0,
        verify=False,
    )
    assert [look.placement.moves[0].name for look in looks if look.placement] == ["beam"] * 2
    relit = load_scene(tmp_path / "answer" / "relit.xml")
    site = moved_scenes[0].light("beam").members[0].site
    assert np.dot(relit.light("beam").members[0].site.direction, site.direction) > np.cos(0.07)
    assert "Plan and elevation" in (tmp_path / "answer" / "side" / "report.html").read_text()


@pytest.mark.parametrize(
    ("new", "words"),
    [
        ({"kind": "point", "on": "shelf"}, "new.on: no rail, surface or shape 'shelf'"),
        ({"like": "sky"}, "'sky' is not one"),
        ({"kind": "spot", "aim": 30}, "aim of new lights is True or left out"),
    ],
)
def test_lights_that_cannot_be_added_say_so_before_a_sample(
    room: Scene, tmp_path: Path, new: dict[str, object], words: str
) -> None:
    target = lp.Target.of(np.ones((*room.size, 3), np.float32))
    with pytest.raises(LightpaintError, match=words):
        lp.Job((room,), (target,), tmp_path / "a", rigging=lp.Rigging.of(new=[new]))


@pytest.mark.nightly
def test_a_suggestion_is_a_turn_with_its_picture_and_the_line_to_paste(
    room: Scene, painted: lp.Target, tmp_path: Path
) -> None:
    look = lp.paint_with_light(
        room,
        painted,
        tmp_path / "answer",
        spp=128,
        space="linear",
        hold=0,
        suggest=1,
        verify=False,
        command="lightpaint solve room.xml p.exr --suggest 1 --spp 128",
    )
    turn = look.move_suggestion
    assert turn is not None
    assert turn.name == "beam"
    assert turn.aim == 5 * np.ceil((turn.turn + 10) / 5)
    assert tomllib.loads(turn.toml) == {"light": {"beam": {"aim": turn.aim}}}
    losses = [float(np.square(x - painted.image).sum()) for x in (turn.without, turn.with_it)]
    assert losses[1] < 0.5 * losses[0]
    page = (tmp_path / "answer" / "report.html").read_text()
    assert turn.toml in html.unescape(page)
    assert json.loads((tmp_path / "answer" / "report.json").read_text())["turn"]["name"] == "beam"


@pytest.mark.nightly
def test_the_suggested_line_gives_the_turn_and_the_gain_that_were_promised(tmp_path: Path) -> None:
    """Two spots point elsewhere in the painting; only one of them is turned by the line."""
    second = LIGHTS["beam"].replace('"beam"', '"second"').replace('x="0.8', 'x="-0.8')
    # They light the same places, so each gains another share if the other one turns, too.
    room = load_scene(write_room(tmp_path, lights=LIGHTS["beam"] + second + LIGHTS["sky"]))
    goal = room.moved({"beam": AIMED, "second": lp.Pose(target=(0.6, 0.9, -1))})
    target = lp.Target.of(lp.render_basis(goal, spp=256, seed=2).current_look)
    options = {"spp": 128, "space": "linear", "hold": 0, "verify": False}
    turn = lp.paint_with_light(
        room, target, tmp_path / "promise", suggest=1, **options
    ).move_suggestion
    assert turn is not None
    rigging = lp.Rigging.of(tomllib.loads(turn.toml)["light"])
    look = lp.paint_with_light(room, target, tmp_path / "turned", rigging=rigging, **options)
    assert look.placement is not None
    [move] = look.placement.moves
    assert move.name == turn.name
    # The same search on the same basis.
    assert move.turn == pytest.approx(turn.turn, abs=1e-6)
    assert move.gain_share == pytest.approx(turn.gain_share, abs=1e-6)


@pytest.mark.nightly
def test_all_views_count_in_what_is_suggested(tmp_path: Path) -> None:
    """The first view is as painted already; the second has its spot turned."""
    path = write_room(tmp_path, sensors=SIDE)
    scenes = [load_scene(path, sensor=name) for name in ("camera", "side")]
    goals = [scenes[0], scenes[1].moved({"beam": AIMED})]
    targets = [lp.Target.of(lp.render_basis(x, spp=128, seed=2).current_look) for x in goals]
    options = {"spp": 128, "space": "linear", "hold": 0, "verify": False, "suggest": 1}
    looks = lp.paint_with_light(scenes, targets, tmp_path / "both", **options)
    assert looks[0].suggestions == looks[1].suggestions
    turns = {look.move_suggestion for look in looks}
    assert len(turns) == 1
    [turn] = turns
    assert turn is not None
    assert turn.name == "beam"
    # The pictures are of the first view.
    for picture in (turn.without, turn.with_it):
        first, second = (float(np.square(picture - x.image).sum()) for x in targets)
        assert first < 0.1 * second
    for name in ("camera", "side"):
        page = (tmp_path / "both" / name / "report.html").read_text()
        assert "All painted views count; the small pictures show camera." in page
    alone = lp.paint_with_light(scenes[0], targets[0], tmp_path / "alone", **options)
    assert alone.move_suggestion is None
    assert "All painted views" not in (tmp_path / "alone" / "report.html").read_text()


def test_sums_alone_are_refused_where_lights_may_move(tmp_path: Path) -> None:
    path = write_room(tmp_path)
    write_bytes(tmp_path / "room.lights.toml", b"[light.beam]\naim = 40\n")
    scene = load_scene(path)
    write_rgb(tmp_path / "p.exr", lp.render_basis(scene, spp=2).current_look)
    look = 'scene = "room.xml"\npainting = "p.exr"\nwant = ["lights"]\n'
    settings = '[look.settings]\nspace = "linear"\nliteral = true\n'
    (tmp_path / "looks.toml").write_text(f"[[look]]\n{look}{settings}")
    with pytest.raises(BatchError, match="lights may move in it, unless move_lights is false"):
        plan_batch(tmp_path / "looks.toml", tmp_path / "out")
    (tmp_path / "looks.toml").write_text(f"[[look]]\n{look}{settings}move_lights = false\n")
    assert not plan_batch(tmp_path / "looks.toml", tmp_path / "out").looks[0].failure


class _Remarks:
    """Progress that keeps the remarks."""

    def __init__(self) -> None:
        self.texts: list[str] = []

    def __call__(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        """Ignore progress."""

    def say(self, text: str) -> None:
        self.texts.append(text)

    def note(self, text: str) -> None:
        """Ignore a stage."""

    def at_work(self, worker: str, task: str | None) -> None:
        """Ignore a worker."""


class _Stop:
    """Progress that is interrupted in the midst of a search."""

    def __call__(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        if label == "poses" and done:
            raise KeyboardInterrupt


@pytest.mark.nightly
def test_an_interrupted_search_leaves_nothing_half_written(room: Scene, tmp_path: Path) -> None:
    small = room.reduced("1/2")
    target = lp.Target.of(lp.render_basis(small.moved({"beam": AIMED}), spp=64).current_look)
    options = {"rigging": lp.Rigging.of({"beam": {"aim": 60}}), "spp": 64, "hold": 0}
    options |= {"space": "linear", "verify": False, "report": False}
    with pytest.raises(KeyboardInterrupt):
        lp.paint_with_light(small, target, tmp_path / "a", **options, progress=_Stop())
    assert not (tmp_path / "a").exists()
    look = lp.paint_with_light(small, target, tmp_path / "a", **options)
    assert look.placement is not None
    assert [move.name for move in look.placement.moves] == ["beam"]


@pytest.mark.nightly
def test_samples_are_added_for_lights_where_they_hang_now(room: Scene, tmp_path: Path) -> None:
    """An error that is asked for is met with the lights moved, by a basis of where they are."""
    small = room.reduced("1/2")
    target = lp.Target.of(lp.render_basis(small.moved({"beam": AIMED}), spp=64).current_look)
    rigging = lp.Rigging.of({"beam": {"aim": 60}})
    options = {"space": "linear", "hold": 0, "verify": False, "report": False, "use_cache": False}
    look = lp.paint_with_light(small, target, tmp_path, rigging=rigging, error=0.1, **options)
    assert look.placement is not None
    assert [move.name for move in look.placement.moves] == ["beam"]
    exact = lp.render_basis(look.placement.scene, spp=512, seed=9)
    beam = look.basis.image("beam")
    assert np.abs(beam - exact.image("beam")).sum() < 0.2 * exact.image("beam").sum()
    lighting = lp.solve(exact, target, space="linear", hold=0).lighting
    assert look.lighting["beam"].emission == pytest.approx(lighting["beam"].emission, rel=0.1)


@pytest.mark.nightly
def test_variations_hang_as_the_look_that_they_vary(room: Scene, tmp_path: Path) -> None:
    small = room.reduced("1/2")
    look_image = lp.render_basis(small.moved({"beam": AIMED}), spp=64).current_look
    for name in ("one", "two"):
        write_rgb(tmp_path / f"{name}.exr", look_image)
        look_image = 0.5 * look_image
    options = ["--aim", "beam=60", "--resolution", "1/2", "--spp", "64", "--literal"]
    options += ["--variations", "fewer-lights,warmer", "--no-verify", "-o", "out"]
    completed = run(tmp_path, "solve", room.path, "one.exr", "two.exr", *options)
    assert completed.returncode == 0, completed.stderr
    assert completed.stderr.count("poses: ") == 2  # a search for each painting
    for name in ("one", "two"):
        folders = [
            tmp_path / "out" / f"{name}{suffix}" for suffix in ("", "-fewer-lights", "-warmer")
        ]
        sites = [load_scene(x / "relit.xml").light("beam").members[0].site for x in folders]
        assert sites[0] == sites[1] == sites[2]
        assert np.dot(sites[0].direction, room.light("beam").members[0].site.direction) < 0.99
