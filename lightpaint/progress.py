"""Telling whoever waits how far long work has come.

Rooms report through a plain callable, so that a terminal, a notebook and a test can all
listen; which of them listens is the caller's choice.
"""

from typing import Protocol


class Progress(Protocol):
    """Called after each finished piece of work."""

    def __call__(self, label: str, done: int, total: int) -> None:
        """`done` of `total` pieces of the work named `label` are finished."""


def silent(label: str, done: int, total: int) -> None:
    """The progress report of whoever does not listen."""
