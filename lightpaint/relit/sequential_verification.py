"""A verification that stops as soon as it is conclusive.

It is a group-sequential test: it examines the render after a few samples, and again each time their
number has grown by a third to a half. It continues while an error in a large part of the light
would probably not be detected and more samples would help. That depends on the noise, but not on
how well prediction and render agree, so the difference in standard errors has the same distribution
at every look. Only a difference beyond the limit stops it at once.

The probability of a false alarm is divided among the looks: the limit of each is raised so that all
looks together pass correct renders as often as a single look does at `LIMIT`, whenever the test
stops.
"""

from dataclasses import replace

from lightpaint.basis.basis import Basis
from lightpaint.images.estimate import Estimate
from lightpaint.images.pixel_blocks import whole_factor
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.progress import Progress, silent
from lightpaint.relit.detection_power import LightShares, detection_power, with_light_tests
from lightpaint.relit.light_tests import light_tests
from lightpaint.relit.verification import (
    LIMIT,
    LOW_POWER,
    Verification,
    compare,
    differences,
    largest_difference,
    limit_of_tests,
)
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import Stream, render_in_stages

#: Numbers of parts, out of ALL_PARTS, of the samples after which the render is examined.
LOOKS, ALL_PARTS = (2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64), 64

#: Minimum samples per pixel at a look, one for each half.
FIRST_LOOK = 2

#: Share of the picture's light in which an error must be detectable before the test stops; and
#: share from which on a single light must be among it.
CHECKED, LARGE_SHARE = 0.65, 1 / 7

#: Share of the picture's light that may stay unchecked although more samples would check it.
UNCHECKED = 0.1


def verify_in_stages(
    predicted: Estimate,
    relit: Scene,
    basis: Basis,
    lighting: Lighting,
    *,
    spp: int,
    seed: int = 0,
    progress: Progress = silent,
) -> Verification:
    """Render the relit scene until an error of 5 % in the lights would have been detected.

    It stops when an error would probably be detected in lights that make up CHECKED of the
    picture's light, including every light with a share of LARGE or more; or when all samples would
    check less than UNCHECKED in addition. predicted: the sum of `basis` under `lighting`, of the
    size of `relit` or on a reduced film of it. spp: maximum samples per pixel.
    """
    lights, stages = LightShares.of(basis, lighting), stages_of(spp, relit.film.block_pixels)
    limit = limit_of_tests(len(stages))

    def is_enough(estimate: Estimate, done: int) -> bool:
        verified = estimate.reduced(whole_factor(estimate.size, predicted.size) or 1)
        return can_tell(predicted, verified, lights, done / spp, limit=limit)

    verified, done = render_in_stages(
        relit,
        stages,
        is_enough,
        seed=seed,
        stream=Stream.VERIFICATION,
        label="verification",
        progress=progress,
    )
    judged = replace(compare(predicted, verified), limit=limit, spp=done)
    return with_light_tests(judged, predicted, lights)


def stages_of(spp: int, block_pixels: int = 1) -> list[int]:
    """Return the samples per pixel at each look; the last is `spp`.

    Both halves have equal numbers, in multiples of `block_pixels`.
    """
    step = 2 * block_pixels
    stages = [spp * part // ALL_PARTS for part in LOOKS]
    looks = {max(samples // step * step, step) for samples in stages if samples >= FIRST_LOOK}
    return [*sorted(samples for samples in looks if samples < spp), spp]


def can_tell(
    predicted: Estimate,
    verified: Estimate,
    lights: LightShares,
    done: float,
    *,
    limit: float = LIMIT,
) -> bool:
    """Return whether a verification may stop.

    predicted, verified: as in `compare`, of equal size. done: share of the samples rendered so far.
    """
    tests = light_tests(predicted, verified, lights.blocks, lights.noise)
    z_lights = dict(zip(lights.names, tests.z.tolist(), strict=True))
    if largest_difference(*differences(predicted, verified), z_lights, limit=limit) > limit:
        return True
    shares = lights.luminance()
    power = detection_power(predicted, verified, lights, tests, limit=limit)
    weak_shares = [share for name, share in shares.items() if power[name] < LOW_POWER]
    if sum(weak_shares) <= 1 - CHECKED and max(weak_shares, default=0.0) < LARGE_SHARE:
        return True
    # With all samples, the noise of the render would be lower by this factor.
    at_end = Estimate(verified.image, verified.half_difference * done**0.5)
    tests = light_tests(predicted, at_end, lights.blocks, lights.noise)
    power = detection_power(predicted, at_end, lights, tests, limit=limit)
    later = [share for name, share in shares.items() if power[name] < LOW_POWER]
    return sum(weak_shares) - sum(later) < UNCHECKED
