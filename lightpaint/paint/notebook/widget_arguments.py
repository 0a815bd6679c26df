"""Arguments and assignments of the notebook's painter, checked and translated for the session."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from contextlib import contextmanager
from dataclasses import fields
from difflib import get_close_matches
from numbers import Integral
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.basis import Basis, LightGroups
from lightpaint.colour import TransformChoice, ViewTransform
from lightpaint.display_text import brief
from lightpaint.errors import KeywordError, LightpaintError, PaintError
from lightpaint.lighting import Constraints, Lighting, resolve_importance
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.store.database import OTHER_FOLDER, START_AFRESH
from lightpaint.paint.store.history_steps import Pixels
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.paint.subject import Subject
from lightpaint.paint.subject_factory import make_subjects
from lightpaint.pipeline.job.settings import Settings
from lightpaint.scene import Scene, load_scene
from lightpaint.sentences import Datum, Remedy
from lightpaint.target import PASS_RESIZE, Target

#: Minimum height of the painter, in pixels of the screen.
MIN_HEIGHT = 240

#: Types that can be painted.
Paintable = Basis | Scene | LightGroups | str | Path

#: Advice in errors for the notebook, by the advice for the library that it replaces.
NOTEBOOK_ADVICE: dict[Remedy, str] = {
    START_AFRESH: "give another file as its store, or give that one another name",
    OTHER_FOLDER: "give another file as its store",
    PASS_RESIZE: "give target.resized((height, width))",
}

#: Arguments of `Studio.load`: paintings by view, requests, and the label of the step.
LoadArguments = tuple[Mapping[int, Pixels], SessionRequests, str]


def load_targets(session: Session, targets: Any) -> LoadArguments:
    """Return the arguments that load paintings, one per view; None leaves a view unpainted.

    Raises LightpaintError.
    """
    fitted = _fit_targets(targets, [view.size for view in session.views])
    paintings = {k: _pixels_to_load(session, k, target) for k, target in enumerate(fitted)}
    return paintings, _requests_for(session.requests, fitted), "paintings from a cell"


def load_target(session: Session, target: Any) -> LoadArguments:
    """Return the arguments that load a painting of the first view. Raises LightpaintError."""
    fitted = _fit_target(target, session.views[0].size, "target")
    requests = _requests_for(session.requests, [fitted])
    return {0: _pixels_to_load(session, 0, fitted)}, requests, "painting from a cell"


def _requests_for(requests: SessionRequests, targets: Sequence[Target | None]) -> SessionRequests:
    """Return `requests` that answer these paintings as `lp.solve` does.

    A painting of light, over nothing, is taken literally. One with display values, painted over
    nothing, does not hold unpainted parts, unless the user has set a hold.
    """
    painted = [target for target in targets if target is not None]
    if not painted:
        return requests
    over_look = any(target.over_look for target in painted)
    on_display = any(target.through_view for target in painted)
    result = requests.with_values({"literal": not (over_look or on_display)})
    if on_display and not over_look and "hold" not in result.values:
        result = result.with_values({"hold": 0.0})
    return result


def check_target_sizes(target: Any, subjects: Sequence[Subject]) -> None:
    """Raise LightpaintError if a target does not fit its view, even before a basis is rendered."""
    sizes = [(subject.basis or subject.loaded_scene).size for subject in subjects]
    if is_per_view(target):
        _fit_targets(target, sizes)
    else:
        _fit_target(target, sizes[0], "target")


def transform_of_targets(target: Any) -> ViewTransform | None:
    """Return the view transform that all targets were painted through; None if they differ."""
    targets = target if is_per_view(target) else [target]
    transforms = {
        one_target.transform
        for one_target in targets
        if isinstance(one_target, Target) and one_target.through_view
    }
    return transforms.pop() if len(transforms) == 1 else None


def is_per_view(target: Any) -> bool:
    """Return whether a value stands for `targets`, and not for the first one alone."""
    return isinstance(target, list | tuple)


def _fit_targets(targets: Any, sizes: Sequence[tuple[int, int]]) -> list[Target | None]:
    if not is_per_view(targets) or len(targets) != len(sizes):
        raise PaintError(
            f"painter.targets is a list of {len(sizes)}, a lp.Target or None for each view"
        )
    return [
        _fit_target(target, size, "targets") for target, size in zip(targets, sizes, strict=True)
    ]


def _fit_target(target: Any, size: tuple[int, int], name: str) -> Target | None:
    if not isinstance(target, Target | None):
        kind = type(target).__name__
        raise PaintError(
            f"painter.{name} is a lp.Target or None, not {kind}{_conversion_hint(target)}"
        )
    with notebook_advice():
        return None if target is None else target.fitted_to(size, resize=False)


def _conversion_hint(value: Any) -> str:
    """Return advice on how to make a target from such a value."""
    if isinstance(value, np.ndarray):
        return ": give lp.Target.of(array)"
    return ": give lp.read_target(path)" if isinstance(value, str | Path) else ""


@contextmanager
def notebook_advice() -> Iterator[None]:
    """Replace the library's advice in errors by that for a painter in a notebook."""
    try:
        yield
    except LightpaintError as error:
        raise type(error)(error.sentence.spelled(_advice)) from None


