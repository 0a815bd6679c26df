"""All public calls with wrong arguments: each works, or raises one line of a LightpaintError.

Every argument of every name in `lightpaint.__all__`, and of every public method of its classes, is
replaced by values of wrong kinds, shapes and sizes. No scene is rendered: a call that gets as far
as loading one has taken its arguments.
"""

import inspect
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np
import pytest
from batches import small_basis
from light_groups import interleaved, pictures
from nightly import FIFTHS, fifth_of
from renderer import write_room

import lightpaint as lp
from lightpaint.images.formats.exr import write_rgb

#: Values that most arguments do not take, by their names in a failure.
WRONG: Mapping[str, Any] = {
    **{"None": None, "empty text": "", "text": "no such thing", "bytes": b"x", "True": True},
    **{"dict": {"a": 1}, "empty dict": {}, "list": [], "tuple": (1, 2, 3), "object": object()},
    **{"path": Path("none"), "NaN": float("nan"), "inf": float("inf"), "-1": -1, "10^12": 10**12},
    **{"small array": np.ones((3, 2)), "transposed": np.ones((8, 12, 3)).T},
    "array of NaN": np.full((3, 3), np.nan),
}

#: What is no call, and what changes the process.
LEFT_OUT = ("LightpaintError", "use_variant", "__version__")

#: Functions of the caller, which may do what they like.
CALLBACKS = ("progress", "keep", "watch", "is_enough", "work")

#: Calls that load a scene in any case: they check its lights only then.
LOADING = ("Scene.", "load_scene")


class LoadedError(BaseException):
    """Raised where a call would load a scene; no handler of errors catches it."""


class Case(NamedTuple):
    """A call with one wrong argument, or with nothing else."""

    name: str
    call: Callable[..., Any]
    args: list[Any]
    options: dict[str, Any]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("calls")


