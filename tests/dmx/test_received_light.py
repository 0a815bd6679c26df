"""From known drives to a picture, a solve, packets, a receiver, and Mitsuba: the whole way.

Fixtures hang straight or turned: a matrix read the wrong way round passes on the first and lights
the floor metres away on the second.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from patience import PATIENCE_S
from rig_files import channel, fixture, gdtf, layered, write_mvr

import lightpaint as lp
from lightpaint.dmx.console_link import ConsoleLink
from lightpaint.dmx.console_receiver import ConsoleReceiver
from lightpaint.dmx.console_rig import ConsoleRig
from lightpaint.dmx.console_target import PROTOCOLS, network_universes
from lightpaint.dmx.levels import decode_levels, drives_of
from lightpaint.dmx.mvr import read_rig
from lightpaint.dmx.rig_scene import cd_per_unit, lights_text, room_of_show, scene_text
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.unknowns.reduction import reduce_to
from lightpaint.scene.quality_presets import on_film
from lightpaint.scene.scene_render import Stream, render

SPP, SIZE, NOISE = 64, "64x36", 0.02

#: Axes of a fixture that hangs straight, and of one that is turned about two of its axes.
STRAIGHT = "{1,0,0}{0,1,0}{0,0,1}"
TURNED = "{0.6,0.8,0}{-0.7518,0.5638,0.342}{0.2736,-0.2052,0.9397}"

RGB = (
    '<Emitter Name="Red" Color="0.69,0.309,20"/><Emitter Name="Green" Color="0.18,0.715,40"/>'
    '<Emitter Name="Blue" Color="0.15,0.03,8"/>'
)
RGB_16 = channel("Dimmer", "1,2") + "".join(
    channel(f"ColorAdd_{x}", f"{3 + 2 * k},{4 + 2 * k}") for k, x in enumerate("RGB")
)


def _rig(folder: Path, axes: str) -> ConsoleRig:
    types = gdtf(RGB_16, described=f"<Emitters>{RGB}</Emitters>")
    hung = [
        fixture(f"lamp {k}", number=str(k), address=str(1 + 20 * k), matrix=f"{axes}{{{x},0,4000}}")
        for k, x in enumerate((-1500, 0, 1500), start=1)
    ]
    return read_rig(write_mvr(folder / "show.mvr", layered(*hung), lamp=types))


def _basis(rig: ConsoleRig, folder: Path) -> Any:
    """The scene of a rig above a floor, its basis, constraints, and the lamps of its lights."""
    unit, file = cd_per_unit(rig), folder / "rig.xml"
    file.write_text(scene_text(rig, unit, room_of_show(folder / "show.mvr", ()).room), "utf-8")
    lights = folder / "rig.lights.toml"
    lights.write_text(lights_text(rig, unit), "utf-8")
    scene = on_film(lp.load_scene(file), None, SIZE)
    basis = lp.render_basis(scene, spp=SPP, seed=1)
    constraints = lp.read_constraints(lights)
    return scene, basis, constraints, reduce_to(constraints, basis.lights).lamps


def _received(rig: ConsoleRig, drives: Any, scheme: str) -> Any:
    protocol = PROTOCOLS[scheme]
    numbers = network_universes(rig, protocol)
    with ConsoleReceiver.open(protocol, port=0) as receiver:
        target = f"{scheme}://127.0.0.1:{receiver.port}"
        with ConsoleLink.open(target, rig) as link:
            link.show(drives)
            while len(receiver.levels) < len(numbers):
                receiver.receive(PATIENCE_S)
    return decode_levels(rig, {own: receiver.levels[x] for own, x in numbers.items()})


def _error(picture: Any, truth: Any) -> float:
    return float(np.sqrt(np.square(picture - truth).sum() / np.square(truth).sum()))


def _blocks(picture: Any) -> Any:
    """Means of 4 x 4 pixels, which have a quarter of their noise."""
    h, w, _ = picture.shape
    return picture.reshape(h // 4, 4, w // 4, 4, 3).mean((1, 3))


@pytest.mark.parametrize("axes", [STRAIGHT, TURNED])
@pytest.mark.parametrize("scheme", ["sacn", "artnet"])
def test_the_light_of_what_arrives_is_that_of_the_painting(
    axes: str, scheme: str, tmp_path: Path
) -> None:
    rig = _rig(tmp_path, axes)
    scene, basis, constraints, lamps = _basis(rig, tmp_path)
    # Beams go along −z of the fixture, the third row of its matrix.
    row = [float(x) for x in axes.rstrip("}").rpartition("{")[2].split(",")]
    ways = [emitter.site.direction for emitter in scene.emitters]
    assert np.allclose(ways, -np.array(row) / np.linalg.norm(row), atol=1e-5)
    rng = np.random.default_rng(5)
    true = np.array([lamps[k].mix(rng.uniform(0, 1, 3)) for k in range(3)])
    truth = basis.mix(true)
    noisy = truth * (1 + NOISE * rng.standard_normal(truth.shape[:2]))[..., None]
    counted = np.ones(truth.shape[:2], np.float32)
    target = lp.Target("noisy", noisy.astype(np.float32), counted, everything=True)
    lighting = lp.solve(basis, target, constraints=constraints, literal=True).lighting
    arrived = _received(rig, drives_of(lighting), scheme)
    drives = [np.array([*arrived[name].values()]) for name in basis.names]
    weights = np.array([lamps[k].mix(x) for k, x in enumerate(drives)])
    assert _error(basis.mix(weights), truth) <= 0.005
    if scheme == "artnet":  # of which an equal picture arrived
        return
    lighting = Lighting.of_weights(basis, weights, lamps=lamps)
    relit = on_film(lp.relight(scene, lighting, tmp_path / "relit.xml"), None, SIZE)
    rendered = render(relit, spp=SPP, seed=2, stream=Stream.VERIFICATION).image
    # Means over the floor, whose noise per pixel is some percent of it.
    assert np.allclose(rendered.mean((0, 1)), truth.mean((0, 1)), rtol=0.01)
    spots = [_blocks(picture).ravel() for picture in (rendered, truth)]
    assert np.corrcoef(spots)[0, 1] > 0.99  # it is at the same places
