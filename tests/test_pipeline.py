"""What verify_result takes from a result folder, and what it refuses."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lightpaint.errors import ImageError
from lightpaint.images.estimate import Estimate, write_estimate
from lightpaint.images.formats.exr import ExrPart, rgb_channels, write_parts
from lightpaint.pipeline import look
from lightpaint.pipeline.look import VIEW_KEY, verify_result

IMAGE = np.ones((2, 3, 3), np.float32)


def _result(folder: Path, view: str | None) -> Path:
    """A result folder whose scene nobody can load."""
    attributes = {} if view is None else {VIEW_KEY: view}
    write_estimate(folder / "predicted.exr", Estimate(IMAGE, 0 * IMAGE), attributes)
    (folder / "relit.xml").write_text("", encoding="utf-8")
    return folder


@pytest.mark.parametrize(
    ("view", "complaint"),
    [
        ("{", "Expecting property name"),
        ("sensor", "Expecting value"),
        ("[" * 100_000, "nested too deeply"),
        ("[1]", r"\[1\] is not an object"),
        ("null", "None is not an object"),
        ('{"sensor": 7}', "sensor is a text, not 7"),
        ('{"sensor": ["a"]}', "sensor is a text"),
        ('{"spp": "many"}', "spp is a whole number >= 0, not 'many'"),
        ('{"spp": 2.5}', "not 2.5"),
        ('{"spp": true}', "not True"),
        ('{"spp": 0}', "not 0"),
        ('{"spp": -4}', "not -4"),
    ],
)
def test_a_damaged_view_is_an_image_error(tmp_path: Path, view: str, complaint: str):
    with pytest.raises(
        ImageError, match=rf"predicted\.exr is damaged in its attribute {VIEW_KEY}: .*{complaint}"
    ):
        verify_result(_result(tmp_path, view))


def test_a_prediction_of_several_parts_is_an_image_error(tmp_path: Path):
    parts = [ExrPart(name, rgb_channels(IMAGE), {VIEW_KEY: "{}"}) for name in ("left", "right")]
    write_parts(_result(tmp_path, None) / "predicted.exr", parts)
    with pytest.raises(ImageError, match=r"predicted\.exr has 2 parts \(left, right\)"):
        verify_result(tmp_path)


@pytest.mark.parametrize(
    ("view", "choice", "expected"),
    [
        ({"sensor": "side", "spp": 64}, None, ("side", 64)),
        ({"sensor": "side", "spp": 64}, 8, ("side", 8)),
        # What is given is passed on as it is, not taken for "none given".
        ({"sensor": "side", "spp": 64}, 0, ("side", 0)),
        (None, None, (None, None)),
        ({"sensor": None}, 16, (None, 16)),
    ],
)
def test_the_view_of_the_solve_is_taken_unless_another_is_given(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    view: dict[str, Any] | None,
    choice: int | None,
    expected: tuple[str | None, int | None],
):
    sensors: list[Any] = []
    replacements = {
        "load_scene": lambda _path, sensor, **_: sensors.append(sensor),
        "verify": lambda *_args, spp, **_options: sensors.append(spp),
        "_with_power_for_all": lambda verification, _predicted: verification,
    }
    for name, function in replacements.items():
        monkeypatch.setattr(look, name, function)
    folder = _result(tmp_path, None if view is None else json.dumps(view))
    verify_result(folder, spp=choice)
    assert tuple(sensors) == expected
