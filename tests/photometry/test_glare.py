"""Glare against closed forms, the table of CIE 117, and Radiance's evalglare."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from command import run_refused, succeed
from lit_planes import BLACK, floor, write_scene
from radiance import unified_glare_rating
from test_plans import REFLECTANCES, SIZE, write_room
from webs import batwing, cosine, ies_text

from lightpaint.arrays import Doubles, Position
from lightpaint.basis.render.rendered_basis import basis_lights
from lightpaint.errors import SceneError
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.lighting.unknowns.reduction import lamps_by_name
from lightpaint.luminaires.web import Opening
from lightpaint.photometry.glare import Glare, GlareObserver, position_index
from lightpaint.photometry.measure import measure_glare
from lightpaint.photometry.planes_file import read_planes
from lightpaint.scene.scene_reader import load_scene

AHEAD, UP = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)

#: Squares that face the eye at (0, 1, 0): half of the side, middle, and radiance.
SQUARES = ((0.04, (2.0, 1.5, 0.0), 5000.0), (0.08, (3.0, 1.4, -2.0), 2000.0))
EYE = (0.0, 1.0, 0.0)

#: A white sphere around everything, of radiance 10.
SKY = '<emitter type="constant" id="sky"><rgb name="radiance" value="10"/></emitter>'

PLANES = """
[plane.table]
corners = [[0, 0.1, 0], [1, 0.1, 0], [1, 0.1, 1]]
grid = 0.5
"""
OBSERVER = """
[observer.me]
at = [0, 1, 0]
towards = [5, 1, 0]
"""


def square(name: str, half: float, place: tuple[float, float, float], radiance: float) -> str:
    """A black square that shines towards the eye."""
    x, y, z = place
    return (
        f'<shape type="rectangle" id="{name}"><transform name="to_world"><scale value="{half}"/>'
        f'<lookat origin="{x}, {y}, {z}" target="0, 1, 0" up="0, 1, 0"/></transform>{BLACK}'
        f'<emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter></shape>'
    )


def squares() -> str:
    return "".join(square(f"square{k}", *x) for k, x in enumerate(SQUARES))


def glare_of(
    folder: Path, content: str, *, planes: str = PLANES + OBSERVER, **options: object
) -> Glare:
    path = write_scene(folder, content, **options)  # type: ignore[arg-type]
    scene = load_scene(path)
    (folder / "lit.planes.toml").write_text(planes, encoding="utf-8")
    observers = read_planes(folder / "lit.planes.toml", scene).observers
    return measure_glare(scene, observers, use_cache=False)


def towards(place: tuple[float, float, float]) -> Doubles:
    away = np.array(place) - EYE
    return np.asarray(away / np.linalg.norm(away))


def rating_by_hand(background: float) -> float:
    """The UGR of both squares, with the position index as it is written in Levin's paper."""
    total = 0.0
    for half, place, radiance in SQUARES:
        away = np.array(place) - EYE
        angle = (2 * half) ** 2 / float(away @ away)
        sigma = math.degrees(math.acos(away[0] / np.linalg.norm(away)))
        tau = math.degrees(math.atan2(abs(away[2]), away[1]))
        power = (35.2 - 0.31889 * tau - 1.22 * math.exp(-2 * tau / 9)) / 1000 * sigma
        power += (21 + 0.26667 * tau - 0.002963 * tau**2) / 100_000 * sigma**2
        total += radiance**2 * angle / math.exp(power) ** 2
    return 8 * math.log10(0.25 / background * total)


#: What the size of the squares changes in their solid angle and position, in UGR: sixteen times as
#: much for four times the side.
SIZE_OF_SQUARES = 0.02


