"""A session whose sky is an image: its texels are painted, undone, kept, and exported."""

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from renderer import LIGHTS, write_room

from lightpaint.errors import PaintError
from lightpaint.paint import protocol
from lightpaint.paint.protocol import Message
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.studio.session_studio import Studio
from lightpaint.paint.subject import session_identity
from lightpaint.paint.subject_factory import make_subject
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import SceneFile
from lightpaint.scene.properties.emission import read_emitted_image

#: The radiance of a painted texel.
ORANGE = (1.5, 0.5, 0.1)


class SkyStudio:
    """A studio of a room under a sky of 4 by 3 texels, and all that it says.

    split: layout of the texels.
    """

    def __init__(self, folder: Path, split: str = "4x3") -> None:
        path = folder / "room.xml"
        if not path.exists():
            write_room(folder, lights=LIGHTS["sky"] + LIGHTS["bulb"])
        scene = SceneFile(str(path), split={"sky": split})
        subject = make_subject(scene, folder / "session", settings=Settings(spp=4))
        (folder / "session").mkdir(exist_ok=True)
        self.messages: list[Message] = []
        self.studio = Studio([subject], lambda x: Store.open(folder / "session" / "session.db", x))
        self.studio.on_message = self.messages.append
        self.studio.start()
        self.wait(lambda m: m.kind == "state" and m.fields["basis"]["is_complete"])

    def wait(self, is_match: Any) -> Message:
        """Return the first message, from now or from before, that matches."""
        end = time.monotonic() + 60
        while time.monotonic() < end:
            for message in list(self.messages):
                if is_match(message):
                    return message
            time.sleep(0.02)
        raise AssertionError([m.fields.get("text", m.kind) for m in self.messages])

    def close(self) -> None:
        self.studio.close()
        self.studio.wait()


@pytest.mark.nightly
@pytest.mark.usefixtures("without_reasons")
@pytest.mark.filterwarnings("ignore:.*samples.*")
def test_painted_texels_are_undone_kept_and_exported(tmp_path: Path) -> None:
    sky = SkyStudio(tmp_path)
    [image] = sky.studio.state().fields["images"]
    lights = sky.studio.state().fields["lights"]
    assert image["name"] == "sky"
    assert [lights[k]["name"] for k in image["places"][1]] == [f"sky.x{x}.y1" for x in range(4)]
    assert np.sum(image["shares"]) == pytest.approx(1)
    assert image["aspect"] == 2
    k = image["places"][1][2]
    before = sky.studio.session.weights.copy()
    locks = {name: {"lock": list(ORANGE)} for name in ("sky.x2.y1", "sky.x3.y1")}
    sky.studio.handle(protocol.ConstrainLights(locks, label="2 texels of sky, painted"), {})
    np.testing.assert_allclose(sky.studio.session.weights[k], ORANGE)
    sky.studio.handle(protocol.Undo(), {})
    np.testing.assert_allclose(sky.studio.session.weights, before)
    sky.studio.handle(protocol.Redo(), {})
    sky.close()

    again = SkyStudio(tmp_path)
    np.testing.assert_allclose(again.studio.session.weights[k], ORANGE)
    assert again.studio.state().fields["history"]["undo"] == ["2 texels of sky, painted"]
    again.studio.handle(protocol.Export(("lighting", "relit")), {})
    again.wait(lambda m: m.kind == "exported")
    written = read_emitted_image(tmp_path / "session" / "relit.sky.exr", is_linear=True)
    np.testing.assert_allclose(written[1, 2:], [ORANGE, ORANGE], rtol=1e-3)  # halves
    np.testing.assert_allclose(written[1, 0], before[image["places"][1][0]], rtol=1e-3)
    again.close()
    whole = make_subject(SceneFile(str(tmp_path / "room.xml")), settings=Settings(spp=4))
    identity = session_identity([replace(whole, basis=next(whole.bases()))])
    with pytest.raises(PaintError, match=r"lights 12 texels of sky, bulb, and .* has sky, bulb:"):
        Store.open(tmp_path / "session" / "session.db", identity)


@pytest.mark.nightly
@pytest.mark.usefixtures("without_reasons")
@pytest.mark.filterwarnings("ignore:.*samples.*")
def test_limits_of_locked_texels_are_known_after_a_restart(tmp_path: Path) -> None:
    """A lock takes their place until it is gone; they can change meanwhile, and be undone."""
    sky, limits = SkyStudio(tmp_path), {"limits": {"max": 2.0}}
    texels = [f"sky.x{x}.y1" for x in range(3)]
    sky.studio.handle(protocol.ConstrainLights(dict.fromkeys(texels, limits)), {})
    for rgb in (ORANGE, (1.0, 1.0, 1.0)):
        locks = {name: {"lock": list(rgb)} for name in texels[:2]}
        sky.studio.handle(protocol.ConstrainLights(locks), {})
    kelvin = {"kelvin": [3000, 6000]}
    change = protocol.ConstrainLights({texels[2]: kelvin}, earlier={texels[1]: kelvin})
    sky.studio.handle(change, {})
    sky.close()

    again = SkyStudio(tmp_path)
    assert again.studio.state().fields["earlier"] == {texels[0]: limits, texels[1]: kelvin}
    again.studio.handle(protocol.Undo(), {})
    assert again.studio.state().fields["earlier"] == dict.fromkeys(texels[:2], limits)
    again.studio.handle(protocol.ConstrainLights({texels[0]: limits}), {})
    state = again.studio.state().fields
    assert state["earlier"] == {texels[1]: limits}
    assert state["constraints"][texels[0]] == limits
    again.close()


@pytest.mark.nightly
@pytest.mark.usefixtures("without_reasons")
@pytest.mark.filterwarnings("ignore:.*samples.*")
def test_finer_texels_of_a_sun_are_painted_and_exported(tmp_path: Path) -> None:
    sky = SkyStudio(tmp_path, "4x3+x1.y1")
    [image] = sky.studio.state().fields["images"]
    names = np.array([x["name"] for x in sky.studio.state().fields["lights"]])
    places = np.array(image["places"])
    assert places.shape == (7, 12)
    assert len(np.unique(places)) == 12 - 1 + 25
    assert names[places[3, 4]] == "sky.sun1.x4.y3"
    assert set(names[places[2:5, 9:]].ravel()) == {"sky.x3.y1"}
    assert np.sum(image["shares"]) == pytest.approx(1, abs=1e-4)
    locks = {"sky.sun1.x4.y3": {"lock": list(ORANGE)}}
    sky.studio.handle(protocol.ConstrainLights(locks, label="sky.sun1.x4.y3, painted"), {})
    sky.studio.handle(protocol.Export(("lighting", "relit")), {})
    sky.wait(lambda m: m.kind == "exported")
    written = read_emitted_image(tmp_path / "session" / "relit.sky.exr", is_linear=True)
    assert written.shape == (7, 12, 3)
    np.testing.assert_allclose(written[3, 4], ORANGE, rtol=1e-3)  # halves
    sky.close()
