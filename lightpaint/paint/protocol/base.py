"""The base of all messages: conversion of fields to JSON, and of arrays to bytes."""

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

#: Element types of arrays in messages, and their byte formats.
DTYPES = {"float16": "<f2", "float32": "<f4", "float64": "<f8", "int16": "<i2", "uint8": "|u1"}


#: Metadata of a field that a message omits while it is None.
OPTIONAL = {"is_optional": True}


class Message:
    """Base of all messages: a frozen dataclass, whose arrays travel beside the JSON of its other
    fields.

    Attributes:
        kind: Names the message in its JSON.
        request_buffers: Arrays that a client sends beside a message, with their meanings.
    """

    kind: ClassVar[str] = ""
    request_buffers: ClassVar[Mapping[str, str]] = {}

    def __init_subclass__(cls, *, kind: str = "", **options: Any) -> None:
        super().__init_subclass__(**options)
        cls.kind = kind or cls.kind

    @property
    def fields(self) -> dict[str, Any]:
        """The fields other than arrays, as plain JSON values."""
        return {k: plain(v) for k, v in _sent_fields(self).items() if not isinstance(v, np.ndarray)}

    @property
    def arrays(self) -> dict[str, npt.NDArray[Any]]:
        """The arrays by name."""
        return {k: v for k, v in _sent_fields(self).items() if isinstance(v, np.ndarray)}

    def content(self, reply: int | None = None) -> dict[str, Any]:
        """Return the JSON. reply: number of the message that this one answers."""
        content_fields: dict[str, Any] = {"kind": self.kind, **self.fields}
        if reply is not None:
            content_fields["reply"] = reply
        content_fields["buffers"] = [
            {"name": name, "dtype": _dtype(array), "shape": list(array.shape)}
            for name, array in self.arrays.items()
        ]
        return content_fields

    def buffers(self) -> list[bytes]:
        """Return the arrays as bytes, little endian, in order."""
        return [
            np.ascontiguousarray(array, DTYPES[_dtype(array)]).tobytes()
            for array in self.arrays.values()
        ]


class Request(Message):
    """Base of what clients ask of the session. A subclass with a kind is known by it.

    Attributes:
        kinds: All requests by kind.
    """

    kinds: ClassVar[dict[str, type[Any]]] = {}

    def __init_subclass__(cls, *, kind: str = "", **options: Any) -> None:
        super().__init_subclass__(kind=kind, **options)
        _register(cls, Request.kinds)


class Event(Message):
    """Base of what the session tells its clients. A subclass with a kind is known by it.

    Attributes:
        kinds: All events by kind.
        is_observed: Whether observers receive it.
    """

    kinds: ClassVar[dict[str, type[Any]]] = {}
    is_observed: ClassVar[bool] = False

    def __init_subclass__(
        cls, *, kind: str = "", is_observed: bool = False, **options: Any
    ) -> None:
        super().__init_subclass__(kind=kind, **options)
        cls.is_observed = is_observed
        _register(cls, Event.kinds)


def _register(message: type[Message], kinds: dict[str, type[Any]]) -> None:
    """Add a message to those known by kind. Raises ValueError for a kind that is taken."""
    if kinds.setdefault(message.kind, message) is not message:
        raise ValueError(f"{message.__name__} and {kinds[message.kind].__name__} are one kind")


def plain(value: Any) -> Any:
    """Return values of JSON for dataclasses, tuples and NumPy's numbers; NaN and Inf are null."""
    if is_dataclass(value) and not isinstance(value, type):
        return {name: plain(item) for name, item in _sent_fields(value).items()}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _sent_fields(record: Any) -> dict[str, Any]:
    """Return the fields of a dataclass by name, without optional ones that are None."""
    values = {entry.name: (getattr(record, entry.name), entry.metadata) for entry in fields(record)}
    return {
        name: value
        for name, (value, metadata) in values.items()
        if not (value is None and metadata.get("is_optional"))
    }


def _dtype(array: npt.NDArray[Any]) -> str:
    name = array.dtype.name
    return name if name in DTYPES else {"bool": "uint8"}.get(name, "float32")
