"""What a session asks of the client that runs it.

Sessions are generators that yield these steps and are sent their results; so one code serves blocking and asynchronous
clients. A line that breaks is thrown into them as `LineBroken`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Generator, Mapping, TypeVar, Union

T = TypeVar("T")


@dataclass(frozen=True)
class Request:
    """An HTTP request to the service; its result is a `Reply`."""

    method: str
    path: str
    query: Mapping[str, str] = field(default_factory=dict)
    body: bytes = b""
    media_type: str = "application/octet-stream"


@dataclass(frozen=True)
class Reply:
    """The answer to a request."""

    status: int
    headers: Mapping[str, str]
    """By names in lower case."""
    body: bytes
    document: Any
    """The body as JSON; an empty object where it is none."""

    @property
    def is_draining(self) -> bool:
        """Whether the service is about to end."""
        return self.headers.get("draining") == "true"


@dataclass(frozen=True)
class Pause:
    """Wait for so many seconds."""

    seconds: float


@dataclass(frozen=True)
class NextService:
    """Go on with the next of the client's addresses, where it has several."""


class LineBroken(Exception):
    """No answer came. Where a stream was refused or closed with a reason, `status` is that of the problem."""

    def __init__(self, reason: str, status: int = 0, document: Any = None) -> None:
        super().__init__(reason)
        self.status = status
        self.document = document or {}


Step = Union[Request, Pause, NextService]
Steps = Generator[Any, Any, T]
