"""A publisher sends what threads make in the order in which it was made, and nothing at the end."""

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from lightpaint.errors import PaintError
from lightpaint.paint.background_threads import StoppedError
from lightpaint.paint.protocol import Message, Notice
from lightpaint.paint.session_access import Publisher, SessionAccess


@pytest.fixture
def lock() -> threading.RLock:  # type: ignore[valid-type]
    return threading.RLock()


@pytest.fixture
def publisher(lock: threading.RLock) -> Publisher:  # type: ignore[valid-type]
    return Publisher(lock)


def test_messages_of_two_threads_are_sent_in_the_order_in_which_they_were_made(
    publisher: Publisher,
) -> None:
    """The first is still being sent when the second could be made."""
    made_names: list[str] = []
    sent: list[str] = []
    is_sending, another_waits = threading.Event(), threading.Event()

    def receive(message: Message) -> None:
        if message.fields["text"] == "0":
            is_sending.set()
            another_waits.wait(0.2)
        sent.append(message.fields["text"])

    def make() -> Message:
        made_names.append(str(len(made_names)))
        return Notice(text=made_names[-1], tone="info")

    def publish_second() -> None:
        assert is_sending.wait(10)
        publisher.publish_made(make)
        another_waits.set()

    publisher.on_message = receive
    with ThreadPoolExecutor(2) as threads:
        futures = threads.submit(publish_second), threads.submit(publisher.publish_made, make)
        for it in futures:
            it.result(10)
    assert made_names == sent == ["0", "1"]


@pytest.mark.parametrize("count", [1, 3])
def test_a_message_is_made_under_the_lock_of_the_session_and_sent_without(
    publisher: Publisher,
    lock: threading.RLock,  # type: ignore[valid-type]
    count: int,
) -> None:
    def is_free() -> bool:
        """As another thread sees it: this one could take the lock twice."""
        with ThreadPoolExecutor(1) as another:
            return another.submit(take).result()

    def take() -> bool:
        has_lock = lock.acquire(timeout=0.05)
        if has_lock:
            lock.release()
        return has_lock

    free_while: dict[str, list[bool]] = {"made": [], "sent": []}

    def make() -> list[Message]:
        free_while["made"].append(is_free())
        return [Notice(text=str(k), tone="info") for k in range(count)]

    publisher.on_message = lambda _: free_while["sent"].append(is_free())
    messages = publisher.publish_all_made(make)
    assert len(messages) == count
    assert free_while == {"made": [False], "sent": [True] * count}


def test_a_picture_is_there_before_a_page_hears_of_it(publisher: Publisher) -> None:
    picture = np.ones((2, 3), np.float16)
    fetched: list[bool] = []

    def fetch(message: Message) -> None:
        [name] = message.fields["resources"]
        fetched.append(publisher.pictures[name] is picture)

    publisher.on_message = fetch
    publisher.publish_picture("verified", picture)
    assert fetched == [True]


def test_a_picture_that_is_replaced_has_another_generation(publisher: Publisher) -> None:
    generations: list[int] = []
    publisher.on_message = lambda message: generations.append(
        message.fields["resources"]["verified"]
    )
    for _ in range(2):
        publisher.publish_picture("verified", np.ones((2, 3), np.float16))
    assert len(set(generations)) == 2


@pytest.mark.parametrize(
    "send",
    [
        lambda it: it.publish(Notice(text="late", tone="info")),
        lambda it: it.publish_made(lambda: Notice(text="late", tone="info")),
        lambda it: it.publish_picture("verified", np.ones((2, 3), np.float16)),
    ],
)
def test_nothing_is_sent_after_the_end(
    publisher: Publisher, send: Callable[[Publisher], None]
) -> None:
    received: list[Message] = []
    publisher.on_message = received.append
    send(publisher)
    assert len(received) == 1
    publisher.close()
    send(publisher)
    assert len(received) == 1


def test_a_report_of_progress_ends_its_task_after_the_end(publisher: Publisher) -> None:
    publisher.report_progress("lights", 1, 4)
    assert publisher.last_progress is not None
    assert (publisher.last_progress.done, publisher.last_progress.total) == (1, 4)
    publisher.close()
    with pytest.raises(StoppedError):
        publisher.report_progress("lights", 2, 4)


def test_who_asks_for_a_session_hears_why_there_is_none() -> None:
    access = SessionAccess()
    assert access.store is access.snapshot_at_rest() is None
    with pytest.raises(PaintError, match="the first picture is still being rendered"):
        access.snapshot()
    access.failure_text = "the scene has no lights"
    for ask in (lambda: access.session, lambda: access.looks, access.snapshot_and_lighting):
        with pytest.raises(PaintError, match="the scene has no lights"):
            ask()
