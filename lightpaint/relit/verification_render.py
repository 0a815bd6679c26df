"""Renders the relit scene independently, and compares it with the prediction.

By default a verification has at most as many samples as its basis; of spectra, which Mitsuba's own
integrator renders with more noise, this number may be doubled. `verify_in_stages` stops as soon as
it is conclusive. It is a group-sequential test: it examines the render after a few samples, and
again each time their number has grown by a third to a half. It continues while an error in a large
part of the light would probably not be detected and more samples would help. That depends on the
noise, but not on how well prediction and render agree, so the difference in standard errors has the
same distribution at every look. Only a difference beyond the limit stops it at once. Emitters are
sampled by their share of the predicted light, which changes noise and not the picture.

The probability of a false alarm is divided among the looks: the limit of each is raised so that all
looks together pass correct renders as often as a single look does at `LIMIT`, whenever the test
stops.
"""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from lightpaint.basis import Basis
from lightpaint.basis.render import check_samples
from lightpaint.errors import SizeError
from lightpaint.images import Estimate, Size, whole_factor
from lightpaint.keywords import keywords
from lightpaint.lighting import Lighting, Solution, joint_estimate, refine
from lightpaint.progress import Progress, silent
from lightpaint.relit import verification
from lightpaint.relit.relit_scene import relight
from lightpaint.scene import (
    Scene,
    Stream,
    luminaire_of_spot,
    pass_seed,
    render,
    render_in_stages,
    sampled_by,
    view_seed,
)
from lightpaint.scene.lights.texels import image_of

#: Numbers of parts, out of ALL_PARTS, of the samples after which the render is examined.
LOOKS, ALL_PARTS = (2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64), 64

#: Minimum samples per pixel at a look, one for each half.
FIRST_LOOK = 2

#: Share of the picture's light in which an error must be detectable before the test stops; and
#: share from which on a single light must be among it.
CHECKED, LARGE_SHARE = 0.65, 1 / 7

#: Share of the picture's light that may stay unchecked although more samples would check it.
UNCHECKED = 0.1

#: How often the samples of a verification with spectra may be doubled. At equal samples pictures of
#: narrow LEDs have five to seven times the variance of the basis (docs/benchmarks.md).
SPECTRAL_DOUBLINGS = 4

#: Minimum samples per pixel of a verification; with fewer, a smaller film is just as good.
FEWEST = 4


@keywords()
def verify(
    predicted: Estimate,
    relit: Scene,
    *,
    spp: int | None = None,
    seed: int = 0,
    stream: Stream = Stream.VERIFICATION,
    progress: Progress = silent,
) -> verification.Verification:
    """Render the relit scene with random numbers that no basis uses, and compare.

    Args:
        predicted: The prediction, of the size of `relit` or on a reduced film of it.
        relit: The result of `relight`.
        spp: Samples per pixel of `relit` (by default the scene's own number).
        seed: Any number >= 0.
        stream: Stream of random numbers; a repeated verification uses another one.
        progress: Called with the progress of the work.

    Examples:
        >>> scene = lp.load_scene("room.xml")
        >>> lighting = lp.read_lighting("lighting.json")
        >>> relit = lp.relight(scene, lighting, "relit.xml")
        >>> lp.verify(lp.combine(basis, lighting), relit, spp=4).agrees
        True
    """
    check_samples(seed=seed, spp=spp)
    if whole_factor(relit.size, predicted.size) is None:
        raise SizeError(
            f"the prediction is {predicted.size[1]}x{predicted.size[0]} but ",
            relit.path,
            f" renders {relit.size[1]}x{relit.size[0]}: they belong to different scenes or sensors",
        )
    verified = render(
        relit,
        spp=spp,
        seed=seed,
        stream=stream,
        label="verification",
        progress=progress,
    )
    return replace(verification.compare(predicted, verified), spp=relit.spp if spp is None else spp)


