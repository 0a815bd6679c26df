"""What the page says of strokes: one message in flight, nothing lost."""

from typing import Any

import numpy as np
import pytest
from raw_message import RawMessage

from lightpaint.paint.message_frames import from_frame, parse_request, to_frame
from lightpaint.paint.protocol import VERSION


@pytest.fixture
def host_messages(page: Any) -> Any:
    """What is said to a host, after a script with `strokes`, `canvas` and `host`."""

    def run(script: str) -> Any:
        return page.evaluate(
            f"""async () => {{
                const {{ SlowHost, settle }} = await import("/fake_host.js");
                const {{ StrokeSender }} = await import("/engine/stroke_sender.js");
                const canvas = bench.plain(20, 30, 0);
                const host = new SlowHost();
                const strokes = new StrokeSender(
                    host, () => host.refused = true, (...details) => host.lost = details);
                strokes.paintOn(canvas, 0);
                {script}
            }}"""
        )

    return run


def test_one_message_is_in_flight_and_the_rest_is_merged(host_messages: Any):
    messages, flights = host_messages(
        """
        const flights = [];
        strokes.begin();
        for (const x of [0, 5, 9]) {
            strokes.touch([x, x + 2, x, x + 3]);
            flights.push(host.inFlight);
        }
        await host.answer();
        strokes.touch([1, 2, 1, 2]);
        flights.push(host.inFlight);
        strokes.end("brush");
        await host.answer();
        await host.answer();
        return [host.told, [...flights, host.inFlight]];
        """
    )
    assert flights == [1, 1, 1, 1, 0]
    assert [message["region"] for message in messages] == [
        [0, 2, 0, 3],
        [5, 11, 5, 12],
        [1, 2, 1, 2],
    ]
    assert [message["is_final"] for message in messages] == [False, False, True]
    assert {message["stroke"] for message in messages} == {1}
    assert messages[1]["shapes"] == {"image": [6, 7, 3], "importance": [6, 7]}
    assert messages[2]["label"] == "brush"


def test_a_message_has_what_was_done_until_it_is_sent(host_messages: Any):
    """As what the pointer did since the last frame."""
    messages, flights = host_messages(
        """
        const early = [[3, 4, 3, 4], [5, 7, 5, 8]];
        strokes.onBeforeSend = () => early.length && strokes.touch(early.shift());
        strokes.begin();
        strokes.touch([0, 2, 0, 3]);
        await host.answer();
        const flights = [host.inFlight];
        await host.answer();
        return [host.told, [...flights, host.inFlight]];
        """
    )
    assert flights == [1, 0]
    assert [message["region"] for message in messages] == [[0, 4, 0, 4], [5, 7, 5, 8]]


def test_a_stroke_that_is_sent_already_still_ends(host_messages: Any):
    messages = host_messages(
        """
        strokes.begin(); strokes.touch([3, 4, 5, 6]); await host.answer();
        strokes.end("brush"); await host.answer();
        return host.told;
        """
    )
    assert [(message["region"], message["is_final"]) for message in messages] == [
        ([3, 4, 5, 6], False),
        ([3, 3, 5, 5], True),
    ]


def test_what_is_done_is_sent_as_it_was_then(host_messages: Any):
    pixels = host_messages(
        """
        strokes.begin(); canvas.image.fill(1); strokes.touch([0, 2, 0, 2]);
        strokes.end("a");
        strokes.begin(); canvas.image.fill(2); strokes.touch([0, 2, 0, 2]);
        strokes.end("b");
        for (let k = 0; k < 3; k++) await host.answer();
        return host.requests.map(({ fields, arrays }) =>
            [fields.stroke, fields.is_final, ...arrays.image.data.slice(0, 1)]);
        """
    )
    assert pixels == [[1, False, 1], [1, True], [2, True, 2]]


def test_a_lost_connection_loses_no_stroke(host_messages: Any):
    messages = host_messages(
        """
        strokes.begin(); strokes.touch([0, 2, 0, 2]); await host.answer();
        strokes.touch([4, 6, 4, 6]); strokes.end("a");
        await host.lose();
        strokes.begin(); strokes.touch([8, 9, 8, 9]); strokes.end("b");
        strokes.begin(); strokes.touch([1, 2, 1, 2]); strokes.touch([3, 4, 3, 4]);
        host.requests.length = 0;
        await host.find(1);
        for (let k = 0; k < 3; k++) await host.answer();
        return host.told;
        """
    )
    assert [
        (message["stroke"], message["region"], message["is_final"]) for message in messages
    ] == [
        (1, [0, 6, 0, 6], True),  # whole, whatever was heard of it
        (2, [8, 9, 8, 9], True),
        (3, [1, 4, 1, 4], False),
    ]


