"""Milestones among the steps of a history, by which people find their way back."""

from collections.abc import Sequence
from itertools import pairwise

from lightpaint.paint.store.history_steps import Step

#: A step becomes a milestone this many steps after the last one.
STEPS_BETWEEN = 20

#: Seconds without a step before which the last step is a milestone: a person paused there.
PAUSE_SECONDS = 300.0


def find_milestones(steps: Sequence[Step]) -> frozenset[int]:
    """Return the indices of the steps that are milestones.

    These are the last step before a pause, the last before everything was replaced (a look loaded,
    a new start), and, where there is neither, every `STEPS_BETWEEN`th.
    """
    milestones, last = set(), -1
    for k, (step, following) in enumerate(pairwise(steps)):
        is_pause = (
            step.stamp is not None
            and following.stamp is not None
            and following.stamp - step.stamp >= PAUSE_SECONDS
        )
        if is_pause or following.kind == "look_loaded" or k - last >= STEPS_BETWEEN:
            milestones.add(k)
            last = k
    return frozenset(milestones)
