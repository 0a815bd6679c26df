"""What a painting of 8 bits means by its largest code, this or brighter, a session keeps."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nightly import examples

import lightpaint as lp
from lightpaint.basis.light_basis import Origin
from lightpaint.basis.lights import BasisLight
from lightpaint.colour.color import delta_e
from lightpaint.images.formats.exr import ExrPart, write_parts
from lightpaint.paint import protocol
from lightpaint.paint.notebook import widget_arguments
from lightpaint.paint.session.look_library import LookLibrary
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.session.picture_table import PictureTable
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.session_file import MemoryStore, Store
from lightpaint.pipeline.job.settings import Settings
from lightpaint.target.painted_target import write_painting

SIZE = (18, 32)
WHOLE = (0, *SIZE[:1], 0, SIZE[1])
#: A region that a stroke paints, in which most is white.
BRUSH = (2, 9, 3, 12)

LINEAR: dict[str, Any] = {"space": "linear", "colors": "free", "hold": 0.0}


@pytest.fixture(scope="module")
def basis() -> lp.Basis:
    """Two soft lights, of which one is far too bright for 8 bits."""
    return _basis()


def _basis() -> lp.Basis:
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] / SIZE[0]
    places = ((0.3, 0.5, 3.0), (0.6, 1.3, 0.6))
    images = np.stack(
        [
            bright * np.exp(-((y - cy) ** 2 + (x - cx) ** 2) / 0.1)[..., None] * [1, 0.9, 0.7]
            for cy, cx, bright in places
        ]
    ).astype(np.float32)
    lights = [BasisLight(f"lamp {k}", "point", "intensity", "W/sr", (0.5,) * 3) for k in (0, 1)]
    origin = Origin("made", "made", "camera", 0, "separate", (0, 0), (0, 0))
    return lp.Basis(tuple(lights), images, np.zeros_like(images), np.zeros(SIZE, bool), origin)


def _clip(basis: lp.Basis) -> lp.Target:
    """What 8 bits hold of a lighting."""
    light = basis.mix(np.array([[1.5, 1.2, 1.0], [0.4, 0.6, 0.9]]))
    image = np.minimum(light, 1).astype(np.float32)
    importance = np.ones(SIZE, np.float32)
    return lp.Target("clipped", image, importance, everything=False, at_least=image >= 1)


def _session(basis: lp.Basis, store: Store | None = None) -> Session:
    return Session(
        [basis],
        [basis.current_look],
        store or MemoryStore(Identity.of([basis])),
        settings=Settings(**LINEAR),
        transform=lp.ViewTransform(),
    )


def _set(session: Session, target: lp.Target) -> None:
    session.load(*widget_arguments.load_target(session, target))


def _paint(
    session: Session, stroke: int, region: Any, change: Any, *, is_final: bool = True
) -> None:
    """Send a region, as a page that paints in it."""
    image, importance, _ = session.views[0].pixels(region)
    change(image, importance)
    arrays = {"image": image, "importance": importance}
    session.handle(protocol.Paint(stroke, region, is_final), arrays)


def _corner(image: Any, importance: Any) -> None:
    """What a brush does in a region: two rows."""
    image[:2], importance[:2] = 0.25, 1


def _marks(session: Session) -> Any:
    target = session.target()
    assert target is not None
    return np.zeros((*SIZE, 3), bool) if target.at_least is None else target.at_least


def test_the_answer_is_that_of_the_file(basis: lp.Basis):
    target, session = _clip(basis), _session(basis)
    _set(session, target)
    solution = session.snapshot().solution()
    assert solution is not None
    expected = lp.solve(basis, target, **LINEAR).weights
    np.testing.assert_allclose(solution.weights, expected, rtol=1e-9)
    # And not that of a painting which means what it says.
    literal = lp.solve(basis, replace(target, at_least=None), **LINEAR).weights
    assert np.abs(literal / expected - 1).max() > 0.05
    np.testing.assert_allclose(expected[0], [1.5, 1.2, 1.0], rtol=1e-4)


#: Largest mean ΔE between an answer under the brush and the exact one, as for presets.
SAME = 0.5

STOPS = st.floats(-1.5, 2)


def _over_look(basis: lp.Basis, stops: np.ndarray, transform: lp.ViewTransform) -> lp.Target:
    """Return the look in 8 bits, each half changed by some stops in each channel."""
    factors = np.repeat(2.0 ** stops.reshape(1, 2, 3), SIZE[1] // 2, axis=1)
    codes = np.round(255 * np.clip(transform.encode(basis.current_look * factors), 0, 1)) / 255
    return lp.Target(
        "wash",
        transform.decode(codes).astype(np.float32),
        np.ones(SIZE, np.float32),
        everything=False,
        at_least=codes >= 1,
        transform=transform,
        through_view=True,
        over_look=True,
    )


def _live_and_exact(basis: lp.Basis, target: lp.Target, settings: Settings) -> tuple[Any, Any]:
    """The pictures of both answers of a session, as the display of the painting shows them."""
    transform = target.transform or lp.ViewTransform()
    store = MemoryStore(Identity.of([basis]))
    session = Session([basis], [basis.current_look], store, settings=settings, transform=transform)
    _set(session, target)
    for _ in range(8):
        session.live_answer.solve()
    solution = session.snapshot().solution()
    assert solution is not None
    return tuple(
        transform.decode(transform.encode(basis.mix(x))) * 2**transform.stops
        for x in (session.weights, solution.weights)
    )


@settings(max_examples=examples(15, 60), deadline=None)
@given(st.lists(STOPS, min_size=6, max_size=6), st.sampled_from([None, "linear"]))
def test_live_and_exact_answers_to_clipped_paint_are_one_picture(stops: Any, space: Any):
    basis = _basis()
    target = _over_look(basis, np.array(stops), lp.ViewTransform("srgb", 0.0))
    live, exact = _live_and_exact(basis, target, Settings(space=space))
    assert delta_e(live, exact).mean() <= SAME


@pytest.mark.parametrize("space", [None, "linear"])
def test_the_answer_under_the_brush_may_be_brighter_than_eight_bits(basis: lp.Basis, space: Any):
    """Two stops up end at white on most of the picture, and are two stops of the lamps all the
    same."""
    target = _over_look(basis, np.full(6, 2.0), lp.ViewTransform("srgb", 0.0))
    assert target.at_least is not None
    assert target.at_least.mean() > 0.2
    session = Session(
        [basis],
        [basis.current_look],
        MemoryStore(Identity.of([basis])),
        settings=Settings(space=space),
        transform=lp.ViewTransform("srgb", 0.0),
    )
    _set(session, target)
    for _ in range(8):
        session.live_answer.solve()
    np.testing.assert_allclose(session.weights, 4 * basis.current_weights, rtol=0.1)


def test_paint_means_what_it_says_and_what_it_leaves_means_what_it_did(basis: lp.Basis):
    target, session = _clip(basis), _session(basis)
    _set(session, target)
    np.testing.assert_array_equal(_marks(session), target.at_least)
    _paint(session, 1, BRUSH, _corner)
    expected = target.at_least.copy()
    expected[2:4, 3:12] = False
    assert (expected != target.at_least).any()
    np.testing.assert_array_equal(_marks(session), expected)
    session.handle(protocol.Undo(), {})
    np.testing.assert_array_equal(_marks(session), target.at_least)
    session.handle(protocol.Redo(), {})
    np.testing.assert_array_equal(_marks(session), expected)
    # What counts more is the same light.
    _paint(session, 2, WHOLE, lambda _, importance: importance.__imul__(3))
    np.testing.assert_array_equal(_marks(session), expected)
    # Nothing is painted there any more.
    _paint(session, 3, WHOLE, lambda _, importance: importance.__imul__(0))
    assert session.target() is None
    session.handle(protocol.Undo(), {})
    np.testing.assert_array_equal(_marks(session), expected)


def test_a_stroke_may_change_its_mind(basis: lp.Basis):
    """As a straight line does, which is somewhere else with each move."""
    target, session = _clip(basis), _session(basis)
    _set(session, target)
    before = session.views[0].pixels(BRUSH)

    def erase(image: Any, importance: Any) -> None:
        image[...], importance[...] = before.image, before.importance
        image[-1], importance[-1] = 0.25, 1

    _paint(session, 1, BRUSH, _corner, is_final=False)
    assert not _marks(session)[2:4, 3:12].any()
    session.improve([basis], [basis.current_look])  # more samples come meanwhile
    assert not _marks(session)[2:4, 3:12].any()
    _paint(session, 1, BRUSH, erase)
    expected = target.at_least.copy()
    expected[8, 3:12] = False
    np.testing.assert_array_equal(_marks(session), expected)
    _paint(session, 2, BRUSH, _corner, is_final=False)
    session.handle(protocol.DropStroke(2), {})
    np.testing.assert_array_equal(_marks(session), expected)


STROKES = st.lists(
    st.tuples(
        st.sampled_from(["paint", "erase", "undo", "redo", "drop", "improve", "set"]),
        st.tuples(st.integers(0, 17), st.integers(1, 9), st.integers(0, 31), st.integers(1, 16)),
        st.booleans(),
    ),
    max_size=12,
)


@settings(max_examples=examples(20, 60), deadline=None)
@given(STROKES)
def test_any_sequence_is_a_rebuild_and_never_says_it_of_paint(done: Any):
    basis = _basis()
    store = MemoryStore(Identity.of([basis]))
    target, session = _clip(basis), _session(basis, store)
    _set(session, target)
    for stroke, (action, (top, rows, left, columns), is_done) in enumerate(done):
        region = top, min(top + rows, SIZE[0]), left, min(left + columns, SIZE[1])
        try:
            match action:
                case "paint":
                    _paint(session, stroke, region, _corner, is_final=is_done)
                case "erase":
                    erase = lambda _, importance: importance.__imul__(0)  # noqa: E731
                    _paint(session, stroke, region, erase, is_final=is_done)
                case "undo":
                    session.handle(protocol.Undo(), {})
                case "redo":
                    session.handle(protocol.Redo(), {})
                case "drop":
                    session.handle(protocol.DropStroke(stroke), {})
                case "improve":
                    session.improve([basis], [basis.current_look])
                case "set":
                    _set(session, target)
        except lp.LightpaintError:
            pass
    session.handle(protocol.DropStroke(0), {})
    canvas, rebuilt = session.views[0], _session(basis, store).views[0]
    assert canvas.pixels(canvas.full_region).equals(rebuilt.pixels(rebuilt.full_region))
    _, importance, at_least = canvas.pixels(canvas.full_region)
    if at_least is not None:
        assert (importance > 0)[at_least.any(axis=-1)].all()
        assert (canvas.image[at_least] == target.image[at_least]).all()
        assert target.at_least[at_least].all()


def test_it_is_in_files_and_looks(basis: lp.Basis, tmp_path: Path):
    target = _clip(basis)
    with Store.open(tmp_path / "a.db", Identity.of([basis])) as store:
        session = _session(basis, store)
        looks = LookLibrary(session, PictureTable())
        _set(session, target)
        looks.handle(protocol.SaveLook("white"))
        _paint(session, 1, BRUSH, _corner)
        marks = _marks(session)
        looks.handle(protocol.SaveLook("a corner less"))
        write_painting(tmp_path / "a.exr", session.target())
    with Store.open(tmp_path / "a.db", Identity.of([basis])) as store:
        session = _session(basis, store)
        np.testing.assert_array_equal(_marks(session), marks)
        looks = LookLibrary(session, PictureTable())
        first, second = looks.infos()
        looks.load(protocol.LoadLook(first.id))
        np.testing.assert_array_equal(_marks(session), target.at_least)
        looks.handle(protocol.MixLooks(first.id, second.id, 0.5, "between"))
        looks.load(protocol.LoadLook(looks.infos()[-1].id))
        np.testing.assert_array_equal(_marks(session), marks)
    exported_target = lp.read_target(tmp_path / "a.exr")
    np.testing.assert_array_equal(exported_target.at_least, marks)


def test_any_exr_may_say_so(tmp_path: Path):
    light = {c: np.ones((4, 5), np.float32) for c in "RGB"}
    green = np.zeros((4, 5), np.float32)
    green[1, 2:4] = 1
    write_parts(tmp_path / "a.exr", [ExrPart("", light | {"at_least.G": green})])
    target = lp.read_target(tmp_path / "a.exr", find=False)
    assert target.at_least is not None
    assert not target.at_least[..., [0, 2]].any()
    np.testing.assert_array_equal(target.at_least[..., 1], green > 0)


def test_light_below_zero_stays_beside_a_stroke(basis: lp.Basis):
    """As a wide gamut has it, in a target that a cell gave."""
    session, image = _session(basis), np.full((*SIZE, 3), 0.5, np.float32)
    image[..., 2] = -0.1
    _set(session, lp.Target.of(image, np.ones(SIZE)))
    _paint(session, 1, BRUSH, _corner)
    target = session.target()
    assert target is not None
    assert (target.image[2:4, 3:12] == 0.25).all()
    np.testing.assert_array_equal(target.image[4:], image[4:])
    with pytest.raises(lp.LightpaintError, match="light beyond 0"):
        _paint(session, 2, BRUSH, lambda light, _: light.__isub__(1))
