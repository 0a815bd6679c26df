"""The methods that find an optimum."""

from typing import Literal

#: Newton's method on the active set, which falls back on the paper's iteration; or that one alone.
Method = Literal["polished", "gauss-seidel"]
