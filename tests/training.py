"""How many camera samples train the emitter guides of bases in tests."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from lightpaint.basis.render import guide_training

#: As many as a basis of a small room has. All of them take four times the time of such a basis.
FEW_SAMPLES = (2**12, 2**12, 2**13)

#: As outside of tests.
ALL_SAMPLES = guide_training.TRAINING_SAMPLES


@contextmanager
def train_with(samples: tuple[int, ...]) -> Iterator[None]:
    """Train emitter guides with passes of so many camera samples."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(guide_training, "TRAINING_SAMPLES", samples)
        yield
