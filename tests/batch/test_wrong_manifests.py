"""Each mistake in a manifest is one clear line that names look and key; nothing is rendered."""

import json
from pathlib import Path

import pytest
from batches import write_batch
from command import run, run_refused
from renderer import write_room

HEAD = '[defaults]\nbasis = "b.basis.exr"\nwant = ["predict"]\n'
LOOK_PARAMETER = '[[look]]\npainting = "p0.exr"\n'
FIRST = HEAD + '[[look]]\nname = "one"\npainting = "p0.exr"\n'
SEQUENCE = FIRST + '[[look]]\nname = "two"\npainting = "p1.exr"\n[[sequence]]\nname = "seq"\n'

#: The manifest, and what its line says.
WRONG: dict[str, tuple[str, tuple[str, ...]]] = {
    "no TOML": ("look = = 3", ("is not TOML", "line 1")),
    "a key that stands twice": (HEAD + 'want = ["solve"]\n', ("is not TOML",)),
    "no look": (HEAD, ("has no look", "[[look]]")),
    "an unknown table": (FIRST + "[loks]\n", ("unknown key 'loks'", "'look'")),
    "looks that are not tables": ("look = 3\n", ("look is 3", "[[look]]")),
    "a look that is not a table": ("look = [3]\n", ("look 1", "not a table")),
    "defaults that are not a table": ("defaults = 1\n" + LOOK_PARAMETER, ("defaults is 1",)),
    "an unknown default": (
        '[defaults]\nscen = "a"\n' + LOOK_PARAMETER,
        ("defaults", "mean 'scene'"),
    ),
    "a painting by default": (
        HEAD + 'painting = "p0.exr"\n' + LOOK_PARAMETER,
        ("defaults", "unknown key 'painting'"),
    ),
    "an unknown key": (FIRST + "masc = 'a'\n", ("look 'one'", "'masc'", "mean 'mask'")),
    "a setting beside the settings": (
        HEAD + "spp = 8\n" + LOOK_PARAMETER,
        ("defaults", "unknown key 'spp': did you mean 'settings.spp'?"),
    ),
    "a painting that is called as on the command line": (
        HEAD + '[[look]]\ntarget = "p0.exr"\n',
        ("unknown key 'target': did you mean 'painting'?",),
    ),
    "a painting that is a number": (HEAD + "[[look]]\npainting = 3\n", ("painting is 3",)),
    "a camera without spectra": (
        FIRST + 'settings = { observer = "alexa" }\n',
        ("look 'one', settings: ", "also pass settings.spectral = true"),
    ),
    "an empty name": (HEAD + LOOK_PARAMETER + 'name = ""\n', ("look 'p0.exr'", "name is ''")),
    "nothing to show": (HEAD + '[[look]]\nname = "a"\n', ("look 'a'", "nothing to show")),
    "painting and lighting": (
        FIRST + 'lighting = "looks.toml"\n',
        ("look 'one'", "painting and lighting at once"),
    ),
    "neither scene nor basis": (LOOK_PARAMETER, ("look 'p0.exr'", "no scene and no basis")),
    "a painting that is not there": (
        HEAD + '[[look]]\npainting = "gone.exr"\n',
        ("look 'gone.exr'", "painting: no such file: gone.exr"),
    ),
    "a pattern that fits nothing": (
        HEAD + '[[look]]\nname = "a"\npaintings = ["q*.exr"]\n',
        ("look 'a'", "no such file: q*.exr"),
    ),
    "no paintings in the list": (HEAD + "[[look]]\npaintings = []\n", ("paintings is []",)),
    "a scene that is not there": (
        '[[look]]\nscene = "s.xml"\npainting = "p0.exr"\n',
        ("scene: no such file: s.xml",),
    ),
    "a basis that is not there": (FIRST + 'basis = "s.exr"\n', ("basis: no such file: s.exr",)),
    "a basis that is none": (FIRST + 'basis = "p1.exr"\n', ("look 'one'", "p1.exr")),
    "a mask that is not there": (FIRST + 'mask = "m.png"\n', ("mask: no such file: m.png",)),
    "a template that is not there": (FIRST + 'template = "t"\n', ("template: no such folder: t",)),
    "a lighting that is not there": (
        HEAD + '[[look]]\nlighting = "l.json"\n',
        ("lighting: no such file: l.json",),
    ),
    "a lighting that is none": (
        HEAD + '[[look]]\nname = "a"\nlighting = "looks.toml"\n',
        ("look 'a'", "is not a JSON file"),
    ),
    "sensor and sensors": (
        FIRST + 'sensor = "a"\nsensors = ["a"]\n',
        ("look 'one'", "sensor and sensors at once"),
    ),
    "a sensor of a basis": (FIRST + 'sensor = "a"\n', ("look 'one'", "sensor", "saved basis")),
    "several sensors of a basis": (
        FIRST + 'sensors = ["a", "b"]\n',
        ("look 'one'", "a basis has only one view"),
    ),
    "a sensor that is a list": (FIRST + "sensor = [1]\n", ("sensor is [1]",)),
    "an unknown step": (FIRST + 'want = ["solved"]\n', ("want is ['solved']", "'predict'")),
    "a step twice": (FIRST + 'want = ["solve", "solve"]\n', ("each once",)),
    "a render without a scene": (FIRST + 'want = ["render"]\n', ("'render'", "needs the scene")),
    "a verification without a scene": (FIRST + 'want = ["verify"]\n', ("needs the scene",)),
    "render that is not wanted": (FIRST + "[look.render]\nspp = 4\n", ("does not have 'render'",)),
    "an unknown setting": (
        FIRST + "[look.settings]\nholds = 1\n",
        ("look 'one', settings", "mean 'hold'"),
    ),
    "a setting of the wrong kind": (
        FIRST + '[look.settings]\nhold = "much"\n',
        ("look 'one', settings", "hold is 'much'", "a weight >= 0"),
    ),
    "settings that contradict": (
        FIRST + "[look.settings]\nhold = 1\nunpainted = 1\n",
        ("look 'one', settings", "unpainted is 1"),
    ),
    "a setting of renders alone": (
        FIRST + "[look.settings]\nspp = 8\n",
        ("look 'one'", "spp", "saved basis"),
    ),
    "an unknown colour choice": (
        FIRST + '[look.settings]\ncolors = "warm"\n',
        ("colors is 'warm'", "'gentle'"),
    ),
    "an unknown constraint": (
        FIRST + "[look.constraints]\nlocks = 1\n",
        ("look 'one', constraints", "'locks'"),
    ),
    "an unknown key of a light": (
        FIRST + '[look.constraints.light."lamp 0"]\nlocked = true\n',
        ("look 'one', constraints", "lamp 0", "locked"),
    ),
    "a light that there is not": (
        FIRST + "[look.constraints.light.sun]\noff = true\n",
        ("look 'one'", "sun"),
    ),
    "a lights file that is not there": (
        FIRST + 'constraints = "c.toml"\n',
        ("look 'one', constraints", "no such lights file", "c.toml"),
    ),
    "constraints that are a list": (FIRST + "constraints = [1]\n", ("constraints is [1]",)),
    "an unknown variation": (
        FIRST + 'variations = ["warm"]\n',
        ("variations is ['warm']", "'warmer'"),
    ),
    "an unknown view": (FIRST + 'view = "acres"\n', ("look 'one'", "acres")),
    "an exposure that is a text": (FIRST + 'exposure = "+1"\n', ("exposure is '+1'", "stops")),
    "an unknown paint": (FIRST + 'paint = "oil"\n', ("paint is 'oil'", "'light'")),
    "a name with a slash": (
        HEAD + LOOK_PARAMETER + 'name = "a/b"\n',
        ("'a/b' cannot be the name of a folder",),
    ),
    "a name twice": (
        FIRST + LOOK_PARAMETER + 'name = "one"\n',
        ("look 'one'", "more than one look"),
    ),
    "a name of the batch's own page": (
        HEAD + LOOK_PARAMETER + 'name = "index.html"\n',
        ("look 'index.html'", "cannot be called 'index.html'"),
    ),
    "a name of the journal": (
        HEAD + LOOK_PARAMETER + 'name = "Journal.JSONL"\n',
        ("a file of the batch itself",),
    ),
    "a name of a summary": (
        HEAD + LOOK_PARAMETER + 'name = "summary.csv"\n',
        ("a file of the batch itself",),
    ),
    "a name of the small pictures": (
        HEAD + LOOK_PARAMETER + 'name = "thumbnails"\n',
        ("look 'thumbnails'", "a file of the batch itself"),
    ),
    "a hidden name": (HEAD + LOOK_PARAMETER + 'name = ".cache"\n', ("a file of the batch itself",)),
    "a name that differs in case": (
        FIRST + LOOK_PARAMETER + 'name = "One"\n',
        ("look 'one' and look 'One'", "'one' and 'One' would be one folder", "case"),
    ),
    "a variation's name twice": (
        FIRST + 'variations = ["warmer"]\n' + LOOK_PARAMETER + 'name = "one-warmer"\n',
        ("look 'one' and look 'one-warmer'", "more than one look"),
    ),
    "a sequence without frames": (
        SEQUENCE + 'through = ["one", "two"]\n',
        ("sequence 'seq'", "frames is missing"),
    ),
    "a sequence of one frame": (
        SEQUENCE + 'through = ["one", "two"]\nframes = 1\n',
        ("sequence 'seq'", "frames is 1", ">= 2"),
    ),
    "a sequence through one look": (
        SEQUENCE + 'through = ["one"]\nframes = 4\n',
        ("through is ['one']", "at least two"),
    ),
    "a sequence through nobody": (
        SEQUENCE + 'through = ["one", "three"]\nframes = 4\n',
        ("sequence 'seq'", "no look is called 'three'"),
    ),
    "a sequence in an unknown space": (
        SEQUENCE + 'through = ["one", "two"]\nframes = 4\nspace = "rgb"\n',
        ("space is 'rgb'", "'oklab'"),
    ),
    "a path through a basis": (
        SEQUENCE + 'through = ["one"]\nsensors = ["a", "b"]\n',
        ("sequence 'seq'", "have no scene"),
    ),
    "lights by sums that stay near a lighting": (
        FIRST + 'want = ["lights"]\nsettings = { literal = true }\nconstraints = { near = 0.1 }\n',
        ("look 'one'", "near depends on the area of the paint", "want 'solve' instead"),
    ),
    "a sequence that is solved": (
        SEQUENCE + 'through = ["one", "two"]\nframes = 4\nwant = ["solve"]\n',
        ("want is ['solve']",),
    ),
}