def verify_in_stages(
    predicted: Estimate,
    relit: Scene,
    basis: Basis,
    lighting: Lighting,
    *,
    spp: int,
    doublings: int = 0,
    seed: int = 0,
    progress: Progress = silent,
) -> verification.Verification:
    """Render the relit scene until an error of 5 % in the lights would have been detected.

    It stops when an error would probably be detected in lights that make up CHECKED of the
    picture's light, including every light with a share of LARGE or more; or when all samples would
    check less than UNCHECKED in addition. predicted: the sum of `basis` under `lighting`, of the
    size of `relit` or on a reduced film of it. spp: maximum samples per pixel. doublings: how often
    that may be doubled.
    """
    lights = verification.LightShares.of(basis, lighting)
    stages = stages_of(spp, relit.film.block_pixels, doublings=doublings)
    limit = verification.limit_of_tests(len(stages))
    relit = sampled_by(relit, shares_of_emitters(relit, lighting, lights.luminance()))

    def is_enough(estimate: Estimate, done: int) -> bool:
        verified = estimate.reduced(whole_factor(estimate.size, predicted.size) or 1)
        return can_tell(predicted, verified, lights, done / stages[-1], limit=limit)

    verified, done = render_in_stages(
        relit,
        stages,
        is_enough,
        seed=seed,
        stream=Stream.VERIFICATION,
        label="verification",
        progress=progress,
    )
    judged = replace(verification.compare(predicted, verified), limit=limit, spp=done)
    return verification.with_light_tests(judged, predicted, lights)


def shares_of_emitters(
    relit: Scene, lighting: Lighting, shares: Mapping[str, float]
) -> dict[str, float]:
    """Return the share of each emitter of `relit` in the light. shares: by name of the light.

    The emitters of a light have equal parts of it, as have the spots of a luminaire; texels are one
    emitter, the image.
    """
    names = {emitter.name for emitter in relit.emitters}
    of_emitters: dict[str, float] = {}
    for light in lighting.lights:
        for member in light.members if light.name in shares else ():
            name = member if member in names else image_of(member)
            parts = [x for x in names if x == name or luminaire_of_spot(x) == name] or [name]
            for part_name in parts:
                part = shares[light.name] / len(light.members) / len(parts)
                of_emitters[part_name] = of_emitters.get(part_name, 0.0) + part
    return of_emitters