def test_two_squares_before_an_even_sky_are_rated_as_by_hand(tmp_path: Path) -> None:
    """The sky is the background: L_b is its radiance less what the squares cover, here .1 %."""
    glare = glare_of(tmp_path, squares() + SKY)
    [reading] = glare.readings(glare.background.lights.current_weights).values()
    assert reading.rating is not None
    assert reading.background == pytest.approx(10, rel=0.02)
    assert abs(reading.rating - rating_by_hand(reading.background)) < SIZE_OF_SQUARES
    assert abs(reading.rating - rating_by_hand(10)) < SIZE_OF_SQUARES + 0.09  # 2 % of L_b
    assert reading.strongest == "square0"


def test_a_light_at_half_counts_a_quarter_and_the_sky_counts_once(tmp_path: Path) -> None:
    glare = glare_of(tmp_path, squares() + SKY)
    lights = glare.background.lights
    weights = lights.current_weights.copy()
    first = glare.readings(weights)["me"].rating
    weights[[lights.names.index(f"square{k}") for k in range(2)]] /= 2
    half = glare.readings(weights)["me"].rating
    weights[lights.names.index("sky")] *= 10
    bright = glare.readings(weights)["me"].rating
    assert None not in (first, half, bright)
    assert half == pytest.approx(first - 8 * math.log10(4), abs=1e-9)
    assert bright == pytest.approx(half - 8, abs=1e-9)


def test_a_share_of_a_square_behind_a_box_is_not_seen(tmp_path: Path) -> None:
    """A wall hides one square, and the other one alone is left."""
    wall = (
        '<shape type="rectangle" id="wall"><transform name="to_world"><scale value="0.2"/>'
        '<lookat origin="1, 1.25, 0" target="0, 1, 0" up="0, 1, 0"/></transform>'
        f"{BLACK}</shape>"
    )
    glare = glare_of(tmp_path, squares() + SKY + wall)
    luminance = glare.sources.lit(glare.background.lights.current_weights)
    assert luminance[0].tolist() == pytest.approx([0, SQUARES[1][2]], rel=1e-5)


def test_a_floor_under_a_lamp_is_its_background(tmp_path: Path) -> None:
    """Without a sky, L_b is what the floor reflects; the direct light of the lamp is not in it."""
    up = square("lamp", 0.1, (2.0, 1.5, 0.0), 5000.0)
    glare = glare_of(tmp_path, up + floor(8.0))
    reading = glare.readings(glare.background.lights.current_weights)["me"]
    direct = 5000 * 0.2**2 / 4.25 * (2 / math.sqrt(4.25))
    assert 0 < reading.background * math.pi < 0.5 * direct


def test_the_position_index_is_that_of_the_table_of_cie_117() -> None:
    """Its first row and column are straight above the line of sight and beside it; the formula
    follows the table within some percent (Levin 1975).
    """
    above = {0.0: 1.0, 0.1: 1.26, 0.3: 1.90, 0.5: 2.86, 1.0: 7.0, 1.5: 13.15}
    ratios = np.array([*above])
    directions = np.stack([np.ones(6), ratios, np.zeros(6)], axis=1)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    found = position_index(directions, AHEAD, UP)
    np.testing.assert_allclose(found, [*above.values()], rtol=0.06)
    mirrored = position_index(directions * (1, 1, -1), AHEAD, UP)
    np.testing.assert_allclose(mirrored, found)


def test_the_position_index_is_continuous_ahead_and_rises_outwards() -> None:
    for up in (1.0, -1.0):
        angles = np.radians(np.arange(0, 80, 2.5))
        away = np.stack([np.cos(angles), up * np.sin(angles), np.zeros(len(angles))], axis=1)
        index = position_index(away, AHEAD, UP)
        assert index[0] == pytest.approx(1)
        assert (np.diff(index) > 0).all()