#: Manifests with several mistakes, and what each line says, in any order: these and no others.
SEVERAL: dict[str, tuple[str, list[str]]] = {
    "misspelt keys hide no wrong values": (
        FIRST + 'masc = "m.png"\nexposure = "+1"\nseting = 1\npaint = "oil"\n',
        ["'masc': did you mean 'mask'", "exposure is '+1'", "'settings'", "paint is 'oil'"],
    ),
    "nor lights that there are not, light by light": (
        FIRST
        + 'masc = "m.png"\n[look.constraints]\nspars = 3\nsparse = -1\n'
        + "[look.constraints.light.sun]\noff = true\n"
        + '[look.constraints.light."lamp 1"]\nofff = true\nkelvin = -5\n'
        + '[look.constraints.light.moon]\ncolor = "3200K"\n',
        [
            *("'masc'", "'spars': did you mean 'sparse'", "sparse is -1", "no light 'sun'"),
            *("'offf'", "temperature of -5 K", "no light 'moon'"),
        ],
    ),
    "nor where the solve starts": (
        FIRST + "[look.constraints]\nnear = -1\nstart.moon = [1, 1, 1]\nstart.sun = [2, 2, 2]\n",
        ["near is -1", "no light 'moon'", "no light 'sun'"],
    ),
    "a wrong light hides no other": (
        FIRST + "[look.constraints.light]\nsun = { off = true }\nmoon = { off = true }\n",
        ["no light 'sun'", "no light 'moon'"],
    ),
    "a missing file hides none, and no name": (
        HEAD + '[[look]]\npainting = "gone.exr"\nmask = "m.png"\nname = "a/b"\nview = "acres"\n',
        ["painting: no such file", "mask: no such file", "'a/b' cannot be the name", "acres"],
    ),
    "defaults with a mistake hide no look's, and are told once": (
        HEAD + "exposre = 1\n[defaults.settings]\nholds = 1\n"
        '[[look]]\npainting = "p0.exr"\npaint = "oil"\n'
        + LOOK_PARAMETER
        + 'name = "summary.csv"\n',
        ["'exposre'", "defaults, settings: unknown key 'holds'", "paint is 'oil'", "summary.csv"],
    ),
    "what a misspelt key stands for is not missing": (
        '[defaults]\nbasiss = "b.basis.exr"\n[[look]]\npaintng = "p0.exr"\n'
        '[[sequence]]\nname = "s"\nthrogh = ["a", "b"]\nframes = 2\n',
        ["mean 'basis'", "mean 'painting'", "mean 'through'"],
    ),
    "a sequence through a look with mistakes, and through nobody": (
        FIRST
        + 'masc = 1\n[[look]]\nname = "two"\npainting = "p1.exr"\n'
        + '[[sequence]]\nname = "s"\nthrough = ["one", "two", "x"]\nframes = 1\nspace = "rgb"\n',
        ["'masc'", "no look is called 'x'", "frames is 1", "space is 'rgb'"],
    ),
    "a render that is not wanted, of unknown words": (
        FIRST + "[look.render]\nsamples = 4\nspp = 1\n",
        ["does not have 'render'", "unknown key 'samples'", "spp is 1"],
    ),
    "a path of one sensor through a basis": (
        SEQUENCE + 'through = ["one"]\nsensors = ["a"]\n',
        ["sensors has one", "have no scene"],
    ),
    "a path of other frames through a basis": (
        SEQUENCE + 'through = ["one"]\nsensors = ["a", "b"]\nframes = 3\n',
        ["3 frames of 2 sensors", "have no scene"],
    ),
}