def _advice(datum: Datum) -> str | None:
    return NOTEBOOK_ADVICE.get(datum) if isinstance(datum, Remedy) else None


def _pixels_to_load(session: Session, view: int, target: Target | None) -> Pixels:
    if target is None:
        return Pixels.unpainted(session.views[view].current)
    canvas = session.views[view]
    return _pixels_of(
        resolve_importance(target, canvas.basis.emitters_seen, session.live_answer.fit.emitters)
    )


def load_lighting(session: Session, lighting: Any) -> LoadArguments:
    """Return the arguments that lock every light at this lighting. Raises LightpaintError."""
    if not isinstance(lighting, Lighting):
        raise PaintError(f"painter.lighting is a lp.Lighting, not {type(lighting).__name__}")
    weights = lighting.weights_for(session.basis)
    lights = {
        light.name: {"lock": weight.tolist()}
        for light, weight in zip(session.basis.lights, weights, strict=True)
        if not light.is_fixed
    }
    requests = SessionRequests(lights, session.requests.ties, session.requests.values)
    return {}, requests, "lighting from a cell"


def load_constraints(session: Session, constraints: Any) -> LoadArguments:
    """Return the arguments that replace all constraints by these. Raises LightpaintError."""
    if not isinstance(constraints, Constraints | None):
        kind = type(constraints).__name__
        raise PaintError(f"painter.constraints is a lp.Constraints or None, not {kind}")
    lights, values = session.basis.lights, session.requests.values
    requests = SessionRequests.from_constraints(
        Constraints() if constraints is None else constraints, lights, values
    )
    return {}, requests.with_master(session.requests.master), "constraints from a cell"


#: Functions that turn a trait's new value into arguments of `Studio.load`.
LOADERS: dict[str, Callable[[Session, Any], LoadArguments]] = {
    "target": load_target,
    "targets": load_targets,
    "lighting": load_lighting,
    "constraints": load_constraints,
}


def same_paintings(new: Sequence[Target | None], old: Sequence[Target | None]) -> bool:
    """Return whether nothing has been painted between two tuples of targets."""
    return len(new) == len(old) and all(map(_is_same_target, new, old))


def _is_same_target(new: Target | None, old: Target | None) -> bool:
    if new is None or old is None:
        return new is old
    return _pixels_of(new).equals(_pixels_of(old))


def _pixels_of(target: Target) -> Pixels:
    return Pixels(target.image, target.importance, target.at_least)


def read_settings(value: Mapping[str, Any], names: Iterable[str]) -> Settings:
    """Return the `Settings` among a painter's keyword arguments; `names` are its other arguments.

    Raises KeywordError for an unknown name, another LightpaintError for an invalid value.
    """
    setting_names = [field.name for field in fields(Settings)]
    for name in value:
        if name not in setting_names:
            raise KeywordError(
                f"lp.Painter has no argument {name!r}{did_you_mean(name, [*names, *setting_names])}"
            )
    return Settings(**value)


