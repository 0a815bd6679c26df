"""A verification that stops as soon as more samples would tell hardly anything new.

It looks at the render after an eighth, a quarter and half of its samples. Whether it goes on is
decided by the noise, and not by how well the two agree: so the difference in standard errors is as
likely at one look as at any other. Only a difference beyond the limit ends it at once. The limit is
that of several looks, so that sound renders pass as often as with one.
"""

from dataclasses import replace
from statistics import NormalDist

from lightpaint.basis.basis import Basis
from lightpaint.images.estimate import Estimate
from lightpaint.images.pixel_blocks import whole_factor
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.progress import Progress, silent
from lightpaint.relit.detection_power import LightShares, detection_power, with_power
from lightpaint.relit.sample_budget import FEWEST
from lightpaint.relit.verification import LIMIT, LOW_POWER, Verification, compare
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import Stream, render_in_stages

#: Parts of its samples after which a verification is looked at.
PARTS = (8, 4, 2, 1)

#: Share of the picture's light that may be left unchecked although more samples would check it.
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

    It ends where the lights that it would only see an error in with more samples make less than
    UNCHECKED of the picture's light. predicted: the sum of `basis` under `lighting`, of the size of
    `relit` or on a reduced film of it. spp: samples per pixel at most.
    """
    lights, stages = LightShares.of(basis, lighting), stages_of(spp, relit.film.block_pixels)
    limit = limit_of_looks(len(stages))

    def is_enough(estimate: Estimate, done: int) -> bool:
        judged = compare(predicted, estimate)
        if judged.difference > limit:
            return True
        verified = estimate.reduced(whole_factor(estimate.size, predicted.size) or 1)
        return unchecked(predicted, verified, lights, done / spp, limit=limit) < UNCHECKED

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
    return with_power(judged, predicted, lights)


def stages_of(spp: int, block_pixels: int = 1) -> list[int]:
    """Return the samples per pixel at each look, the last of which is `spp`.

    Both halves have equal ones, in multiples of `block_pixels`.
    """
    step = 2 * block_pixels
    looks = {max(spp // part // step * step, step) for part in PARTS if spp // part >= FEWEST}
    return [*sorted(samples for samples in looks if samples < spp), spp]


def limit_of_looks(looks: int, *, once: float = LIMIT) -> float:
    """Return the limit, in standard errors, that passes sound renders as often as `once` does once.

    By Bonferroni's inequality the chance of a false alarm is at most the sum of those of each look.
    """
    return -NormalDist().inv_cdf(NormalDist().cdf(-once) / looks)


def unchecked(
    predicted: Estimate, verified: Estimate, lights: LightShares, done: float, *, limit: float
) -> float:
    """Return the share of the picture's light that only more samples would check.

    predicted, verified: as in `compare`, of one size. done: share of the samples that are rendered.
    """
    now = detection_power(predicted, verified, lights, limit=limit)
    half = verified.half_difference * done**0.5
    later = detection_power(predicted, Estimate(verified.image, half), lights, limit=limit)
    shares = lights.luminance()
    return sum(shares[name] for name in now if now[name] < LOW_POWER <= later[name])