@pytest.mark.parametrize("is_round", [False, True])
def test_an_opening_is_as_large_as_it_looks(is_round: bool) -> None:
    opening = Opening(0.6, 0.3, 0.1, is_round=is_round)
    ends = opening.projected_area(np.array([(0, 0, -1), (1, 0, 0), (0, 1, 0)]))
    below = 0.6 * 0.3 * (math.pi / 4 if is_round else 1)
    np.testing.assert_allclose(ends, [below, 0.3 * 0.1, 0.6 * 0.1])
    slanting = opening.projected_area(np.array([(0, math.sin(1), -math.cos(1))]))
    assert slanting[0] == pytest.approx(below * math.cos(1) + 0.6 * 0.1 * math.sin(1))


def write_lamp(folder: Path, size: float) -> Path:
    """A point luminaire of 1000 cd at (2, 2, 0), which hangs down, of some square size."""
    lamp = '<emitter type="point" id="lamp"><point name="position" x="2" y="2" z="0"/></emitter>'
    path = write_scene(folder, lamp + floor(8.0) + SKY)
    text = ies_text(cosine, gammas=np.arange(0, 90.1, 2.5), sizes=(size, size, 0))
    (folder / "lamp.ies").write_text(text, encoding="ascii")
    (folder / "lit.lights.toml").write_text(
        'cd_per_unit = 1\n[light.lamp]\nphotometry = "lamp.ies"\n', encoding="utf-8"
    )
    (folder / "lit.planes.toml").write_text(PLANES + OBSERVER, encoding="utf-8")
    return path


def test_a_point_luminaire_has_the_luminance_of_its_opening(tmp_path: Path) -> None:
    """1000 cd over the area of a cosine lamp: L is 1000 / area from everywhere."""
    scene = load_scene(write_lamp(tmp_path, 0.2))
    assert scene.light("lamp").plugin == "ies"
    observers = read_planes(tmp_path / "lit.planes.toml", scene).observers
    glare = measure_glare(scene, observers, use_cache=False)
    weights = glare.background.lights.current_weights
    luminance, angle = glare.sources.lit(weights)[0], glare.sources.solid_angle[0]
    assert luminance[0] == pytest.approx(1000 / 0.04, rel=2e-3)  # steps of 2.5 degrees
    assert angle[0] == pytest.approx(0.04 * math.sin(math.atan2(1, 2)) / 5, rel=1e-5)
    reading = glare.readings(weights)["me"]
    index = position_index(towards((2, 2, 0))[None], AHEAD, UP)[0]
    expected = 8 * math.log10(0.25 / reading.background * luminance[0] ** 2 * angle[0] / index**2)
    assert reading.rating == pytest.approx(expected, abs=1e-6)


def test_a_lamp_without_a_size_leaves_it_unknown_until_it_is_off(tmp_path: Path) -> None:
    write_lamp(tmp_path, 0.0)
    printed = succeed(tmp_path, "measure", "lit.xml")
    assert "The UGR of me cannot be told: lamp in sight, of no known size." in printed
    document = json.loads((tmp_path / "measured/planes.json").read_text())["observers"]["me"]
    assert document["ugr"] is None
    assert document["unknown_because"] == "lamp in sight, of no known size"
    scene = load_scene(tmp_path / "lit.xml")
    observers = read_planes(tmp_path / "lit.planes.toml", scene).observers
    glare = measure_glare(scene, observers, use_cache=False)
    weights = glare.background.lights.current_weights.copy()
    weights[glare.background.lights.names.index("lamp")] = 0
    assert glare.readings(weights)["me"].reason == "no lamp is in sight"


def test_with_spectra_the_luminance_is_the_sum_of_those_of_the_emitters(tmp_path: Path) -> None:
    """The weight of an emitter is the luminance of its light, which a square shows as it is."""
    path = write_scene(tmp_path, square("lamp", *SQUARES[0]) + floor(8.0))
    emitters = '{ name = "a", spectrum = "D65", Y = 700 }, { name = "b", spectrum = "A", Y = 300 }'
    toml = f"[light.lamp]\nemitters = [{emitters}]\n"
    (tmp_path / "lit.lights.toml").write_text(toml, encoding="utf-8")
    plain = load_scene(path)
    lamps = lamps_by_name(constraints_of(plain.requests), basis_lights(plain))
    scene = plain.with_lamps(lamps)
    me = GlareObserver("me", EYE, AHEAD, UP)
    glare = measure_glare(scene, [me], error=0.1, use_cache=False)
    assert glare.background.lights.names == ("lamp/a", "lamp/b")
    weights = np.array([[700.0] * 3, [150.0] * 3])
    assert glare.sources.lit(weights)[0, 0] == pytest.approx(850, rel=1e-5)
    assert glare.readings(weights)["me"].rating is not None


