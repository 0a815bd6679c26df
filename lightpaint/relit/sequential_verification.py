"""A verification that stops as soon as it can tell.

It is a group-sequential test: it looks at the render after a few samples, and each time that their
number has grown by half or a third. It goes on while an error would probably not show in a large
part of the light and more samples would help. That depends on the noise, and not on how well the
two agree, so the difference in standard errors is as likely at one look as at any other. Only a
difference beyond the limit ends it at once.

The chance of a false alarm is spent evenly on the looks: the limit of each is so far out that all
looks together pass sound renders as often as one look at `LIMIT` does, whenever it ends.
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

#: Numerators and denominator of the parts of its samples after which a verification is tested.
LOOKS, ALL_PARTS = (2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64), 64

#: Least samples of each pixel at a look, one for each half.
FIRST_LOOK = 2

#: Share of the picture's light in which an error has to show before it ends, and share from which
#: on it has to show in any one light.
CHECKED, LARGE = 0.65, 1 / 7

#: Share of the picture's light that does not count although more samples would check it.
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
    """Render the relit scene until an error of 5 % in the lights would have been seen.

    It ends where an error would probably show in lights that make CHECKED of the picture's light,
    among them all that make LARGE each; or where all samples would show one in less than UNCHECKED
    more. predicted: the sum of `basis`
    under `lighting`, of the size of `relit` or on a reduced film of it. spp: samples per pixel at
    most.
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
    """Return the samples per pixel at each look, the last of which is `spp`.

    Both halves have equal ones, in multiples of `block_pixels`.
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
    """Return whether a verification may end here.

    predicted, verified: as in `compare`, of one size. done: share of the samples that are rendered.
    """
    tests = light_tests(predicted, verified, lights.blocks, lights.noise)
    z_lights = dict(zip(lights.names, tests.z.tolist(), strict=True))
    if largest_difference(*differences(predicted, verified), z_lights, limit=limit) > limit:
        return True
    shares = lights.luminance()
    power = detection_power(predicted, verified, lights, tests, limit=limit)
    missed = [share for name, share in shares.items() if power[name] < LOW_POWER]
    if sum(missed) <= 1 - CHECKED and max(missed, default=0.0) < LARGE:
        return True
    # With all samples the render would have this much less noise.
    at_end = Estimate(verified.image, verified.half_difference * done**0.5)
    tests = light_tests(predicted, at_end, lights.blocks, lights.noise)
    power = detection_power(predicted, at_end, lights, tests, limit=limit)
    later = [share for name, share in shares.items() if power[name] < LOW_POWER]
    return sum(missed) - sum(later) < UNCHECKED
