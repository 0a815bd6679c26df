"""Settings are looked at when they are born, each field with one line."""

import math
from dataclasses import fields
from typing import Any

import numpy as np
import pytest

from lightpaint import LightpaintError, Settings, ViewTransform

WRONG = {
    "hold": (-0.1, math.nan, math.inf, "1", True),
    "colors": ("White", 1, ["free"]),
    "literal": ("yes", 1, None),
    "unpainted": (-0.1, math.nan, math.inf, "1", None, True),
    "method": ("Gauss-Seidel", "newton", None, ["polished"]),
    "emitters": ("Count", None, True),
    "resize": ("yes", 1, None, 0),
    "space": ("Display", 1),
    "transform": ("srgb", ("agx", 1.0)),
    "spp": (1, 0, -4, 2.5, "64", True, math.inf),
    "time_s": (0, -1, math.nan, math.inf, "3", True),
    "error": (0, -0.01, 1, 2.0, 1e-9, math.nan, math.inf, "2%", True),
    "seed": (-1, 0.5, "0", None, False),
    "resolution": ("half", "1/x", "", 4, (320, 180)),
    "quality": ("best", "Final", 1),
    "use_cache": ("no", 0, None),
    "exact_spp": ("no", 1, None),
    "force": ("yes", 1, None),
    "noise_correction": ("True", 1),
    "refine": (-1, 101, 1.0, "1", None, True),
    "suggest": (-1, 1.5, None, True),
    "sun": (-1, 1.5, 5000, True),
    "move_lights": ("no", 0, None),
    "animate": ("yes", 1, None),
    "spectral": ("yes", 1, None),
    "ignore_wishes": ("yes", 1, None),
    "observer": (1, ["camera.csv"], True),
    "cd_per_unit": (0, -100, math.nan, math.inf, "100", True),
    "planes": (1, ["hall.planes.toml"], True),
    "watts": (0, -5, math.nan, math.inf, "300", True),
    "verify": ("no", 0, None),
    "verify_spp": (1, 1.5, "many"),
    "error_bars": ("no", 1, None),
    "report": ("no", 1, None),
    "command": (None, ["lightpaint"]),
}

RIGHT = {
    "hold": (None, 0, 0.3, np.float64(2)),
    "colors": (None, "free", "gentle", "white", "own"),
    "literal": (True, False),
    "unpainted": (0, 0.5, np.float64(2)),
    "method": ("polished", "gauss-seidel"),
    "emitters": ("auto", "count", "skip"),
    "resize": (True, False),
    "space": (None, "linear", "display"),
    "transform": (None, ViewTransform("agx", 1.0)),
    "spp": (None, 2, np.int64(64)),
    "time_s": (None, 0.1, 3),
    "error": (None, 0.02, np.float64(0.5)),
    "seed": (0, 2**70, np.uint8(3)),
    "resolution": (None, "1/4", "320x180"),
    "quality": (None, "preview", "final"),
    "use_cache": (True, False),
    "exact_spp": (True, False),
    "force": (True, False),
    "noise_correction": (None, True, False),
    "refine": (0, 100),
    "suggest": (0, 3),
    "sun": (None, 0, 72),
    "move_lights": (True, False),
    "animate": (True, False),
    "spectral": (True, False),
    "ignore_wishes": (True, False),
    "observer": (None,),
    "cd_per_unit": (None, 100, 0.5),
    "planes": (None, "hall.planes.toml"),
    "watts": (None, 300, 0.5),
    "verify": (True, False),
    "verify_spp": (None, 2, 64),
    "error_bars": (True, False),
    "report": (True, False),
    "command": ("", "lightpaint solve a b"),
}


def _each(values: dict[str, Any]) -> list[tuple[str, Any]]:
    return [(name, value) for name, several in values.items() for value in several]


def test_every_field_is_tried() -> None:
    assert set(WRONG) == set(RIGHT) == {field.name for field in fields(Settings)}


@pytest.mark.parametrize(("name", "value"), _each(WRONG))
def test_a_value_that_means_nothing_is_refused_in_one_line(name: str, value: Any) -> None:
    with pytest.raises(LightpaintError, match=r"expected|not a resolution") as refusal:
        Settings(**{name: value})
    assert "\n" not in str(refusal.value)
    assert repr(value) in str(refusal.value)


@pytest.mark.parametrize(("name", "value"), _each(RIGHT))
def test_a_value_that_means_something_is_taken(name: str, value: Any) -> None:
    assert getattr(Settings(**{name: value}), name) == value


def test_samples_and_a_time_at_once_are_refused() -> None:
    with pytest.raises(LightpaintError, match=r"spp is 4 and time_s 2: .* not both"):
        Settings(spp=4, time_s=2)


def test_what_is_not_painted_is_weighed_one_way() -> None:
    with pytest.raises(LightpaintError, match=r"unpainted is 0\.1 and hold 0\.3: expected one"):
        Settings(unpainted=0.1, hold=0.3)
    assert Settings(unpainted=0.1, hold=0).unpainted == 0.1