def stages_of(spp: int, block_pixels: int = 1, *, doublings: int = 0) -> list[int]:
    """Return the samples per pixel at each look; `spp` is one, and then its doubles are.

    Both halves have equal numbers, in multiples of `block_pixels`.
    """
    step = 2 * block_pixels
    stages = [spp * part // ALL_PARTS for part in LOOKS]
    looks = {max(samples // step * step, step) for samples in stages if samples >= FIRST_LOOK}
    doubled = [spp << k for k in range(doublings + 1)]
    return [*sorted(samples for samples in looks if samples < spp), *doubled]


def can_tell(
    predicted: Estimate,
    verified: Estimate,
    lights: verification.LightShares,
    done: float,
    *,
    limit: float = verification.LIMIT,
) -> bool:
    """Return whether a verification may stop.

    predicted, verified: as in `compare`, of equal size. done: share of the samples rendered so far.
    """
    tests = verification.light_tests(predicted, verified, lights.blocks, lights.noise)
    z_lights = dict(zip(lights.names, tests.z.tolist(), strict=True))
    if (
        verification.largest_difference(
            *verification.differences(predicted, verified), z_lights, limit=limit
        )
        > limit
    ):
        return True
    shares = lights.luminance()

    def shares_unseen(render: Estimate, tests: verification.LightTests) -> list[float]:
        power = verification.detection_power(predicted, render, lights, tests, limit=limit)
        return [share for name, share in shares.items() if power[name] < verification.LOW_POWER]

    weak_shares = shares_unseen(verified, tests)
    if sum(weak_shares) <= 1 - CHECKED and max(weak_shares, default=0.0) < LARGE_SHARE:
        return True
    # With all samples, the noise of the render would be lower by this factor.
    at_end = Estimate(verified.image, verified.half_difference * done**0.5)
    tests = verification.light_tests(predicted, at_end, lights.blocks, lights.noise)
    return sum(weak_shares) - sum(shares_unseen(at_end, tests)) < UNCHECKED


@dataclass(frozen=True)
class VerificationBudget:
    """The size and the samples of a verification.

    scene: the relit scene on the film to render. spp: samples per pixel. share: its samples
    relative to the samples of the basis. doublings: how often both may be doubled.
    """

    scene: Scene
    spp: int
    share: float
    doublings: int = 0

    @property
    def largest(self) -> "VerificationBudget":
        """This budget after all doublings."""
        factor = 1 << self.doublings
        return replace(self, spp=factor * self.spp, share=factor * self.share, doublings=0)


def verification_budget(
    relit: Scene,
    basis_size: Size,
    basis_spp: int,
    *,
    most_spp: int | None = None,
    asked_spp: int | None = None,
) -> VerificationBudget:
    """Return a verification of `relit` that takes no longer than its basis, or the requested one.

    The samples of the basis are spent on the whole film, or on the largest film of whole blocks
    that has FEWEST in each pixel; the comparison uses means over the blocks of the basis, so either
    film serves. A sample of an ordinary render costs no more than one of a basis. A film that
    cannot be divided into blocks gets at least two samples in each pixel, for two halves, whatever
    the basis has.

    basis_size: (height, width). basis_spp: samples per pixel. most_spp: maximum samples per pixel,
    unless asked_spp is given. asked_spp: samples per pixel of the whole film, whatever they cost.
    """
    samples = basis_spp * basis_size[0] * basis_size[1]
    film_pixels = relit.size[0] * relit.size[1]
    if asked_spp is not None:
        return VerificationBudget(relit, asked_spp, asked_spp * film_pixels / samples)
    factor = whole_factor(relit.size, basis_size) or 1
    for part in range(1, factor + 1):
        if factor % part:
            continue
        scene = relit if part == 1 else relit.reduced(f"1/{part}")
        # A block that is not a pixel of Mitsuba's film costs a sample in each of its film pixels.
        saves = scene.film.block == relit.film.block
        if part < factor and not (saves and whole_factor(scene.size, basis_size) == factor // part):
            continue
        pixels = scene.size[0] * scene.size[1]
        spp = samples // pixels
        if spp >= FEWEST or part == factor:
            spp = max(2, spp if most_spp is None else min(spp, most_spp))
            # Each film pixel of a block gets the same number, in both halves.
            spp = max(spp, 2 * scene.film.block_pixels)
            return VerificationBudget(scene, spp, spp * pixels / samples)
    raise AssertionError("the last factor is always taken")


def refine_by_rendering(
    views: Sequence[tuple[Scene, Basis]],
    solution: Solution,
    *,
    rounds: int,
    seed: int = 0,
    progress: Progress = silent,
) -> Solution:
    """Render the scene under the solution's lighting and take a Newton step, `rounds` times.

    views: scene and basis of each view in the solution; each render has the film and the samples of
    that basis. Every round uses random numbers that neither the other rounds, the basis nor a
    verification uses.
    """
    for k in range(rounds):
        mixed_bases = []
        for scene, basis in views:
            its_seed = pass_seed(view_seed(seed, scene.sensor), Stream.REFINEMENT, k)
            label = f"refinement {k + 1}"
            mixed_bases.append(_mixed(scene, basis, solution, its_seed, label, progress))
        solution = refine(solution, joint_estimate(mixed_bases))
    return solution


def _mixed(
    scene: Scene,
    basis: Basis,
    solution: Solution,
    seed: int,
    label: str,
    progress: Progress,
) -> Estimate:
    """Render one view of the solved scene at the size and the samples of its basis."""
    height, width = basis.size
    with tempfile.TemporaryDirectory(prefix="lightpaint-") as folder:
        relit = relight(scene, solution.lighting, Path(folder) / "relit.xml")
        return render(
            relit.reduced(f"{width}x{height}"),
            spp=max(2, basis.origin.spp),
            seed=seed,
            stream=Stream.REFINEMENT,
            label=label,
            progress=progress,
        )