def test_who_looks_away_or_stands_in_the_dark_has_no_rating(tmp_path: Path) -> None:
    away = OBSERVER.replace("towards = [5, 1, 0]", "towards = [-5, 1, 0]")
    glare = glare_of(tmp_path, squares() + SKY, planes=PLANES + away)
    assert glare.readings(glare.background.lights.current_weights)["me"].rating is None
    glare = glare_of(tmp_path, squares(), max_depth=2)
    reading = glare.readings(glare.background.lights.current_weights)["me"]
    assert reading.reason == "no light reaches the eye but from the lamps"


def test_the_camera_is_the_observer_unless_the_file_has_some(tmp_path: Path) -> None:
    path = write_scene(tmp_path, squares() + SKY)
    scene, file = load_scene(path), tmp_path / "lit.planes.toml"
    file.write_text(PLANES, encoding="utf-8")
    [camera] = read_planes(file, scene).observers
    assert camera.name == "camera"
    assert camera.place == pytest.approx((0, 1, 2.5))
    down = np.array((0, -0.2, -2.5)) / math.hypot(0.2, 2.5)
    assert camera.ahead == pytest.approx(tuple(down))
    file.write_text(PLANES + OBSERVER + '[observer.too]\nat = "camera"\n', encoding="utf-8")
    me, too = read_planes(file, scene).observers
    assert me == GlareObserver("me", EYE, AHEAD, UP)
    assert (too.name, too.place) == ("too", camera.place)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("at = [0, 1, 0]", "observer.me.towards is None: expected a point"),
        ('at = "door"\ntowards = [0, 1, 0]', 'or at = "camera" alone'),
        ("at = [0, 1, 0]\ntowards = [0, 1, 0]", "looks towards its own place"),
        ("at = [0, 1, 0]\ntowards = [0, 9, 0]", "looks straight up or down"),
        ("at = [0, 1, 0]\nto = [0, 9, 0]", "unknown key 'to'"),
    ],
)
def test_an_observer_who_sees_nothing_definite_is_refused(
    tmp_path: Path, table: str, words: str
) -> None:
    scene, file = load_scene(write_scene(tmp_path, squares())), tmp_path / "lit.planes.toml"
    file.write_text(f"{PLANES}[observer.me]\n{table}\n", encoding="utf-8")
    with pytest.raises(SceneError) as error:
        read_planes(file, scene)
    assert words in str(error.value)


def test_an_observer_inside_of_a_solid_is_named(tmp_path: Path) -> None:
    wall = (
        '<shape type="cube" id="wall"><transform name="to_world"><scale value="0.5"/>'
        f'<translate x="3" y="1"/></transform>{BLACK}</shape>'
    )
    scene, file = load_scene(write_scene(tmp_path, squares() + wall)), tmp_path / "lit.planes.toml"
    file.write_text(f"{PLANES}[observer.me]\nat = [3, 1, 0]\ntowards = [0, 1, 0]\n", "utf-8")
    with pytest.raises(SceneError, match=r"observer\.me is inside of a solid: the eyes at \[3"):
        read_planes(file, scene)
    file.write_text(f"{PLANES}[observer.me]\nat = [4, 1, 0]\ntowards = [0, 1, 0]\n", "utf-8")
    assert len(read_planes(file, scene).observers) == 1


