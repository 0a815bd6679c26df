"""Public names with arguments of wrong kinds: one line of a LightpaintError, for every one."""

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from batches import small_basis
from renderer import write_room

import lightpaint as lp
from lightpaint.keywords import keywords

#: Values of kinds that few arguments have. Numbers that a render takes are not among them.
WRONG: tuple[Any, ...] = (
    *(None, -1, float("nan"), 10**12, True, "no such thing", b"x", [], {}, {"a": 1}, (1, 2, 3)),
    *(np.zeros((2, 2)), object(), Path("none"), lp.Fit(), lp.Constraints(), int, lambda: 0),
)

#: Names that are not called here: they only start a renderer, or need a notebook.
LEFT_OUT = ("LightpaintError", "use_variant", "__version__")


@pytest.fixture(scope="module")
def values(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Right values of arguments, by their names."""
    basis = small_basis()
    target = lp.Target.of(basis.images.sum(axis=0))
    solution = lp.solve(basis, target)
    scene = lp.load_scene(write_room(tmp_path_factory.mktemp("room")))
    return {
        "basis": basis,
        "target": target,
        "solution": solution,
        "problem": solution.problem,
        "lighting": solution.lighting,
        "scene": scene,
    }


def refuse(call: Callable[..., Any], *args: Any, **options: Any) -> None:
    """Call, and check that an error is one line of ours; a value may also be taken."""
    texts: list[str] = []
    try:
        call(*args, **options)
    except lp.LightpaintError as error:
        texts.append(str(error))
    assert not any("\n" in text for text in texts)


def required(call: Callable[..., Any]) -> list[str]:
    parameters = inspect.signature(call).parameters.values()
    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
    return [x.name for x in parameters if x.kind is kind and x.default is x.empty]


@pytest.mark.parametrize("name", sorted(set(lp.__all__) - set(LEFT_OUT)))
def test_arguments_of_other_kinds_are_one_line(
    name: str, values: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    call, others = getattr(lp, name), list(values.values())
    names = required(call)
    for wrong in (*WRONG, *others):
        if names:
            refuse(call, *[wrong] * len(names))
    if names and all(x in values for x in names):
        right = [values[x] for x in names]
        for k in range(len(names)):
            for wrong in (*WRONG, *others[:k], *others[k + 1 :]):
                if wrong is not right[k]:
                    refuse(call, *right[:k], wrong, *right[k + 1 :])


def test_methods_take_arguments_of_other_kinds_alike(values: dict[str, Any]) -> None:
    target, lighting = values["target"], values["solution"].lighting
    for method in (target.cropped, target.reduced, target.fitted_to, lighting.with_emission):
        for wrong in (None, "no such thing", {}, object()):
            with pytest.raises(lp.LightpaintError):
                method(*[wrong] * len(required(method)))


def test_methods_of_public_classes_explain_their_arguments(values: dict[str, Any]) -> None:
    """Every public method of what a day's work passes around."""
    raw = []
    prediction = lp.combine(values["basis"], values["lighting"])
    for owner in (values["basis"], values["target"], values["lighting"], prediction):
        for name in sorted(vars(type(owner))):
            method = getattr(owner, name, None)
            if name.startswith("_") or not callable(method) or not required(method):
                continue
            for wrong in (None, -1, float("nan"), "no such thing", {}, [], object()):
                try:
                    refuse(method, *[wrong] * len(required(method)))
                except Exception as error:
                    raw.append(f"{type(owner).__name__}.{name}({wrong!r}): {error!r}")
    assert raw == []


def test_what_is_wrong_is_named(values: dict[str, Any], tmp_path: Path) -> None:
    basis, lighting, scene = (values[x] for x in ("basis", "lighting", "scene"))
    target = values["target"]
    cases: list[tuple[Callable[[], Any], str]] = [
        (lambda: lp.write_basis(basis, tmp_path / "a"), r"write_basis\(\): path is a Basis"),
        (lambda: lp.write_lighting(lighting, "a"), r"write_lighting\(\): path is a Lighting"),
        (lambda: lp.solve(basis, None), "the target is a NoneType: give what"),
        (lambda: lp.solve(basis), r"solve\(\) is called wrongly: missing .* 'target'"),
        (lambda: lp.paint_with_light(basis, basis, "a"), "the scene is of type Basis"),
        (lambda: lp.load_scene(scene.path, groups={"a": 5}), "groups is a dict of int, expected"),
        (lambda: lp.Lighting((1, 2)), r"Lighting\(\): lights is a tuple of int, expected a tuple"),
        (lambda: scene.only(5), r"Scene.only\(\): names is 5"),
        (lambda: basis.mix("x"), r"Basis.mix\(\): weights is a str, expected an array"),
        (lambda: basis.mix(np.full((3, 3), np.inf)), "weights that are infinite or no numbers"),
        (lambda: basis.mix(np.full((3, 3), 1e300)), "weights that are complex or beyond"),
        (lambda: basis.mix(np.ones((3, 3), complex)), "weights that are complex or beyond"),  # type: ignore[arg-type]
        (lambda: lp.Constraints("key"), "lights is 'key': expected entries as"),  # type: ignore[arg-type]
        (lambda: basis.predict(np.full((3, 3), np.nan)), "weights that are infinite or no numb"),
        (lambda: basis.on_pixels(np.ones((3, 2)), basis.noise, None), r"images of shape \(3, 2\)"),
        (
            lambda: basis.set_power_and_totals(1.0, 2.0),
            r"power of the shape \(\): expected \(3, 3\)",
        ),
        (lambda: lp.Lighting.of_weights(None, np.ones((3, 3))), "lights is None, expected a Basis"),
        (lambda: lighting[[]], r"no light \[\] in the lighting"),
        (lambda: target.without(np.ones((3, 2), bool)), r"holes of the shape \(3, 2\)"),
        (lambda: target.without(np.ones((8, 12))), "holes of float64: expected True and False"),
        (lambda: scene.load(views=(1, 2)), r"Scene.load\(\): views is a tuple of int"),
        (lambda: scene.while_loaded(len, 5), r"Scene.while_loaded\(\): emission is 5"),
        (lambda: scene.camera(5), "loaded is 5: expected what Scene.load"),
        (lambda: scene.emitted_image("sky"), r"Scene.*emitted_image\(\): emitter is a str"),
        (lambda: scene.relocated(Path("/elsewhere"), Path("/x")), "room.xml is not in /elsewhere"),
        (lambda: lp.Constraints.of(near=np.ones((2, 2))), "near is array"),
        (lambda: basis.mix(np.ones((4, 3))), r"shape \(4, 3\): expected \(3, 3\)"),
        (lambda: basis.predict(np.ones((3, 4))), r"shape \(3, 4\): expected \(3, 3\)"),
        (lambda: lp.Lighting.of_weights(basis, np.ones((3, 2))), r"shape \(3, 2\): expected"),
        (lambda: lp.display_picture(np.ones((2, 2))), r"expected \(height, width, 3\)"),
        (lambda: lp.display_picture(np.ones((2, 2, 3)), zoom=10**7), "zoom is 10000000: expected"),
        (lambda: lp.display_picture(np.ones((2, 2, 3)), stops=10**12), "stops is 1000000000000"),
        (lambda: lp.display_picture(np.full((2, 2, 3), np.nan)), "an image with NaN"),
        (lambda: lp.solve([basis, basis], [target]), "1 targets for bases of 2 views"),
        (lambda: target.reduced(0), "blocks of 0x0 pixels: an image of 12x8 has blocks of 1 to 8"),
        (lambda: target.reduced(10**12), "blocks of 1000000000000x"),
        (lambda: target.resized((0, 5)), "a size of 5x0 pixels"),
        (lambda: target.fitted_to((0, 0), resize=True), "a size of 0x0 pixels"),
        (lambda: target.resized((10**6, 10**6)), "a size of 1000000x1000000 pixels"),
        (lambda: target.resized((1, 2, 3)), r"size is a tuple of int, expected a tuple of whole"),
        (lambda: scene.moved(None), r"Scene.moved\(\): poses is None"),
        (lambda: scene.with_new_emitters(5), r"Scene.with_new_emitters\(\): emitters is 5"),
    ]
    for call, words in cases:
        with pytest.raises(lp.LightpaintError, match=words):
            call()


@pytest.mark.parametrize(
    "options", [{"spp": 10**12}, {"spp": 2.5}, {"spp": -4}, {"seed": -1}, {"until_spp": 10**12}]
)
def test_the_library_has_the_bounds_of_the_command_line(
    values: dict[str, Any], options: dict[str, Any]
) -> None:
    [name] = options
    with pytest.raises(lp.LightpaintError, match=f"{name} is .*: expected a whole number"):
        lp.render_basis(values["scene"], **options)
    if name in ("spp", "seed"):
        prediction = lp.combine(values["basis"], values["solution"].lighting)
        with pytest.raises(lp.LightpaintError, match=f"{name} is .*: expected a whole number"):
            lp.verify(prediction, values["scene"], **options)


@pytest.mark.parametrize("share", [-0.1, 1.1, 2, float("nan")])
def test_a_share_of_the_noise_is_one(values: dict[str, Any], share: float) -> None:
    with pytest.raises(lp.LightpaintError, match=r"share is .*: expected a share"):
        lp.correct_noise(values["solution"], share=share)
    with pytest.raises(lp.LightpaintError, match=r"share is a str"):
        lp.correct_noise(values["solution"], share="much")


def test_a_mistake_inside_is_not_explained_away(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where all arguments are of their kinds, an error stays what it is."""

    @keywords()
    def broken(count: int) -> None:
        raise ValueError("inside")

    with pytest.raises(ValueError, match="inside"):
        broken(3)
    with pytest.raises(lp.LightpaintError, match=r"broken\(\): count is a str, expected a whole"):
        broken("3")
