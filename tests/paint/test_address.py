"""Where the painter's server listens: what is open is known, and the address that is said works."""

import socket
import threading
import urllib.request
from contextlib import closing
from typing import Any

import pytest
from fake_session import FakeSession
from patience import PATIENCE_S

from lightpaint.errors import PaintError
from lightpaint.paint.server import address
from lightpaint.paint.server.address import Reach, listen
from lightpaint.paint.server.page_server import Server


def has_ipv6() -> bool:
    try:
        socket.create_server(("::1", 0), family=socket.AF_INET6).close()
    except OSError:
        return False
    return True


IPV6 = pytest.mark.skipif(not has_ipv6(), reason="no IPv6")


def test_a_taken_port_is_told_and_the_usual_one_given_up() -> None:
    taken_socket, taken_address = listen("127.0.0.1", 0)
    with taken_socket:
        with pytest.raises(
            PaintError, match=f"cannot listen at 127.0.0.1:{taken_address.port}: .*port="
        ):
            listen("127.0.0.1", taken_address.port)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(address, "DEFAULT_PORT", taken_address.port)
            other, next_address = listen()
            other.close()
            assert next_address.port not in (0, taken_address.port)
    with pytest.raises(PaintError, match="cannot listen"):
        listen("127.0.0.1", 70000)


def test_by_itself_it_listens_to_the_machine_only() -> None:
    server = Server(FakeSession(), port=0)
    assert server._socket.getsockname()[0] == "127.0.0.1"
    assert server.url.startswith(f"http://127.0.0.1:{server.port}/#token=")
    assert server.one_time_url() != server.url
    server.close()


@pytest.mark.parametrize(
    ("host", "name", "reach"),
    [
        (None, "127.0.0.1", Reach.MACHINE),
        ("127.0.0.2", "127.0.0.2", Reach.MACHINE),
        ("127.1", "127.0.0.1", Reach.MACHINE),
        ("localhost", "localhost", Reach.MACHINE),
        ("LOCALHOST", "localhost", Reach.MACHINE),
        ("0.0.0.0", "", Reach.ALL),
        ("0", "", Reach.ALL),
        pytest.param("::1", "[::1]", Reach.MACHINE, marks=IPV6),
        pytest.param("[::1]", "[::1]", Reach.MACHINE, marks=IPV6),
        pytest.param("::", "", Reach.ALL, marks=IPV6),
    ],
)
def test_who_can_reach_it_is_known_and_its_address_leads_there(
    host: str | None, name: str, reach: Reach
) -> None:
    listener, its_address = listen(host, 0)
    with listener:
        listener.settimeout(PATIENCE_S)
        listener.accept()[0].close()  # it has been tried
        assert its_address.reach is reach
        assert its_address.name == (name or its_address.name)
        assert its_address.name not in ("", "0.0.0.0", "[::]", "::")
        for url in (its_address.url, its_address.local_url):
            place = url.removeprefix("http://").rstrip("/").rpartition(":")[0].strip("[]")
            with closing(socket.create_connection((place, its_address.port), 60)):
                listener.accept()[0].close()


@IPV6
def test_an_address_of_ipv6_alone_leads_there_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket, "has_dualstack_ipv6", lambda: False)
    listener, bound_address = listen("::", 0)
    with listener:
        for url in (bound_address.url, bound_address.local_url):
            place = url.removeprefix("http://").rstrip("/").rpartition(":")[0].strip("[]")
            socket.create_connection((place, bound_address.port), 60).close()


@pytest.mark.parametrize(
    "host",
    [
        "",
        " ",
        "[]",
        "no.such.name.invalid",
        "a b",
        "http://127.0.0.1",
        "127.0.0.1:9000",
        "256.0.0.1",
        "203.0.113.7",  # of no machine: RFC 5737
        "255.255.255.255",
        "224.0.0.1",
        "fe80::1%lo",
        "é" * 70,
        "127.0.0.1\n",
        "\0",
        "\ud800",
    ],
)
def test_a_wrong_host_is_one_line_that_says_what_to_give(host: str) -> None:
    with pytest.raises(PaintError) as refusal:
        listen(host, 0)
    message = str(refusal.value)
    assert "give an address of this machine, 0.0.0.0 for all of them, or leave it out" in message
    assert "\n" not in message
    assert len(message) < 300


def test_the_page_is_there_where_the_address_says(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where this machine has a name that leads nowhere."""
    monkeypatch.setattr(socket, "gethostname", lambda: "no.such.name.invalid")
    server: Any = Server(FakeSession(), host="0.0.0.0", port=0)
    serving = threading.Thread(target=server.run, daemon=True)
    serving.start()
    try:
        for url in (server.url, server.one_time_url()):
            with urllib.request.urlopen(url, timeout=PATIENCE_S) as answer:
                assert answer.status == 200
    finally:
        server.stop()
        serving.join(60)
        server.close()
