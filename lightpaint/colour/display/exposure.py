"""Chooses the exposure for linear light by metering like a camera, ignoring lamps in view."""

import numpy as np

from lightpaint.arrays import Bools, Floats, largest
from lightpaint.colour.color import luminance
from lightpaint.colour.display.view_transform import MAX_STOPS

#: Luminance of middle grey relative to white; and the percentile of lit pixels that counts as
#: highlights, so that the few brightest pixels do not decide the exposure.
MIDDLE_GREY, HIGHLIGHTS = 0.18, 98

#: Luminance below which a median counts as black, so that its logarithm stays finite.
DARKEST = 1e-30

#: Stops below both white and middle grey from which a picture is nearly black, darker than
#: paintings of nights.
NEARLY_BLACK = 3.0

#: Stops of the median above middle grey, and of the highlights above white, beyond which a picture
#: is too bright.
ABOVE_GREY, BEYOND_WHITE = 1.0, 0.5

#: Maximum stops below middle grey to which exposing for highlights may move the median; the second
#: value applies if highlights may be lamps.
BELOW_GREY, BELOW_GREY_UNKNOWN = 2.5, 1.0


def choose_exposure(image: Floats, emitters_seen: Bools | None = None) -> float:
    """Return the exposure in stops at which to show a linear picture, metered like a camera.

    It is 0 for a picture that can be seen as it is: neither nearly black nor mostly far brighter
    than middle grey. Other pictures are exposed for their highlights, with the 98th percentile at
    white, as far as that keeps the median near middle grey: in a bright room the median decides,
    and a night with a lamp in it stays a night.

    image: (h, w, 3) linear. emitters_seen: (h, w), pixels that show an emitter, which are not
    metered; None if unknown, so that highlights may be lamps.
    """
    brightest = largest(image)
    is_metered = brightest > 0
    if emitters_seen is not None and (is_metered & ~emitters_seen).any():
        is_metered &= ~emitters_seen
    if not is_metered.any():
        return 0.0
    median = float(np.median(luminance(image[is_metered])))
    to_grey = float(np.log2(MIDDLE_GREY / max(median, DARKEST)))
    to_white = -float(np.log2(np.percentile(brightest[is_metered], HIGHLIGHTS)))
    is_dark = min(to_grey, to_white) > NEARLY_BLACK
    is_bright = to_grey < -ABOVE_GREY and to_white < -BEYOND_WHITE
    if not (is_dark or is_bright):
        return 0.0
    below = BELOW_GREY if emitters_seen is not None else BELOW_GREY_UNKNOWN
    stops = np.clip(to_white, to_grey - below, to_grey + ABOVE_GREY)
    return float(np.clip(np.round(stops, 1), -MAX_STOPS, MAX_STOPS))
