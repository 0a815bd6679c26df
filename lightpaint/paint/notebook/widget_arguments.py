"""What a cell of a notebook gives to a painter, and sets in it."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.basis.basis import Basis
from lightpaint.basis.lightgroups.read import LightGroups
from lightpaint.colour.display.view_transform import TransformChoice, ViewTransform
from lightpaint.errors import LightpaintError, PaintError
from lightpaint.files import called
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.loss.painting import what_counts
from lightpaint.lighting.views import check_same_lights
from lightpaint.paint.session.session import Session
from lightpaint.paint.session_file import check_together
from lightpaint.paint.store.canvas_pixels import Pixels
from lightpaint.paint.store.database import AFRESH, ELSEWHERE
from lightpaint.paint.store.light_requests import Wishes
from lightpaint.paint.subject import Subject
from lightpaint.pipeline.settings import Settings
from lightpaint.pipeline.sources import check_nothing_idle
from lightpaint.scene.presets import on_film
from lightpaint.scene.scene import Scene, load_scene
from lightpaint.target.target import Target

#: What can be painted.
Paintable = Basis | Scene | LightGroups | str | Path

#: What errors advise who paints in a folder, or solves, and who paints in a notebook.
ADVICE = {
    AFRESH: "give another file as its store, or give that one another name",
    ELSEWHERE: "give another file as its store",
    "pass resize=True": "give target.resized((height, width))",
}

#: Paintings by view, what is asked with them, and what undo calls it.
Loaded = tuple[Mapping[int, Pixels], Wishes, str]


def of_targets(session: Session, targets: Any) -> Loaded:
    """These paintings, one for each view; None leaves a view unpainted. Raises LightpaintError."""
    fitted = _fitted_targets(targets, [view.size for view in session.views])
    paintings = {k: _painting(session, k, one) for k, one in enumerate(fitted)}
    return paintings, _as_painted(session.wishes, fitted), "paintings from a cell"


def of_target(session: Session, target: Any) -> Loaded:
    """This painting of the first view. Raises LightpaintError."""
    fitted = _fitted(target, session.views[0].size, "target")
    wishes = _as_painted(session.wishes, [fitted])
    return {0: _painting(session, 0, fitted)}, wishes, "painting from a cell"


def _as_painted(wishes: Wishes, targets: Sequence[Target | None]) -> Wishes:
    """Return `wishes` that answer these as `lp.solve` does: what follows from how they were made.

    What is light, with nothing under it, is taken at its word; what holds numbers of a display and
    lay over nothing holds nothing else, unless somebody has said how firmly.
    """
    painted = [target for target in targets if target is not None]
    if not painted:
        return wishes
    over_look = any(target.over_look for target in painted)
    on_display = any(target.through_view for target in painted)
    made = wishes.of_answer({"literal": not (over_look or on_display)})
    if on_display and not over_look and "hold" not in made.values:
        made = made.of_answer({"hold": 0.0})
    return made


def check_given(target: Any, subjects: Sequence[Subject]) -> None:
    """Raise LightpaintError for what cannot be painted on, also while its lights are rendered."""
    sizes = [(subject.basis or subject.loaded).size for subject in subjects]
    if is_of_each_view(target):
        _fitted_targets(target, sizes)
    else:
        _fitted(target, sizes[0], "target")


def transform_of_paint(target: Any) -> ViewTransform | None:
    """Return the one view transform that a target, or those of all views, were seen through."""
    targets = target if is_of_each_view(target) else [target]
    seen = {its.transform for its in targets if isinstance(its, Target) and its.through_view}
    return seen.pop() if len(seen) == 1 else None


def is_of_each_view(target: Any) -> bool:
    """Whether it stands for `targets`, and not for the first of them alone."""
    return isinstance(target, list | tuple)


def _fitted_targets(targets: Any, sizes: Sequence[tuple[int, int]]) -> list[Target | None]:
    if not is_of_each_view(targets) or len(targets) != len(sizes):
        raise PaintError(
            f"painter.targets is a list of {len(sizes)}, a lp.Target or None for each view"
        )
    return [_fitted(one, size, "targets") for one, size in zip(targets, sizes, strict=True)]


def _fitted(target: Any, size: tuple[int, int], name: str) -> Target | None:
    if not isinstance(target, Target | None):
        kind = type(target).__name__
        raise PaintError(f"painter.{name} is a lp.Target or None, not {kind}{_made_of(target)}")
    with in_a_notebook():
        return None if target is None else target.fitted_to(size, resize=False)


def _made_of(given: Any) -> str:
    """How a target is made of that."""
    if isinstance(given, np.ndarray):
        return ": give lp.Target.of(array)"
    return ": give lp.read_target(path)" if isinstance(given, str | Path) else ""


@contextmanager
def in_a_notebook() -> Iterator[None]:
    """What an error advises, in arguments that a painter has."""
    try:
        yield
    except LightpaintError as error:
        text = str(error)
        for elsewhere, here in ADVICE.items():
            text = text.replace(elsewhere, here)
        raise type(error)(text) from None


def _painting(session: Session, view: int, target: Target | None) -> Pixels:
    if target is None:
        return Pixels.unpainted(session.views[view].present)
    its = session.views[view]
    return _pixels_of(what_counts(target, its.basis.emitters_seen, session.answering.fit.emitters))


def of_lighting(session: Session, lighting: Any) -> Loaded:
    """Every light held there. Raises LightpaintError."""
    if not isinstance(lighting, Lighting):
        raise PaintError(f"painter.lighting is a lp.Lighting, not {type(lighting).__name__}")
    weights = lighting.weights_for(session.basis)
    lights = {
        light.name: {"lock": weight.tolist()}
        for light, weight in zip(session.basis.lights, weights, strict=True)
        if not light.is_fixed
    }
    wishes = Wishes(lights, session.wishes.ties, session.wishes.values)
    return {}, wishes, "lighting from a cell"


def of_constraints(session: Session, constraints: Any) -> Loaded:
    """This asked, and nothing else. Raises LightpaintError."""
    if not isinstance(constraints, Constraints | None):
        kind = type(constraints).__name__
        raise PaintError(f"painter.constraints is a lp.Constraints or None, not {kind}")
    lights, values = session.basis.lights, session.wishes.values
    wishes = Wishes.asking(constraints or Constraints(), lights, values)
    return {}, wishes, "constraints from a cell"


def same_paintings(new: Sequence[Target | None], old: Sequence[Target | None]) -> bool:
    """Whether nothing has been painted between them."""
    return len(new) == len(old) and all(map(_same, new, old))


def _same(new: Target | None, old: Target | None) -> bool:
    if new is None or old is None:
        return new is old
    return _pixels_of(new).same(_pixels_of(old))


def _pixels_of(target: Target) -> Pixels:
    return Pixels(target.image, target.importance, target.at_least)


def settings_given(given: Mapping[str, Any], names: Iterable[str]) -> Settings:
    """What a painter is given by name beside its own arguments, `names`.

    Raises TypeError for what has no such name, LightpaintError for a value that means nothing.
    """
    known = [field.name for field in fields(Settings)]
    for name in given:
        if name not in known:
            raise TypeError(f"lp.Painter has no argument {name!r}{meant(name, [*names, *known])}")
    return Settings(**given)


def meant(name: str, known: Iterable[str]) -> str:
    """Behind an error of a name that there is nothing of; nothing if none is near."""
    near = get_close_matches(name, known, 1)
    return f": did you mean {near[0]!r}?" if near else ""


def place_given(store: Any) -> Path | None:
    """Where a session is kept. Raises PaintError for what is no path."""
    if not isinstance(store, str | Path | None):
        raise PaintError(f"store is {store!r}: expected the path of a file, like 'evening.db'")
    return None if store is None else Path(store)


def subjects_given(given: Paintable | Sequence[Paintable], **how: Any) -> tuple[Subject, ...]:
    """What is painted, of one view or of several. how: as of `_subject`.

    Raises LightpaintError for what cannot be.
    """
    _check_asked(**how)
    several = list(given) if isinstance(given, list | tuple) else [given]
    if not several:
        raise PaintError("lp.Painter paints at least one view: give a basis, or a scene")
    made = tuple(_subject(one, among=len(several), **how) for one in several)
    if len(made) > 1 and len({subject.scene is None for subject in made}) > 1:
        raise PaintError("scenes and bases at once: give one kind for all views")
    if len(made) > 1 and any(subject.groups is not None for subject in made):
        raise PaintError("light groups have one view only: give bases, or scenes")
    check_together([subject.sensor for subject in made])
    bases = [subject.basis for subject in made if subject.basis is not None]
    for basis in bases[1:]:
        check_same_lights(bases[0], basis)
    return made


def _check_asked(*, constraints: Any, transform: Any, **_: Any) -> None:
    if not isinstance(constraints, Constraints | None):
        kind = type(constraints).__name__
        raise PaintError(f"the constraints are a {kind}: give lp.Constraints.of(...)")
    if not isinstance(transform, ViewTransform | TransformChoice | None):
        raise PaintError(
            f"transform is {transform!r}: expected a ViewTransform, like lp.ViewTransform('agx')"
        )


def _subject(
    given: Any,
    folder: str | Path | None,
    settings: Settings,
    constraints: Constraints | None,
    transform: ViewTransform | TransformChoice | None,
    among: int,
) -> Subject:
    """What is painted. Raises LightpaintError for what cannot be."""
    about: dict[str, Any] = {
        "settings": settings,
        "constraints": constraints or Constraints(),
        "choice": TransformChoice.of(transform),
        "among": among,
    }
    if isinstance(given, str | Path):
        if Path(given).suffix.lower() == ".exr":
            raise PaintError(
                f"{given} is no scene: give lp.read_basis({str(given)!r}) or, of another "
                f"renderer's light groups, lp.read_light_groups({str(given)!r})"
            )
        given = load_scene(given)
    if isinstance(given, Scene):
        scene = on_film(given, settings.quality, settings.resolution)
        name = str(scene.path)
        about |= {"scene": scene}
    elif isinstance(given, LightGroups):
        name = str(given.path)
        about |= {"basis": given.basis, "groups": given}
    elif isinstance(given, Basis):
        name = given.source or given.origin.scene
        about |= {"basis": given}
    else:
        kind = type(given).__name__
        raise PaintError(f"lp.Painter paints a basis, a scene or light groups, not {kind}")
    if not isinstance(given, Scene):
        check_nothing_idle(settings, given)
    place = Path(f"{called(Path(name))}.paint") if folder is None else Path(folder)
    return Subject(source=name, folder=place.absolute(), **about)
