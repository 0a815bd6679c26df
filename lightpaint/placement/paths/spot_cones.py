"""Directions from a light to points, and the share of its light that a spot sends there."""

from collections.abc import Sequence

import numpy as np

from lightpaint.arrays import Floats


def away_from(place: Sequence[float], points: Floats) -> Floats:
    """Return the directions from a place to points, (v, 3) float32 unit vectors."""
    away = points - np.asarray(place, np.float32)
    away /= np.maximum(np.sqrt(np.einsum("vk,vk->v", away, away))[:, None], 1e-30)
    return np.asarray(away)


def share_in_cone(cosine: Floats, cutoff: float, beam: float) -> Floats:
    """Return the share of its light that a spot sends at cosines to its axis. Angles: degrees.

    As Mitsuba's spot has it: 1 within the beam, linear in the angle to 0 at the cutoff.
    """
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    share = (np.float32(cutoff) - angle) / np.float32(max(cutoff - beam, 1e-6))
    return np.asarray(np.clip(share, 0, 1))
