"""Renders a basis: all lights in one pass if possible, else one by one.

Before one pass, the emitter guide is trained: which emitters matter where. Training depends on the
scene, its film and the seed alone, not on the number of samples, the budget or the machine. So all
machines choose emitters in the same way, and none has to wait for another.
"""

import gc
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from lightpaint.arrays import Floats
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render import banded_film, rendered_basis
from lightpaint.basis.render.render_budget import Budget, Keeper, check_samples, steps
from lightpaint.basis.render.separate_renders import LightSums, emitters_seen, render_separately
from lightpaint.errors import BasisError, SceneError
from lightpaint.keywords import keywords
from lightpaint.progress import Interrupted, Progress, silent
from lightpaint.scene import Scene, render_first_hits, view_seed
from lightpaint.scene.runtime.mitsuba_errors import render_errors
from lightpaint.scene.runtime.render_lock import MITSUBA, tracing
from lightpaint.sentences import Hint

if TYPE_CHECKING:
    from lightpaint.basis.render.tracer.one_pass import Tracer


#: Maximum numbers of camera samples in the training passes. Each pass uses what earlier ones
#: learned.
TRAINING_SAMPLES = (2**16, 2**17, 2**17)
#: Maximum number of them per pixel, since training for a small picture would take longer than its
#: samples; and, where many emitters are to choose from, that number for each emitter.
TRAINING_SPP, TRAINING_SPP_PER_EMITTER = 16, 0.5


@keywords()
def render_basis(
    scene: Scene,
    *,
    spp: int | None = None,
    time_s: float | None = None,
    until_spp: int | None = None,
    until_variance: float | None = None,
    seed: int = 0,
    start: Basis | None = None,
    keep: Callable[[Basis], bool] | None = None,
    is_final: bool = True,
    progress: Progress = silent,
) -> Basis:
    """Render the image of each light of `scene` alone, at unit emission.

    Args:
        scene: From `load_scene`.
        spp: Samples per pixel (by default the scene's own number).
        time_s: Seconds to render for, instead of spp and in addition to the time spent on `start`;
            a step that has begun is finished.
        until_spp: Samples per pixel at which rendering stops before `time_s` is over; one-pass
            renders only.
        until_variance: Σ noise² / Σ light² of a light's picture, without stray pixels. A one-pass
            render stops early, after at least a quarter of its samples, once no light has more.
        seed: Any number >= 0; different seeds give independent bases.
        start: An earlier basis of the same scene, sensor and seed. Its samples count, so only those
            missing to `spp` are rendered, or as many more as `time_s` allows. If it has `sums`, the
            result has the bits of a single render, up to 2,048 samples per pixel, else it differs
            by round-off.
        keep: Called with the basis so far, including its `sums`, from time to time and when Ctrl-C
            ends the work early. Returns whether it was stored.
        is_final: False for a basis to which more samples will be added: it keeps its `sums`.
        progress: Called with the progress of the work.

    Raises:
        SceneError: If there are more lights and pixels than fit.
        Interrupted: On Ctrl-C.

    Examples:
        >>> lp.render_basis(lp.load_scene("room.xml"), spp=4)
        Basis(2 lights, 16x16, 4 spp, of room.xml: panel, bulb)
    """
    if spp is not None and time_s is not None:
        raise SceneError("give a number of samples or a time to render for, not both")
    check_samples(spp=spp, until_spp=until_spp, seed=seed)
    budget = Budget(scene.spp if spp is None else spp, time_s, until_spp, until_variance)
    check_size(scene)
    if start is not None and not rendered_basis.is_of(scene, start, seed):
        raise BasisError("the basis to continue was made from another scene, sensor, film or seed")
    if start is not None and budget.met_by(start.origin.spp):
        return with_first_hits(start.with_requests(scene.requests), scene, seed)
    banded_film.check_memory(scene, in_bands=banded_film.renders_in_bands(scene, start))
    method = rendered_basis.method_of(scene)
    if start is not None and start.origin.method != method:
        # It cannot be continued, but must not be replaced by a basis with fewer samples either.
        start, keep = None, None
    if start is not None and method == rendered_basis.ONE_PASS:
        _check_equal_samples(start)
    has_first_hits = start is not None and _has_first_hits(start)
    arguments = scene, budget, seed, start, Keeper(keep), progress
    with render_errors(scene.path):
        if method == rendered_basis.ONE_PASS:
            rendered = _render_together(
                *arguments, is_final=is_final, needs_first_hits=not has_first_hits
            )
        else:
            rendered = _render_one_by_one(*arguments, is_final=is_final)
    if start is not None and has_first_hits:
        rendered = replace(rendered, features=start.features, objects=start.objects)
    return with_first_hits(rendered, scene, seed)


