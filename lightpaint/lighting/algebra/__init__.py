"""Convex quadratics between bounds: their optimum, and the proof that it is one."""

from typing import Literal

#: How an optimum is found: by Newton's method on the active set, which falls back on the paper's
#: iteration; or by that one alone.
Method = Literal["polished", "gauss-seidel"]
