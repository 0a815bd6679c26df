"""A problem is made of bases and targets, and of nothing else."""

from typing import Any

import pytest

from lightpaint.errors import TargetError
from lightpaint.lighting.problem import Problem


def test_what_is_no_target(make_basis: Any) -> None:
    with pytest.raises(TargetError, match="give what read_target returns"):
        Problem.of(make_basis(2, (4, 6)), "evening.exr")  # type: ignore[arg-type]