def check_size(scene: Scene) -> None:
    """Raise SceneError if a basis of `scene` would have more values than its file can count."""
    height, width = scene.size
    if len(scene.lights) * height * width * 3 >= 2**32:
        raise SceneError(
            f"{len(scene.lights)} lights at {width}x{height} are more than one basis can hold: "
            "use ",
            Hint("resolution"),
            " or fewer lights",
        )


def _check_equal_samples(start: Basis) -> None:
    """Raise BasisError if one pass cannot continue `start`."""
    if start.origin.each_light:
        raise BasisError(
            "the lights of the basis to continue have unequal numbers of samples, and one pass "
            "adds the same number to each: render the others first, with scene.only([...])"
        )


def with_first_hits(basis: Basis, scene: Scene, seed: int, *, loaded: Any = None) -> Basis:
    """Return `basis` with features and objects, which a basis from an earlier version may lack.

    Measurements at points have none. loaded: the loaded `scene`, if available.
    """
    if scene.points is not None or _has_first_hits(basis):
        return basis
    features, objects = render_first_hits(scene, seed=seed, loaded=loaded)
    return replace(basis, features=features, objects=objects)


def _has_first_hits(basis: Basis) -> bool:
    return basis.features is not None and basis.objects is not None


@MITSUBA.acquired()
def _render_together(
    scene: Scene,
    budget: Budget,
    seed: int,
    start: Basis | None,
    keeper: Keeper,
    progress: Progress,
    *,
    is_final: bool = True,
    needs_first_hits: bool = False,
) -> Basis:
    """Render all lights step by step with one path tracer (see one_pass.py).

    needs_first_hits: whether to render features and objects while the scene is loaded.
    """
    render = _OnePassRender(scene, seed, start)
    try:
        render.spend(budget, keeper, progress)
        rendered = render.basis(is_last=True, is_finished=is_final)
    except KeyboardInterrupt:
        if keeper.keep is None:
            raise
        render.even_out()
        if render.done == 0:
            raise Interrupted("too early for anything to be kept") from None
        if not keeper.keep(render.basis(is_last=True)):
            raise
        budget_text = "" if budget.time_s is not None else f" of {budget.spp}"
        raise Interrupted(
            f"{2 * render.done}{budget_text} samples per pixel are kept; run the same command to "
            "continue"
        ) from None
    else:
        if needs_first_hits:
            loaded = None if scene.is_spectral else render.tracer.loaded
            return with_first_hits(rendered, scene, seed, loaded=loaded)
        return rendered
    finally:
        render.tracer.close()
        gc.collect()


