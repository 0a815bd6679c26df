"""The budget of a basis, a number of samples or a time, and saving the basis during rendering."""

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from lightpaint.basis.light_basis import Basis
from lightpaint.display_text import brief
from lightpaint.errors import SceneError
from lightpaint.progress import Progress
from lightpaint.scene import largest_pass, plan_passes
from lightpaint.validation import MAX_SPP, whole

#: Seconds of work that a crash may lose, both in wall time and in processor time, so that a busy
#: machine does not save more often.
KEEP_EVERY_S = 30.0

#: Factor by which passes of a basis are shorter than the passes of a picture. A time budget is
#: spent in whole passes, and Ctrl-C has to wait for the end of one.
PASS_DIVISOR = 4

#: Samples of a pixel and half whose light is summed before it is added to the sum of earlier ones.
#: A float32 sum of n samples rounds to n 2⁻²⁴ of their mean, and a path adds its light in many
#: small parts: of 2¹⁷ samples, several percent of some lights would be lost.
BLOCK_SPP = 2**10

#: A render that may stop early takes at least this share of its samples and this many per pixel,
#: since the noise of fewer is poorly known, and then looks after each further eighth.
LEAST_SHARE, LEAST_SPP, STEP_SHARE = 1 / 4, 8, 1 / 8


@dataclass(frozen=True)
class Budget:
    """The budget of a basis: `spp` samples per pixel in all, or `time_s` seconds from now, in which
    a one-pass render stops at `until_spp`. It stops earlier where the relative variance of its
    lights is `until_variance` or less (`Basis.relative_variances`).

    Time is wall time from the first pass on. It includes compiling kernels, saving the basis and,
    in separate renders, loading the scene for every light.
    """

    spp: int
    time_s: float | None = None
    until_spp: int | None = None
    until_variance: float | None = None

    def __post_init__(self) -> None:
        if self.time_s is not None and not 0 < self.time_s < math.inf:
            raise SceneError(f"cannot render for {self.time_s} seconds: ask for more than 0")

    def met_by(self, spp: int) -> bool:
        """Return True if this many samples per pixel are enough; never for a time budget."""
        return self.time_s is None and spp >= self.spp

    @property
    def goal(self) -> float:
        """Samples per pixel of each half at which a one-pass render stops; infinite for a time."""
        if self.time_s is None:
            return half_of(self.spp)
        return math.inf if self.until_spp is None else half_of(self.until_spp)

    @property
    def least(self) -> float:
        """Samples per pixel of each half that a render has before it stops for its variance."""
        if self.until_variance is None:
            return math.inf
        return max(math.ceil(LEAST_SHARE * self.goal), LEAST_SPP // 2)

    def step(self, done: int, largest: int) -> int:
        """Return the samples per pixel of the next step of each half; 0 at the goal.

        done: those so far. largest: the size of a full pass.
        """
        step: float = largest
        if self.until_variance is not None:
            ahead = self.least - done
            step = min(largest, ahead if ahead > 0 else math.ceil(STEP_SHARE * self.goal))
        return max(0, int(min(step, self.goal - done)))


def check_samples(*, seed: int, **counts: int | None) -> None:
    """Raise SceneError for numbers of samples per pixel, or a seed, that no render takes."""
    if not (check := whole(0)).is_valid(seed):
        raise SceneError(f"seed is {brief(seed)}: expected {check.expectation}")
    check = whole(0, MAX_SPP)
    for name, count in counts.items():
        if count is not None and not check.is_valid(count):
            expected = f"{check.expectation} samples per pixel"
            raise SceneError(f"{name} is {brief(count)}: expected {expected}")


class Clock:
    """Measures how much of a time budget is spent, and reports it in whole seconds."""

    def __init__(self, time_s: float, progress: Progress) -> None:
        self.time_s, self.progress = time_s, progress
        self.start_s = time.monotonic()
        self.reported = -1
        self.report()

    @property
    def left_s(self) -> float:
        return self.time_s - (time.monotonic() - self.start_s)

    def report(self) -> None:
        total = math.ceil(self.time_s)
        spent = min(max(0, int(self.time_s - self.left_s)), total)
        if spent != self.reported:
            self.progress("basis", spent, total, "seconds")
            self.reported = spent


def steps(
    pixels: int,
    budget: Budget,
    done: int,
    progress: Progress,
    is_clean: Callable[[float], bool] = lambda variance: False,
) -> Iterator[int]:
    """Yield the samples per pixel of each half for one step after another until `budget` is spent.

    done: samples per pixel of each half so far. is_clean: whether no light has a larger relative
    variance.
    """

    def is_enough() -> bool:
        variance = budget.until_variance
        return variance is not None and budget.least <= done < budget.goal and is_clean(variance)

    largest = largest_pass(pixels, shorter=PASS_DIVISOR)
    if budget.time_s is None:
        sizes, ahead = [], done
        while step := budget.step(ahead, largest):
            sizes.append(step)
            ahead += step
        progress("basis", 0, len(sizes))
        for k, step in enumerate(sizes):
            yield step
            done += step
            has_ended = is_enough()
            progress("basis", len(sizes) if has_ended else k + 1, len(sizes))
            if has_ended:
                return
        return
    clock = Clock(budget.time_s, progress)
    while clock.left_s > 0 and not is_enough() and (step := budget.step(done, largest)):
        yield step
        done += step
        clock.report()


def half_of(spp: int) -> int:
    """Return half of `spp`, rounded up. Raises SceneError if `spp` is less than 2."""
    if spp < 2:
        raise SceneError(f"{spp} samples per pixel are too few for two halves: ask for 2 or more")
    return -(-spp // 2)


def next_pair(
    pixels: int, done: tuple[int, int], pairs: int = 1, *, step: int = 1
) -> list[tuple[int, int]]:
    """Return the passes that bring both halves `pairs` short passes beyond the larger half.

    step: the number of samples per pixel is a multiple of this.
    """
    spp = max(done) + pairs * largest_pass(pixels, shorter=PASS_DIVISOR)
    return plan_passes(pixels, 2 * spp, done=done, shorter=PASS_DIVISOR, step=step)


class Keeper:
    """Saves a basis from time to time, and when Ctrl-C ends the work."""

    def __init__(self, keep: Callable[[Basis], bool] | None) -> None:
        self.keep = keep
        self.kept_s, self.every_s = _now_s(), KEEP_EVERY_S

    def now_and_then(self, make: Callable[[], Basis]) -> None:
        """Save the result of `make` if the last save was long enough ago."""
        now_s = _now_s()
        if self.keep is None or min(_passed(self.kept_s, now_s)) <= self.every_s:
            return
        self.keep(make())
        self.kept_s = _now_s()
        # Slow writing must not take most of the time.
        self.every_s = max(KEEP_EVERY_S, 10 * _passed(now_s, self.kept_s)[0])


def _now_s() -> tuple[float, float]:
    """Return wall time and processor time of this process, in seconds."""
    return time.monotonic(), time.process_time()


def _passed(begin_s: tuple[float, float], end_s: tuple[float, float]) -> tuple[float, float]:
    return end_s[0] - begin_s[0], end_s[1] - begin_s[1]