def test_what_another_page_has_not_let_through_is_given_up(host_messages: Any):
    messages = host_messages(
        """
        strokes.begin(); strokes.touch([0, 2, 0, 2]); strokes.end("a");
        host.emit("closed", { kind: "closed", reason: "taken" });
        await host.lose();
        strokes.begin(); strokes.touch([8, 9, 8, 9]);
        host.requests.length = 0;
        host.emit("state", { kind: "state", stroke: 7, is_back: false });
        await host.find(7);
        const lost = host.lost;
        strokes.begin(); strokes.touch([1, 2, 1, 2]); strokes.end("b");
        await host.answer(); await host.answer();
        return [lost, host.told];
        """
    )
    assert messages[0] == [2, False]
    assert [
        (message["stroke"], message["region"], message["is_final"]) for message in messages[1]
    ] == [
        (8, [1, 2, 1, 2], False),
        (8, [1, 1, 1, 1], True),
    ]


def test_a_stroke_that_was_given_up_is_not_lost(host_messages: Any):
    lost_strokes = host_messages(
        """
        host.lost = null;
        strokes.begin(); strokes.touch([0, 2, 0, 2]); strokes.drop();
        await host.lose();
        strokes.dropUnsent(true);
        return host.lost;
        """
    )
    assert lost_strokes is None


def test_nothing_of_a_stroke_is_sent_again_as_pictures_come(host_messages: Any):
    messages = host_messages(
        """
        strokes.begin(); strokes.touch([0, 2, 0, 2]); await host.answer();
        host.emit("renewed", { kind: "renewed", resources: {} });
        strokes.touch([5, 6, 5, 6]);
        return host.told;
        """
    )
    assert [message["region"] for message in messages] == [[0, 2, 0, 2], [5, 6, 5, 6]]


def test_strokes_go_on_counting_where_the_session_is(host_messages: Any):
    assert (
        host_messages("await host.find(41); strokes.begin(); return strokes.currentStroke.stroke;")
        == 42
    )


def test_a_dropped_stroke_is_said_to_be_dropped_if_anything_of_it_was_said(host_messages: Any):
    messages = host_messages(
        """
        strokes.begin(); strokes.drop();
        strokes.begin(); strokes.touch([0, 2, 0, 2]); strokes.drop();
        await host.answer(); await host.answer("patch");
        return host.told;
        """
    )
    assert [(message["kind"], message["stroke"]) for message in messages] == [
        ("paint", 2),
        ("drop_stroke", 2),
    ]


def test_an_error_does_not_end_painting(host_messages: Any):
    messages, refusals = host_messages(
        """
        strokes.begin(); strokes.touch([0, 2, 0, 2]); await host.answer("failed");
        const before = host.refused;
        strokes.touch([2, 4, 0, 2]); strokes.end("a");
        await host.answer("failed"); await host.answer("failed");
        strokes.begin(); strokes.touch([0, 2, 0, 2]);
        return [host.told, [before ?? false, host.refused]];
        """
    )
    assert len(messages) == 4
    assert refusals == [False, True]


def test_what_else_is_said_comes_after_strokes_that_are_done(host_messages: Any):
    order = host_messages(
        """
        const order = [];
        strokes.begin(); strokes.touch([0, 2, 0, 2]); strokes.end("a");
        host.gate().then(() => order.push("undo"));
        await host.answer(); order.push("live");
        await host.answer(); order.push("done");
        return order;
        """
    )
    assert order in (["live", "undo", "done"], ["live", "done", "undo"])


def test_what_another_page_did_not_let_through_waits(host_messages: Any):
    messages, pending = host_messages(
        """
        strokes.begin(); strokes.touch([0, 2, 0, 2]); strokes.end("a");
        await host.answer();
        await host.answer("closed");
        const pending = strokes.isPending;
        host.emit("connection", { state: "open" });
        await host.answer();
        return [host.told, [pending, strokes.isPending]];
        """
    )
    assert [message["is_final"] for message in messages] == [False, True, True]
    assert messages[-1]["region"] == [0, 2, 0, 2]  # whole
    assert pending == [True, False]