#: Rooms by size and reflectances, with panels (middle, side, luminance), the place of the eyes, and
#: a luminance between those of walls and panels.
ROOMS = [
    (
        SIZE,
        REFLECTANCES,
        (
            ((2.0, 2.5, 2.99), 0.6, 3000.0),
            ((4.5, 2.5, 2.99), 0.6, 3000.0),
            ((4.5, 1.0, 2.99), 0.6, 3000.0),
        ),
        (0.5, 2.0, 1.2),
        1500,
    ),
    pytest.param(
        (9.0, 4.0, 3.4),
        (0.4, 0.3, 0.6),
        (
            ((3.0, 1.0, 3.39), 0.4, 8000.0),
            ((5.0, 3.0, 3.39), 0.4, 8000.0),
            ((7.0, 1.0, 3.39), 0.5, 6000.0),
            ((8.0, 3.0, 3.39), 0.5, 6000.0),
        ),
        (0.6, 2.4, 1.7),
        3000,
        marks=pytest.mark.nightly,
    ),
]
#: Of the pixels of a picture and of Radiance's interpolation between its ambient samples, in UGR.
PIXELS = 0.15


@pytest.mark.parametrize(("size", "reflectances", "panels", "eyes", "threshold"), ROOMS)
def test_evalglare_finds_the_same_rating_in_a_room(
    tmp_path: Path,
    size: Position,
    reflectances: tuple[float, float, float],
    panels: tuple[tuple[Position, float, float], ...],
    eyes: Position,
    threshold: float,
) -> None:
    path = write_room(tmp_path, batwing, size=size, reflectances=reflectances)
    text = path.read_text(encoding="utf-8")
    text = text[: text.index("<emitter")] + "".join(
        f'<shape type="rectangle" id="panel{k}"><transform name="to_world"><rotate x="1" '
        f'angle="180"/><scale x="{side / 2}" y="{side / 2}"/><translate x="{x}" y="{y}" z="{z}"/>'
        f'</transform>{BLACK}<emitter type="area"><rgb name="radiance" value="{luminance}"/>'
        "</emitter></shape>"
        for k, ((x, y, z), side, luminance) in enumerate(panels)
    )
    lit = tmp_path / "lit.xml"
    lit.write_text(text + "</scene>", encoding="utf-8")
    scene = load_scene(lit)
    me = GlareObserver("me", eyes, (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    glare = measure_glare(scene, [me], use_cache=False)
    reading = glare.readings(glare.background.lights.current_weights)["me"]
    expected = unified_glare_rating(
        tmp_path / "radiance",
        size,
        reflectances,
        panels,
        me.place,
        me.ahead,
        pixels=240,
        threshold=threshold,
    )
    assert reading.rating is not None
    assert abs(reading.rating - expected) < PIXELS + 2 * reading.interval


def test_a_plan_has_a_row_for_glare(tmp_path: Path) -> None:
    write_room(tmp_path, batwing)
    file = tmp_path / "lamp.ies"
    file.write_text(file.read_text().replace(" 1 2 0 0 0\n", " 1 2 0.1 0.1 0\n"), "ascii")
    printed = succeed(tmp_path, "plan", "room.xml", "-o", "plan")
    assert "observer  UGR" in printed
    assert "\ncamera " in printed
    numbers = json.loads((tmp_path / "plan/plan.json").read_text())["observers"]["camera"]
    assert 10 < numbers["ugr"] < 40
    assert f"{numbers['ugr']:.1f} ± " in printed
    assert numbers["strongest"].startswith("lamp")
    assert json.loads((tmp_path / "plan/planes/planes.json").read_text())["observers"] == {
        "camera": numbers
    }


def test_an_observer_without_a_place_is_one_line(tmp_path: Path) -> None:
    write_lamp(tmp_path, 0.2)
    (tmp_path / "lit.planes.toml").write_text(PLANES + "[observer.me]\n", encoding="utf-8")
    assert "observer.me.at is None" in run_refused(tmp_path, "measure", "lit.xml")
