"""At which exposure to show linear light: metered as by a camera, with lamps in view left out."""

import numpy as np

from lightpaint.arrays import Bools, Floats, largest
from lightpaint.colour.color import luminance
from lightpaint.colour.srgb import MAX_STOPS

#: Luminance of middle grey, beside white at 1; and the percentile of what is lit that is its
#: highlights, of which a picture is not judged by the brightest few.
MIDDLE_GREY, HIGHLIGHTS = 0.18, 98

#: A median below this is black, so that its logarithm stays finite.
DARKEST = 1e-30

#: Stops below white and middle grey from which on a picture is nearly black: beyond what paintings
#: of nights are.
NEARLY_BLACK = 3.0

#: Stops of the median above middle grey, and of highlights above white, up to which a picture is
#: bright and not too bright.
ABOVE_GREY, BEYOND_WHITE = 1.0, 0.5

#: Stops below middle grey to which highlights may bring the median; where they may be lamps, less.
BELOW_GREY, BELOW_GREY_UNKNOWN = 2.5, 1.0


def choose_exposure(image: Floats, emitters_seen: Bools | None = None) -> float:
    """Return the exposure in stops at which to show a linear picture, as a camera meters it.

    0 for a picture that is meant to be seen as it is: neither nearly black nor, with most of it,
    far brighter than middle grey. Another is exposed for its highlights, its 98th percentile at
    white, as far as that leaves its median near middle grey: in a light room the median decides,
    and a night with a lamp in it stays a night.

    image: (h, w, 3) linear. emitters_seen: (h, w), pixels in which an emitter is seen, which
    nothing is exposed for; None where that is not known, so that highlights may be lamps.
    """
    brightest = largest(image)
    counts = brightest > 0
    if emitters_seen is not None and (counts & ~emitters_seen).any():
        counts &= ~emitters_seen
    if not counts.any():
        return 0.0
    median = float(np.median(luminance(image[counts])))
    to_grey = float(np.log2(MIDDLE_GREY / max(median, DARKEST)))
    to_white = -float(np.log2(np.percentile(brightest[counts], HIGHLIGHTS)))
    is_dark = min(to_grey, to_white) > NEARLY_BLACK
    is_bright = to_grey < -ABOVE_GREY and to_white < -BEYOND_WHITE
    if not (is_dark or is_bright):
        return 0.0
    below = BELOW_GREY if emitters_seen is not None else BELOW_GREY_UNKNOWN
    stops = np.clip(to_white, to_grey - below, to_grey + ABOVE_GREY)
    return float(np.clip(np.round(stops, 1), -MAX_STOPS, MAX_STOPS))
