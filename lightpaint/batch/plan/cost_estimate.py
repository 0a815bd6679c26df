"""Estimates of a plan's time and memory, from constants that were measured.

The seconds of looks are processor seconds of the batches in benchmarks/batch.py, a few looks each,
on a machine that had other work: they are a rough guide.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from lightpaint.batch.plan.plan import Cost, Plan, PlannedLook
from lightpaint.batch.work.render_cost import SAMPLE_S, render_seconds

#: Seconds of any look; of a solve, for each pixel, and for each pixel and light; and of a report,
#: for each pixel.
LOOK_S, PIXEL_S, PIXEL_LIGHT_S, REPORT_S = 0.07, 1.7e-6, 1.6e-7, 1.2e-5

#: Assumed cost of a basis that is a file.
SAVED_BASIS_COST = Cost("", 12, (360, 640), 0, 0)


@dataclass(frozen=True)
class CostEstimate:
    """Seconds for bases and for looks, including final renders; memory: bytes at the peak."""

    bases_s: float
    looks_s: float
    memory: int


def estimate(plan: Plan) -> CostEstimate:
    """Estimate the rest of `plan`, if no basis is cached."""
    remaining_looks = [look for look in plan.chosen_looks if not look.failure and not look.is_done]
    keys = dict.fromkeys(
        key
        for look in remaining_looks
        for step in look.steps
        if not step.is_done
        for key in step.task.bases
        if key in plan.costs
    )
    costs = [plan.costs[key] for key in keys]
    return CostEstimate(
        sum(render_seconds(cost.samples, cost.lights) for cost in costs),
        sum(look_seconds(look, plan) for look in remaining_looks),
        max((cost.memory for cost in costs), default=0),
    )


def look_seconds(look: PlannedLook, plan: Plan) -> float:
    """Return the seconds for the remaining steps of a look, on two cores."""
    costs = [plan.costs.get(key, SAVED_BASIS_COST) for key in look.steps[0].task.bases]
    pixels = sum(cost.size[0] * cost.size[1] for cost in costs)
    steps, spent_s = look.entry.want, 0.0
    if not look.steps[0].is_done:
        lights = max((cost.lights for cost in costs), default=0)
        spent_s += LOOK_S
        spent_s += pixels * (PIXEL_S + PIXEL_LIGHT_S * lights) * look.entry.is_solved
        spent_s += REPORT_S * pixels * ("report" in steps)
        spent_s += SAMPLE_S * sum(cost.samples for cost in costs) * ("verify" in steps)
    if any(step.task.kind == "render" and not step.is_done for step in look.steps):
        spent_s += SAMPLE_S * _final_samples(look, costs)
    return spent_s


def _final_samples(look: PlannedLook, costs: Iterable[Cost]) -> int:
    spp = look.entry.final.spp
    return sum(cost.size[0] * cost.size[1] * (spp or cost.spp) for cost in costs)