def instances(folder: Path) -> dict[str, Any]:
    """Return a right value of each argument, by its name; classes by their names in lower case."""
    basis = small_basis()
    target = lp.Target.of(basis.images.sum(axis=0))
    solution = lp.solve(basis, target)
    [analysis] = lp.analyse(solution)
    scene = lp.load_scene(write_room(folder))
    width, height = scene.film.size
    write_rgb(folder / "t.exr", np.ones((height, width, 3), np.float32))
    for file in ("groups", "shot.0001", "shot.0002"):
        planes = zip("abc", pictures(), strict=True)
        interleaved(folder / f"{file}.exr", {f"RGBA_{name}": image for name, image in planes})
    lp.write_lighting(folder / "lighting.json", solution.lighting)
    pose = lp.Pose((0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    scene_file, painting = lp.SceneFile(str(scene.path)), lp.Painting(str(folder / "t.exr"))
    values = {
        "basis": basis,
        "target": target,
        "solution": solution,
        "problem": solution.problem,
        "lighting": solution.lighting,
        "scene": scene,
        "analysis": analysis,
        "appearance": analysis.appearance,
        "diagnosis": analysis.diagnosis,
        "uncertainty": analysis.uncertainty,
        "certificate": solution.lighting.certificate,
        "estimate": lp.combine(basis, solution.lighting),
        "lightgroups": lp.read_light_groups(folder / "groups.exr"),
        "framesequence": lp.find_frames(str(folder / "shot.####.exr")),
        "viewtransform": lp.ViewTransform("agx", 1.0),
        "transformchoice": lp.TransformChoice("agx", 1.0),
        "objects": lp.Objects(np.zeros((8, 12), np.int32), ("a",)),
        "constraints": lp.Constraints.of(sparse=2),
        "fit": lp.Fit(),
        "settings": lp.Settings(),
        "painting": painting,
        "scenefile": scene_file,
        "job": lp.Job((scene_file,), (painting,), folder / "answer"),
        "freedom": lp.Freedom(within=1.0),
        "mirroredpair": lp.MirroredPair(("a", "b")),
        "newlights": lp.NewLights(),
        "rigging": lp.Rigging.of(),
        "pose": pose,
        "newemitter": lp.NewEmitter("n", "point", pose),
    }
    return values | arguments(values, folder) | results(values, folder)


def results(values: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return what calls give that would render, by the names of their classes."""
    scene, basis, emitter = (values[x] for x in ("scene", "basis", "newemitter"))
    picture, place = np.ones((2, 2, 3), np.float32), emitter.site
    up, points = np.array([[0.0, 1, 0]] * 2), np.array([[0.0, 1, 0], [0.5, 1, 0]])
    plane = lp.MeasuringPlane("desk", points, up, 0.5, 0.5, (1, 2), np.array([[0, 0], [0, 1]]))
    move, added = lp.Move("panel", place, place, 0.1), lp.AddedLight(emitter, 0.1)
    lux = np.ones((2, len(basis.lights), 3))
    verification = lp.Verification(
        values["estimate"], np.zeros((8, 12, 3)), 1.0, (0.0, 0.0, 0.0), 0.0, 0.1, 0.1, 0.5, 1.0
    )
    answer = (values[x] for x in ("target", "basis", "solution", "estimate"))
    return {
        "Verification": verification,
        "Look": lp.Look(*answer, scene, verification, values["analysis"]),
        "Move": move,
        "AddedLight": added,
        "Placement": lp.Placement((scene,), (move,), (added,), 0.2, 0.1),
        "Suggestion": lp.Suggestion(
            "n", (0.0, 1.0, 0.0), (1.0, 1.0, 1.0), 0.1, 0.1, "", (0.5, 0.5), picture, picture
        ),
        "MeasuringPlane": plane,
        "Illuminance": lp.Illuminance((plane,), basis.lights, lux, 0 * lux, 179.0),
        "Demo": lp.Demo(folder / "scene.xml", folder / "evening.png", folder / "evening"),
    }


def arguments(values: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return right values of arguments that are no instances of public classes."""
    basis, scene = values["basis"], values["scene"]
    image = basis.images[0]
    return {
        **{"lights": basis, "weights": np.ones((3, 3)), "path": folder / "lighting.json"},
        **{"folder": folder / "out", "image": image, "image_display": image, "look": image},
        **{"importance": np.ones((8, 12)), "name": "lamp 0", "key": "lamp 0", "factor": 2},
        **{"size": (4, 6), "height": 4, "width": 4, "holes": np.zeros((8, 12), bool), "k": 0},
        **{"groups": values["lightgroups"], "mixed": values["estimate"], "frame": 1},
        **{"predicted": values["estimate"], "relit": scene, "verification": None},
        **{"emission": (1.0, 1.0, 1.0), "planes": basis.planes, "noise": basis.noise},
        **{"emitters_seen": np.zeros((8, 12), bool), "bases": basis, "scenes": scene},
        **{"old": folder, "new": folder / "x", "names": ["panel"], "resolution": "1/2"},
        **{"poses": {}, "emitters": [], "emitter": scene.emitters[0], "members": {"a": ["panel"]}},
        **{"work": lambda loaded: None, "a": image, "b": image, "text": "agx", "lamps": {}},
        **{"power": np.ones((3, 3)), "totals": np.ones((3, 3)), "others": lp.Constraints()},
        **{"pattern": str(folder / "shot.####.exr"), "observers": [], "resize": True},
        **{"file": Path("a.0001.exr"), "requests": scene.requests, "part": 0.1, "kind": "point"},
        **{"transform": values["viewtransform"], "fallback": None, "objective": np.ones(3)},
        **{"norm2": np.ones(3), "places": {}, "is_constrained": np.zeros(3, bool)},
        **{"light": values["lighting"]["lamp 0"], "loaded": None},
    }


def found(values: Mapping[str, Any], name: str) -> Any:
    """Return the instance of a class among right values."""
    return values.get(name, values.get(name.lower()))


def public_calls(values: Mapping[str, Any]) -> Iterator[tuple[str, Callable[..., Any], Any]]:
    """Yield the name of each public call, the call, and the right values of its arguments."""
    for name in sorted(set(lp.__all__) - set(LEFT_OUT)):
        call = getattr(lp, name)
        instance, more = found(values, name), {}
        if not inspect.isclass(call):
            yield name, call, values
            continue
        if is_dataclass(call) and type(instance) is call:
            more = {x.name: getattr(instance, x.name) for x in fields(call) if x.init}
        yield name, call, {**values, **more}
        for method in (x for x in dir(call) if not x.startswith("_")):
            static = inspect.getattr_static(call, method)
            if isinstance(static, classmethod | staticmethod):
                yield f"{name}.{method}", getattr(call, method), values
            elif inspect.isfunction(static) and type(instance) is call:
                yield f"{name}.{method}", getattr(instance, method), values


def cases(values: Mapping[str, Any]) -> Iterator[Case]:
    """Yield every call with a wrong value in each place, and in all that it needs."""
    for name, call, right in public_calls(values):
        parameters = inspect.signature(call).parameters.values()
        named = [x for x in parameters if x.kind is x.POSITIONAL_OR_KEYWORD]
        needed = [x.name for x in named if x.default is x.empty]
        others = [x.name for x in parameters if x.default is not x.empty]
        for word, wrong in WRONG.items():
            if not {*needed} & {*CALLBACKS}:
                yield Case(f"{name}(all {word})", call, [wrong] * len(needed), {})
            if not {*needed} <= {*right}:
                continue
            for place in sorted({*needed} - {*CALLBACKS}):
                given = [wrong if x == place else right[x] for x in needed]
                yield Case(f"{name}({place} is {word})", call, given, {})
            for place in sorted({*others} - {*CALLBACKS}):
                yield Case(
                    f"{name}({place} is {word})", call, [right[x] for x in needed], {place: wrong}
                )


def painter_cases(basis: lp.Basis, painter: Any) -> Iterator[Case]:
    """Yield what a cell can do wrong with a painter, new ones of a basis and one that there is."""
    parameters = [*inspect.signature(lp.Painter).parameters, "spp", "colors"]
    for word, wrong in WRONG.items():
        yield Case(f"Painter({word})", paint_and_close, [wrong], {})
        yield Case(f"Painter([{word}])", paint_and_close, [[wrong]], {})
        yield Case(f"Painter(targets {word})", paint_and_close, [basis, [wrong]], {})
        for name in sorted({*parameters} - {"scene", "settings"}):
            yield Case(f"Painter({name} is {word})", paint_and_close, [basis], {name: wrong})
        for name in ("target", "targets", "lighting", "constraints", "height"):
            yield Case(f"Painter.{name} = {word}", setattr, [painter, name, wrong], {})
        yield Case(f"Painter.save(view={word})", painter.save, ["a.exr"], {"view": wrong})
        yield Case(f"Painter.save({word})", painter.save, [wrong], {})
        for call in (painter.observe, painter.unobserve):
            for args in ([wrong], [print, wrong], [print, "target", wrong]):
                yield Case(f"Painter.{call.__name__}({args})", call, args, {})


def paint_and_close(*args: Any, **options: Any) -> None:
    lp.Painter(*args, **options).close()


def complaint(case: Case) -> str:
    """Return what is wrong with the error of a call; "" if it works, or has one line of ours."""

    def load(*args: Any, **options: Any) -> None:
        raise LoadedError

    loader = lp.Scene.load if case.name.startswith(LOADING) else load
    try:
        with warnings.catch_warnings(), patch.object(lp.Scene, "load", loader):
            warnings.simplefilter("error")
            case.call(*case.args, **case.options)
    except LoadedError:
        return ""
    except lp.LightpaintError as error:
        return f"{case.name}: {error!s}" if "\n" in str(error) else ""
    except Exception as error:
        return f"{case.name}: {error!r}"
    return ""


@pytest.mark.parametrize("fifth", FIFTHS)
def test_every_wrong_argument_is_one_line(
    folder: Path, fifth: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    values = instances(folder)
    chosen = fifth_of(cases(values), fifth)
    assert len(chosen) > 2000
    assert [text for case in chosen if (text := complaint(case))] == []
    # No call has left anything in a value that others share.
    assert len(values["basis"].to_dataframe()) == len(values["basis"].names)
    assert len(values["lighting"].to_dataframe()) == len(values["lighting"])
    assert len(values["solution"].to_dataframe()) == len(values["lighting"])


def test_every_wrong_argument_of_a_painter_is_one_line(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("anywidget", reason="the extra `notebook`")
    monkeypatch.chdir(folder)
    basis = small_basis()
    painter = lp.Painter(basis)
    chosen = list(painter_cases(basis, painter))
    assert len(chosen) > 300
    assert [text for case in chosen if (text := complaint(case))] == []
    painter.height = 300
    painter.observe(print, "target")
    painter.unobserve(print, "target")
    assert painter.lighting is not None
    painter.close()


def test_every_public_class_is_among_these(folder: Path) -> None:
    """Also those whose instances only a render gives."""
    values = instances(folder)
    classes = {x for x in lp.__all__ if inspect.isclass(getattr(lp, x))} - {*LEFT_OUT}
    assert {x for x in classes if not isinstance(found(values, x), getattr(lp, x))} == set()
