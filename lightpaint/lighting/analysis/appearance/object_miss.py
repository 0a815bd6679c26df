"""The object on which an error lies, if there is a single one."""

import re
from collections import Counter

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.images.object_map import Objects

#: Smallest share of the error on a named object, and its largest share of the picture.
MIN_ERROR_SHARE, MAX_PICTURE_SHARE = 0.6, 0.5

#: Kinds of shapes, and numbers that programs give: names without meaning for people.
NO_NAME = re.compile(
    r"(ply|obj|serialized|mesh|shape|object|unnamed|rectangle|cube|sphere|disk|cylinder|instance|"
    r"merge|sdfgrid|bsplinecurve|linearcurve|ellipsoids(mesh)?|group|default|none)?[\W_\d]*",
    re.IGNORECASE,
)


def object_with_most(objects: Objects, index: Indices, missed: Doubles) -> str:
    """Return the object with most of the error, or the first word that several names share; "" for
    none.

    index, missed: (p,), the object and the error, >= 0, of some of the pixels.
    """
    on_each = np.bincount(index + 1, weights=missed, minlength=len(objects.names) + 1)[1:]
    size = np.bincount(objects.index.ravel() + 1, minlength=len(objects.names) + 1)[1:]
    total, pixels = float(missed.sum()), objects.index.size
    for name_of in (str, _first_word):
        on: Counter[str] = Counter()
        by_name: Counter[str] = Counter()
        for name, amount_on, large in zip(objects.names, on_each, size, strict=True):
            on[name_of(name)] += amount_on
            by_name[name_of(name)] += large
        name, most = max(on.items(), key=lambda item: item[1], default=("", 0.0))
        if (
            most >= MIN_ERROR_SHARE * total > 0
            and by_name[name] <= MAX_PICTURE_SHARE * pixels
            and not NO_NAME.fullmatch(name)
        ):
            return name
    return ""


def _first_word(name: str) -> str:
    """Return `statue` for `statue_head`."""
    return re.split(r"[_.\-\s]", name, maxsplit=1)[0]