@pytest.fixture(scope="module")
def batch_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wrong")
    write_batch(folder)
    return folder


def test_there_are_forty() -> None:
    assert len(WRONG) >= 40


@pytest.mark.parametrize("name", WRONG)
def test_it_is_one_line_and_nothing_is_done(batch_folder: Path, name: str) -> None:
    text, message = WRONG[name]
    (batch_folder / "looks.toml").write_text(text, encoding="utf-8")
    line = run_refused(batch_folder, "batch", "looks.toml", "-o", "out")
    assert line.startswith("lightpaint batch: looks.toml")
    for words in message:
        assert words in line


@pytest.mark.parametrize("name", SEVERAL)
def test_several_mistakes_are_told_at_once_and_no_others(batch_folder: Path, name: str) -> None:
    text, message = SEVERAL[name]
    (batch_folder / "looks.toml").write_text(text, encoding="utf-8")
    completed = run(batch_folder, "batch", "looks.toml", "-o", "out")
    assert completed.returncode == 2
    lines = completed.stderr.splitlines()
    for words in message:
        assert any(words in line for line in lines), completed.stderr
    assert len(lines) == len(message), completed.stderr
    assert not (batch_folder / "out").exists()


def test_a_wrong_sensor_is_told_beside_other_mistakes(tmp_path: Path) -> None:
    room, batch = write_room(tmp_path), tmp_path / "sensors"
    batch.mkdir()
    (batch / "p.exr").write_bytes(b"")
    (batch / "looks.toml").write_text(
        f"[defaults]\nscene = {json.dumps(str(room))}\n"
        '[[look]]\nname = "a"\npainting = "p.exr"\nsensors = ["east", "west"]\nmasc = 1\n'
        "[look.constraints.light.comet]\noff = true\n"
        '[[look]]\nname = "b"\npainting = "gone.exr"\nsensor = "north"\n'
        'constraints.light.moon.off = true\nsettings.resolution = "0x4"\n'
    )
    lines = run(batch, "batch", "looks.toml", "-o", "out").stderr.splitlines()
    expected = (
        *("look 'a': unknown key 'masc'", "east", "west", "no light 'comet'"),
        *("look 'b': painting: no such file", "north", "no light 'moon'", "reduced to 0x4"),
    )
    for words in expected:
        assert any(words in line for line in lines), lines
    assert len(lines) == len(expected), lines


