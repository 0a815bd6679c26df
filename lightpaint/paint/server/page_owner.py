"""The page that owns the session, among clients whose connections may drop and come back."""

import asyncio

from lightpaint.paint.protocol import Closing, Message
from lightpaint.paint.server.client import Client
from lightpaint.paint.session_owner import SessionOwner


class PageOwner(SessionOwner[Client]):
    """The client that owns the session, if any; a page that reconnected is the same one."""

    def __init__(self) -> None:
        super().__init__(_is_same_page)
        self._leaving: asyncio.Future[None] | None = None

    async def release_disconnected(self, client: Client) -> None:
        """Take the session from another client that has disconnected, after all its requests."""
        while (page := self.page) not in (None, client) and page.is_disconnected:
            await page.wait_answered()
            self.release(page)

    def hand_over(self, client: Client) -> bool:
        """Give the session to `client`, and notify the client that had it.

        Returns whether `client` had the session before, and no other since.
        """
        is_back, displaced = self.give(client)
        if displaced is not None and _is_same_page(displaced, client):
            # The connection to it is lost.
            self._leaving = asyncio.ensure_future(displaced.close(1001))
        elif displaced is not None:
            displaced.send(taken_message("another tab has taken this session over"))
        return is_back


def taken_message(text: str) -> Message:
    """Return the notice to a client that does not have the session."""
    return Closing(reason="taken", text=text)


def _is_same_page(first: Client, second: Client) -> bool:
    """Return whether two connections belong to one page, which reconnected."""
    return first is second or (first.page != "" and first.page == second.page)
