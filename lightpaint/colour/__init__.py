"""Colours as numbers: spaces, temperatures, view transforms, displays. Nothing here reads
pictures.
"""

from typing import Literal

#: What a lamp saves, or uses most, among the drives that mix the same colour. It stands here, so
#: that options name it without the libraries that find these drives.
Preference = Literal["watts", "white", "fewest", "rf"]