def test_all_mistakes_are_told_at_once(batch_folder: Path) -> None:
    looks = '[[look]]\nname = "a"\npainting = "x.exr"\nmask = "y.png"\n'
    looks += '[[look]]\nname = "b"\npainting = "p0.exr"\n[look.settings]\nholds = 1\nseed = -1\n'
    (batch_folder / "looks.toml").write_text(HEAD + looks, encoding="utf-8")
    completed = run(batch_folder, "batch", "looks.toml", "-o", "out")
    assert completed.returncode == 2
    lines = completed.stderr.splitlines()
    assert len(lines) == 4
    assert all(line.startswith("lightpaint batch: looks.toml: look '") for line in lines)
    assert not (batch_folder / "out").exists()


def test_a_manifest_that_is_not_there_and_other_things_of_the_command(batch_folder: Path) -> None:
    assert "no such manifest: gone.toml" in run_refused(batch_folder, "batch", "gone.toml")
    assert "2 manifests" in run_refused(batch_folder, "batch", "a.toml", "b.toml")
    (batch_folder / "looks.toml").write_text(FIRST, encoding="utf-8")
    line = run_refused(batch_folder, "batch", "looks.toml", "--only", "two*", "-o", "out")
    assert "no look matches 'two*': there are one" in line
    (batch_folder / "file").write_text("", encoding="utf-8")
    assert "cannot write into file" in run_refused(
        batch_folder, "batch", "looks.toml", "-o", "file"
    )
    (batch_folder / "file").unlink()
    assert "no painting" in run_refused(batch_folder, "batch", "--init", "p0.exr")
    assert "no such file" in run_refused(batch_folder, "batch", "--init", "s.xml", "p0.exr")
    assert "looks.toml is there" in run_refused(batch_folder, "batch", "--init", "p0.exr", "p1.exr")
