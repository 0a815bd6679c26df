"""Observers: clients that receive lighting, looks and progress, and never have the session."""

from collections.abc import Collection

from lightpaint.errors import PaintError
from lightpaint.paint.protocol import (
    CanvasPatch,
    Event,
    Export,
    Fetch,
    Message,
    Propose,
    Request,
)
from lightpaint.paint.server.client import Client

#: Maximum number of observers.
MAX_OBSERVERS = 8


class Observers:
    """The observers among the clients of a session.

    clients: all of them, as they come and go.
    """

    def __init__(self, clients: Collection[Client]) -> None:
        self._clients = clients

    def admit(self, client: Client) -> None:
        """Make a client an observer, for good. Raises PaintError if there are too many."""
        others = [other for other in self._clients if other.is_observer and other is not client]
        if len(others) >= MAX_OBSERVERS:
            raise PaintError(f"{MAX_OBSERVERS} observers are there already: close one of them")
        client.is_observer = True

    def send(self, message: Message, but: Client | None = None) -> None:
        """Send observers the events that concern them; newer events replace those that wait."""
        event = message.answer if isinstance(message, CanvasPatch) else message
        if isinstance(event, Event) and event.is_observed:
            for client in self._clients:
                if client.is_observer and client is not but:
                    client.send(event)


def check_observer_request(request: Request | None) -> None:
    """Raise PaintError for requests that observers may not make."""
    is_export = isinstance(request, Export) and request.run
    if not (is_export or isinstance(request, Fetch | Propose)):
        raise PaintError(
            "an observer may fetch, export and propose: to paint, connect another client"
        )
