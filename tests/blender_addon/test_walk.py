"""The add-on in Blender, from a scene to painted lamps and back, by a scripted painter."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from blender import found_in_blender, in_blender
from nightly import nightly

HERE = Path(__file__).parent

#: Energies of the lamps in `shots.py`, by name: area, point, spot, sun.
ENERGIES = [80.0, 120.0, 300.0, 0.4]


@pytest.fixture(scope="module")
def walk_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("walk")


@pytest.mark.long
def test_the_lamps_follow_a_painter_and_everything_comes_back(
    blender: list[str], walk_folder: Path, variables: dict[str, str]
) -> None:
    found = found_in_blender(blender, HERE / "walk.py", walk_folder, variables)
    assert found["groups"] == ["Area", "Point", "Screen", "Sky", "Spot", "Sun", "Tube"]
    assert found["rendered once"]
    assert found["output is put back"]
    # The painter shows the shot as Blender does, and that makes no difference to watts.
    assert found["view"] in found["shown view"]["name"]
    assert found["relit once"]
    assert np.allclose(found["still unpainted"], ENERGIES)
    assert np.allclose(found["still discarded"], ENERGIES)
    assert found["lamps follow"]
    assert found["kept by the file"]
    assert found["painter has ended"]
    assert np.allclose(found["discarded"], ENERGIES)
    wanted = [
        energy * np.mean(found["factors"][name])
        for name, energy in zip(("Area", "Point", "Spot", "Sun"), ENERGIES, strict=True)
    ]
    assert np.allclose(found["look"], wanted, rtol=1e-5)
    assert found["keys"] > 0
    assert found["reverted"] == []
    assert found["reverted and reopened"] == []
    check_prediction(walk_folder, found["factors"])


def check_prediction(folder: Path, factors: dict[str, Any]) -> None:
    """The relit shot is Σ multiplier × group: of means over blocks, the noise is a few percent."""
    shot, relit = layers(folder / "shot" / "shot.exr"), layers(folder / "relit" / "shot.exr")
    predicted = sum(np.array(factors[name]) * shot[f"Combined_{name}"] for name in factors)
    first, second = block_means(predicted), block_means(relit["Combined"])
    assert abs(first.mean() / second.mean() - 1) < 0.01
    assert np.sqrt(np.mean((first - second) ** 2)) < 0.05 * second.mean()
    # And each light apart, in all channels: a lamp with another unit would be far off.
    for name, factor in factors.items():
        before, after = shot[f"Combined_{name}"], relit[f"Combined_{name}"]
        measured = after.mean((0, 1)) / before.mean((0, 1))
        assert np.allclose(measured, factor, rtol=0.06, atol=0.01), name


def layers(path: Path) -> dict[str, Any]:
    """Return layers of a file that Blender wrote, by pass."""
    found: dict[str, dict[str, Any]] = {}
    with OpenEXR.File(str(path), separate_channels=True) as file:
        for part in file.parts:
            for name, channel in part.channels.items():
                layer, _, letter = name.rpartition(".")
                found.setdefault(layer.partition(".")[2], {})[letter] = channel.pixels
    return {
        name: np.stack([np.float32(x[c]) for c in "RGB"], -1)
        for name, x in found.items()
        if {"R", "G", "B"} <= x.keys()
    }


def block_means(image: Any, side: int = 10) -> Any:
    """Return means over blocks of pixels, in which there is less noise."""
    height, width, channels = image.shape
    return image.reshape(height // side, side, width // side, side, channels).mean((1, 3))


@pytest.mark.nightly
@pytest.mark.long
@pytest.mark.parametrize("view", [nightly("Filmic"), "AgX"])
def test_known_lamps_are_found_from_a_picture_in_blenders_view(
    view: str, blender: list[str], tmp_path: Path, variables: dict[str, str]
) -> None:
    in_blender(blender, HERE / "known_lamps.py", tmp_path, view, variables=variables)
    answer = json.loads((tmp_path / "known.json").read_text())
    assert "apply or discard" in answer["message"]
    for name, found in answer["found"].items():
        # What is left of the noise, in a tone curve that is flat in its highlights.
        assert found == pytest.approx(answer["known"].get(name, 1.0), rel=0.1), name


@pytest.mark.nightly
def test_a_lamp_of_emitters_carries_its_drives(
    blender: list[str], tmp_path: Path, variables: dict[str, str]
) -> None:
    found = found_in_blender(blender, HERE / "lamp_drives.py", tmp_path, variables)
    assert found["before"] == {}
    assert [*found["shown"]] == ["Point"]
    # The drives mix the multiplier of the lamp: each emitter is six times one channel.
    drives = [found["shown"]["Point"][name] for name in ("red", "green", "blue")]
    assert np.allclose(6 * np.array(drives), found["factors"]["Point"], rtol=1e-5)
    assert found["discarded"] == {}
    assert found["applied"]["Point"] != found["shown"]["Point"]
    assert found["saved"] == found["applied"]
    assert found["reverted"] == {}