class _OnePassRender:
    """A render of all lights by one path tracer, and the samples that it has so far.

    start: the basis that it continues.
    """

    def __init__(self, scene: Scene, seed: int, start: Basis | None) -> None:
        from lightpaint.basis.render.tracer.one_pass import Tracer

        self._scene, self._seed, self._start = scene, seed, start
        #: Number of samples per pixel of each half.
        self.done = 0 if start is None else start.origin.halves[0]
        guide_table = None if start is None else start.guide_table
        self.tracer = Tracer(scene, view_seed(seed, scene.sensor), guide_table)
        sums = None if start is None else start.sums
        # The samples that are not in the initial sums.
        self._rest = start if sums is None else None
        film_type = (
            banded_film.BandedFilm
            if banded_film.renders_in_bands(scene, start)
            else banded_film.WholeFilm
        )
        self._film: banded_film.WholeFilm | banded_film.BandedFilm = film_type(
            self.tracer, self.done, sums
        )

    def spend(self, budget: Budget, keeper: Keeper, progress: Progress) -> None:
        """Add samples step by step until `budget` is spent."""
        with self._scene.variant(), tracing() as let_others_through:
            pixels, done = self._film.band_pixels, self.done
            for k, spp in enumerate(steps(pixels, budget, done, progress, self._is_clean)):
                if k > 0:  # after the last step the caller keeps what is finished
                    keeper.now_and_then(self.basis)
                if not self.tracer.is_trained:
                    train_tracer(self.tracer, let_others_through)
                self._film.add(self.done, spp, let_others_through)
                self.done += spp

    def _is_clean(self, variance: float) -> bool:
        return bool((self.basis().relative_variances <= variance).all())

    def even_out(self) -> None:
        """Complete the step that an interrupt left unfinished in some pixels."""
        if ahead := self._film.ahead:
            with self._scene.variant(), tracing() as let_others_through:
                self._film.add(self.done, ahead, let_others_through)
            self.done += ahead

    def basis(self, *, is_last: bool = False, is_finished: bool = False) -> Basis:
        """Return the basis of the samples so far. is_last: whether to release the sums."""
        scene, seed, film, table = self._scene, self._seed, self._film, self.tracer.guide_table
        seen = film.seen()
        if self._start is not None:
            seen |= self._start.emitters_seen
        if isinstance(film, banded_film.BandedFilm):
            of_render = scene, seed, seen, self.done, table
            sums = None if is_finished else (film.sums.array[0], film.sums.array[1])
            pairs = film.planes(self.done)
            return rendered_basis.basis_of_planes(
                pairs, *of_render, is_finished=is_finished, sums=sums
            )
        halves, start = film.sums(is_last=is_last), self._rest
        of_sums = scene, seed, halves, seen, self.done, table
        return rendered_basis.basis_of_sums(*of_sums, start=start, is_finished=is_finished)


@MITSUBA.acquired()
def _render_one_by_one(
    scene: Scene,
    budget: Budget,
    seed: int,
    start: Basis | None,
    keeper: Keeper,
    progress: Progress,
    *,
    is_final: bool = True,
) -> Basis:
    """Render one light after the other with the scene's own integrator (see
    separate_renders.py).
    """
    sums = LightSums(len(scene.lights), scene.size) if start is None else LightSums.of(start)
    seen = emitters_seen(scene) if start is None else start.emitters_seen

    def basis(*, is_finished: bool = False) -> Basis:
        return rendered_basis.basis_of_passes(scene, seed, sums, seen, is_finished=is_finished)

    numbers = view_seed(seed, scene.sensor)
    render_separately(
        scene, budget, seed=numbers, sums=sums, basis=basis, keeper=keeper, progress=progress
    )
    return basis(is_finished=is_final)


def training_samples(scene: Scene) -> tuple[int, ...]:
    """Return the numbers of camera samples in the training passes for `scene`."""
    height, width = scene.size
    spp = max(TRAINING_SPP, TRAINING_SPP_PER_EMITTER * len({x.node for x in scene.emitters}))
    share = min(1.0, spp * height * width / sum(TRAINING_SAMPLES))
    return tuple(max(1, round(share * samples)) for samples in TRAINING_SAMPLES)


@MITSUBA.acquired()
def train_guide(scene: Scene, seed: int) -> Floats:
    """Train an emitter guide for `scene`, and return its `Basis.guide_table`."""
    from lightpaint.basis.render.tracer.one_pass import Tracer

    tracer = Tracer(scene, view_seed(seed, scene.sensor))
    try:
        with scene.variant(), tracing() as let_others_through:
            return train_tracer(tracer, let_others_through)
    finally:
        tracer.close()
        gc.collect()


def train_tracer(tracer: "Tracer", let_others_through: Callable[[], None]) -> Floats:
    """Train the guide of `tracer`, unless it has no choice, and return its table.

    let_others_through: called before each pass.
    """
    (height, width), done = tracer.scene.size, 0
    passes = training_samples(tracer.scene) if tracer.guide.has_choice else ()
    for k, samples in enumerate(passes):
        let_others_through()
        # In a large picture a subset of the rows suffices, a different one in each pass.
        step = min(-(-height * width // samples), height)
        rows = range(k * step // len(passes), height, step)
        spp = max(1, samples // (len(rows) * width))
        tracer.learn(rows, done, spp)
        done += spp
    return tracer.end_training()
