"""The owner of a session: one page at a time, over any kind of connection."""

from collections.abc import Callable
from operator import eq
from typing import Generic, NamedTuple, TypeVar

_Page = TypeVar("_Page")


class Transfer(NamedTuple, Generic[_Page]):
    """A session that was given to a page.

    is_back: whether the page had it before, and no other since. displaced: the connection that lost
    it and must be notified; None for none.
    """

    is_back: bool
    displaced: _Page | None


class SessionOwner(Generic[_Page]):
    """The page that owns a session, if any.

    is_same: whether two connections belong to one page, which reconnected.

    Attributes:
        page: The connection that has the session.
    """

    def __init__(self, is_same: Callable[[_Page, _Page], bool] = eq) -> None:
        self.page: _Page | None = None
        self._last: _Page | None = None
        self._is_same = is_same

    def is_free_for(self, page: _Page) -> bool:
        """Return whether `page` may have the session without taking it from another."""
        return self.page is None or self._is_same(self.page, page)

    def give(self, page: _Page) -> Transfer[_Page]:
        """Give the session to `page`, even if another page has it."""
        is_back = self._last is not None and self._is_same(self._last, page)
        displaced = self.page if self.page != page else None
        self.page = self._last = page
        return Transfer(is_back, displaced)

    def release(self, page: _Page) -> bool:
        """Take the session from `page`, which has left; return whether it had it."""
        has_had = self.page == page
        if has_had:
            self.page = None
        return has_had