def test_frames_are_those_of_the_library(page: Any):
    image = np.arange(24, dtype=np.float32).reshape(2, 4, 3)
    frame = page.evaluate(
        """async () => {
            const { encodeFrame } = await import("/engine/message_frames.js");
            const data = Float32Array.from({ length: 24 }, (_, i) => i);
            const image = { data, shape: [2, 4, 3] };
            const importance = { data: new Float32Array(8).fill(1), shape: [2, 4] };
            const fields = { kind: "paint", seq: 7, stroke: 3, region: [1, 3, 2, 6],
                is_final: true, label: "Pinsel – größer" };
            return Array.from(new Uint8Array(encodeFrame(fields, { image, importance })));
        }"""
    )
    content, buffers = from_frame(bytes(frame))
    seq, request, arrays = parse_request(content, buffers)
    assert (seq, request.stroke, request.region, request.is_final) == (7, 3, (1, 3, 2, 6), True)
    assert request.label == "Pinsel – größer"
    np.testing.assert_array_equal(arrays["image"], image)
    np.testing.assert_array_equal(arrays["importance"], 1)
    # And back.
    weights = np.random.default_rng(0).random((3, 3))
    message = RawMessage("answer", {"stroke": 3, "name": "é"}, {"weights": weights, "b": image[0]})
    sent_frame = list(to_frame(message.content(7), message.buffers()))
    echoed = page.evaluate(
        """async (bytes) => {
            const { decodeFrame } = await import("/engine/message_frames.js");
            const made = decodeFrame(Uint8Array.from(bytes).buffer);
            const { weights, b } = made.arrays;
            return [made.kind, made.reply, made.name, Array.from(weights.data), weights.shape,
                Array.from(b.data)];
        }""",
        sent_frame,
    )
    assert echoed[:3] == ["answer", 7, "é"]
    np.testing.assert_array_equal(np.reshape(echoed[3], echoed[4]), weights)
    np.testing.assert_array_equal(echoed[5], image[0].ravel())


def test_a_socket_says_hello_again_and_numbers_what_it_says(page: Any, tab: Any, site: Any):
    site.arrays["plane/0"] = np.arange(6, dtype=np.float16).reshape(1, 2, 3)
    site.arrays["lut/ocio:A B/c"] = np.zeros((2, 2), np.uint8)
    messages = page.evaluate(
        """async () => {
            const { FakeSocket, settle } = await import("/fake_host.js");
            const { encodeFrame, decodeFrame } = await import("/engine/message_frames.js");
            const { SocketHost } = await import("/engine/socket_host.js");
            const real = window.WebSocket;
            window.WebSocket = FakeSocket;
            const host = new SocketHost(document.baseURI, { key: async () => "k" });
            const heard = [];
            const early = await host.send("undo").catch((error) => error.message);
            host.on("connection", ({ state }) => heard.push(state));
            host.on("answer", ({ reply }) => heard.push(`answer ${reply}`));
            await host.open();
            const [first] = FakeSocket.made;
            first.open();
            first.receive(encodeFrame({ kind: "state", reply: 1, resources: { "plane/0": 4 } }));
            const answered = host.send("undo");
            const lost = host.send("redo").catch((error) => error.message);
            await settle();
            const sent = first.sent.map(decodeFrame).map(({ kind, seq }) => [kind, seq]);
            first.receive(encodeFrame({ kind: "answer", reply: 2 }));
            const reply = (await answered).reply;
            host.retryDelay = 1;
            first.close();
            await new Promise((done) => setTimeout(done, 20));
            const second = FakeSocket.made[1];
            second.open();
            await settle();
            const again = second.sent.map(decodeFrame).map(({ kind, version }) => [kind, version]);
            second.receive(encodeFrame({ kind: "state", reply: 4, resources: { "plane/0": 4 } }));
            const picture = await host.fetch("plane/0");
            const other = await host.fetch("lut/ocio:A B/c");
            const none = await host.fetch("nothing").catch((error) => error.message);
            host.close();
            window.WebSocket = real;
            return { heard, early, sent, reply, lost: await lost, again, none,
                urls: FakeSocket.made.map((one) => one.url.replace(/=.*/, "")),
                picture: [picture.shape, Array.from(picture.data)], other: other.shape };
        }"""
    )
    assert messages["heard"] == ["open", "answer 2", "lost", "open"]
    assert messages["sent"] == [["hello", 1], ["undo", 2], ["redo", 3]]
    assert (messages["reply"], messages["again"]) == (2, [["hello", VERSION]])
    assert "no connection" in messages["early"]
    assert "lost" in messages["lost"]
    assert messages["urls"] == [f"{site.url.replace('http', 'ws')}/live?page"] * 2
    bits = np.arange(6, dtype=np.float16).view(np.uint16).tolist()
    assert messages["picture"] == [[1, 2, 3], bits]
    assert messages["other"] == [2, 2]
    assert "there is no such picture" in messages["none"]
    [line] = tab[1]
    assert "404" in line
    tab[1].clear()
