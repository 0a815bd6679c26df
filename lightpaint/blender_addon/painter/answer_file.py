# SPDX-License-Identifier: GPL-3.0-or-later
"""The answer of a solve without the painter: multipliers by name of light group."""

import json


def read_factors(path):
    """Return the multipliers in a lighting.json. Raises OSError or ValueError."""
    with open(path, encoding="utf-8") as file:
        answer = json.load(file)
    try:
        return {name: tuple(light["weight"]) for name, light in answer["lights"].items()}
    except (KeyError, TypeError, AttributeError):
        raise ValueError(f"{path} is no lighting of lightpaint") from None
