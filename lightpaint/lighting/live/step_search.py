"""The length of one step from the last answer, under the brush."""

from collections.abc import Callable

from lightpaint.arrays import Doubles

#: Shares of a step to try. An answer is one step from the last one.
STEP_SHARES = (1.0, 0.5, 0.25)

#: Share of the fall that squares predict from which no shorter step is tried: half a step would
#: bring that much of it.
GOOD_FALL = 0.75


def search_step(
    start: Doubles,
    value: float,
    step_of: Callable[[float], Doubles],
    loss: Callable[[Doubles], float],
    *,
    promised: float,
) -> Doubles:
    """Return the weights of the share of a step with the least loss; `start` if none lowers it.

    The step is halved a few times only, as long as a shorter one lowers the loss, unless the whole
    step brings most of what its squares promise.

    start: (n, 3), weights, and value: their loss. step_of: returns the weights (n, 3) after a share
    of the step. promised: the fall of the loss that squares predict for the whole step.
    """
    nearest = start
    for share in STEP_SHARES:
        step = step_of(share)
        reached = loss(step)
        if reached > value and nearest is not start:
            break
        is_good = share == 1 and value - reached >= GOOD_FALL * promised
        if reached <= value:
            nearest, value = step, reached
        if is_good:
            break
    return nearest
