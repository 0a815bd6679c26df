"""The session that page tests make up says what a real one could, in the protocol's messages."""

from dataclasses import MISSING, fields, make_dataclass
from typing import Any, get_origin, get_type_hints

import numpy as np
import pytest

from lightpaint.paint.protocol import Event, Request
from lightpaint.storage.json_records import read_record

#: One request of each kind that the page sends.
ASKED = {
    "paint": {"stroke": 1, "region": [0, 1, 0, 1], "is_final": True, "label": "brush"},
    "drop_stroke": {"stroke": 2},
    "constrain_light": {"light": 0, "constraints": {"off": True}, "is_final": True},
    "constrain_lights": {"constraints": {}, "label": "2 lights", "is_final": True},
    "set_master": {"level": 0.7},
    "tie": {"ties": []},
    "change_settings": {"settings": {"hold": 1}},
    "preview": {"number": 1, "view": 0},
    "save_look": {"name": "one"},
    "copy_look": {"look": 1},
    "mix_looks": {"first": 1, "second": 2, "part": 0.5, "name": "between"},
    "rename_look": {"look": 1, "name": "two"},
    "load_look": {"look": 1},
    "drop_look": {"look": 3},
    "undo": {},
    "redo": {},
    "list_steps": {"count": 3},
    "go_to_step": {"step": 1},
    "show_previous": {},
    "clear_painting": {},
    "apply_preset": {"preset": "moonlight"},
    "look_like": {"reference": 1, "areas": "whole"},
    "drop_reference": {"reference": 1},
    "start_over": {},
    "export": {"outputs": ["target", "lighting"]},
    "render_final": {"name": "Act 1", "width": 1920, "spp": 64, "formats": ["png"]},
    "stop_render": {"render": 1},
    "drop_render": {"render": 1},
    "verify": {"run": True},
    "explain": {"view": 0},
    "show_rig": {},
    "take_over": {},
}

#: Requests of a rig, layers, a selection and lamps, which the session that tests make up lacks.
RIG = {"move", "point", "place", "add_light", "remove_light", "change_layers", "select"}
RIG |= {"estimate_place", "compare_looks", "import_layers", "add_reference", "mix"}
RIG |= {"start_from_lamps", "switch_console", "black_out"}


def check(message: dict[str, Any]) -> None:
    """Fail unless the dataclass of its kind could have said it."""
    event = Event.kinds[message["kind"]]
    hints, known_fields = get_type_hints(event), {spec.name: spec for spec in fields(event)}
    arrays = {name for name in known_fields if get_origin(hints[name]) is np.ndarray}
    plain = {k: v for k, v in message.items() if k not in ("kind", "reply", "arrays")}
    assert set(plain) <= set(known_fields), (message["kind"], set(plain) - set(known_fields))
    assert set(message["arrays"]) <= arrays
    for name, value in plain.items():
        read_record(make_dataclass("One", [(name, hints[name])]), {name: value})
    needed = {k for k, spec in known_fields.items() if spec.default is MISSING and k not in arrays}
    assert needed <= set(plain), (message["kind"], needed - set(plain))


@pytest.mark.nightly
def test_a_made_up_session_says_what_a_real_one_could(painter: Any) -> None:
    assert set(ASKED) == set(Request.kinds) - {"hello", "fetch", "observe", "propose", *RIG}
    messages = painter.page.evaluate(
        """async (asked) => {
            const told = [];
            const tell = host.tell.bind(host);
            host.tell = (message) => (told.push(message), tell(message));
            const pixel = { image: { data: new Float32Array(3), shape: [1, 1, 3] } };
            for (const [kind, fields] of Object.entries(asked))
                await host.send(kind, fields, pixel);
            await new Promise((done) => setTimeout(done, 50));
            return told.map((one) => ({ ...one, arrays: Object.fromEntries(
                Object.entries(one.arrays ?? {}).map(([name, { shape }]) => [name, shape])) }));
        }""",
        ASKED,
    )
    assert {message["kind"] for message in messages} >= {
        "state",
        "answer",
        "patch",
        "looks",
        "exported",
    }
    assert [message for message in messages if message["kind"] == "failed"] == []
    for message in messages:
        check(message)
