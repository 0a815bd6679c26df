"""The preference among mixes of a lamp's emitters; without the libraries that find them."""

from typing import Literal

#: What a lamp saves, or uses most, among the drives that mix the same colour.
Preference = Literal["watts", "white", "fewest", "rf"]