def did_you_mean(name: str, names: Iterable[str]) -> str:
    """Return a hint to append to an error about an unknown name; "" if no known name is near."""
    near = get_close_matches(name, names, 1)
    return f": did you mean {near[0]!r}?" if near else ""


def check_observer(
    handler: Any, names: Any, change: Any, known: Sequence[Any], usual: Iterable[str]
) -> None:
    """Raise PaintError for a handler that cannot be called, and for unknown names of traits.

    names: one of `known`, of which the last is for all, or several of them. change: the kind of
    change, or the same last. usual: names that a hint may give.
    """
    if not callable(handler):
        raise PaintError(f"{brief(handler)} cannot observe a painter: expected a function")
    if not isinstance(names, str | list | tuple | Set) and names is not known[-1]:
        raise PaintError(f"names is {brief(names)}: expected a name, or a list of names")
    if not isinstance(change, str) and change is not known[-1]:
        raise PaintError(f"type is {brief(change)}: expected a text, like 'change'")
    for name in [names] if isinstance(names, str) or names is known[-1] else names:
        if name not in known:
            raise PaintError(f"painter.{name} cannot be observed{did_you_mean(str(name), usual)}")


def check_height(height: Any) -> None:
    """Raise PaintError for a height of the painter that is not one."""
    if isinstance(height, bool) or not isinstance(height, Integral) or height < MIN_HEIGHT:
        raise PaintError(
            f"height is {brief(height)}: expected a whole number of pixels from {MIN_HEIGHT} on"
        )


def check_layout(layout: Any, known: Iterable[str]) -> None:
    """Raise PaintError for a dict of a layout with other names than `known`, or another value."""
    if not isinstance(layout, Mapping):
        raise PaintError(f"layout is {brief(layout)}: expected a dict, like {{'width': '50%'}}")
    for name in layout:
        if name not in known:
            raise PaintError(f"layout has no {name!r}{did_you_mean(str(name), known)}")


def widget_subjects(
    value: Paintable | Sequence[Paintable],
    *,
    folder: str | Path | None,
    layers: str | Path | None,
    settings: Settings,
    constraints: Constraints | None,
    transform: ViewTransform | TransformChoice | None,
) -> tuple[Subject, ...]:
    """Return the subjects to paint, one for each view.

    Raises LightpaintError if one cannot be painted.
    """
    if not isinstance(constraints, Constraints | None):
        kind = type(constraints).__name__
        raise PaintError(f"the constraints are a {kind}: give lp.Constraints.of(...)")
    if not isinstance(transform, ViewTransform | TransformChoice | None):
        raise PaintError(
            f"transform is {transform!r}: expected a ViewTransform, like lp.ViewTransform('agx')"
        )
    for name, value_of, example in (
        ("layers", layers, "file, like 'layers.ora'"),
        ("folder", folder, "folder"),
    ):
        if not isinstance(value_of, str | Path | None):
            raise PaintError(f"{name} is {value_of!r}: expected the path of a {example}")
    sources = list(value) if isinstance(value, list | tuple) else [value]
    if not sources:
        raise PaintError("lp.Painter paints at least one view: give a basis, or a scene")
    subjects = make_subjects(
        [_loaded(source) for source in sources],
        None if folder is None else Path(folder).absolute(),
        settings=settings,
        constraints=constraints,
        choice=TransformChoice.of(transform),
        layers=None if layers is None else Path(layers),
    )
    for subject in subjects:
        subject.check_files()
    return subjects


def _loaded(value: Any) -> Basis | Scene | LightGroups:
    """Return the value itself, or the scene at a path. Raises LightpaintError for anything else."""
    if isinstance(value, str | Path):
        if Path(value).suffix.lower() == ".exr":
            raise PaintError(
                f"{value} is not a scene: give lp.read_basis({str(value)!r}) or, of another "
                f"renderer's light groups, lp.read_light_groups({str(value)!r})"
            )
        return load_scene(value)
    if isinstance(value, Basis | Scene | LightGroups):
        return value
    kind = type(value).__name__
    raise PaintError(f"lp.Painter paints a basis, a scene or light groups, not {kind}")
