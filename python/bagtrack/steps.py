"""What a session asks of the client that runs it.

Sessions are generators that yield these steps and are sent their results; so one code serves blocking and asynchronous
clients. A connection that is lost is thrown into them as `ConnectionLost`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime, timezone
from email.utils import parsedate_to_datetime
from typing import Any, Generator, Generic, Mapping, Optional, TypeVar, Union

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
    url: str = ""
    """Where it came from."""

    @property
    def is_draining(self) -> bool:
        """Whether the service is about to end."""
        return self.headers.get("draining") == "true"

    @property
    def retry_after(self) -> float:
        """After how many seconds trying again makes sense; 0 where that is not said."""
        said = self.headers.get("retry-after", "")
        try:
            return float(int(said))
        except (OverflowError, ValueError):
            pass
        # Proxies tell a date. The clock here may be wrong.
        until, now = date(said), date(self.headers.get("date", "")) or datetime.now(timezone.utc)
        return max((until - now).total_seconds(), 0.0) if until else 0.0


def date(said: str) -> Optional[datetime]:
    """A date of HTTP; None where it is none."""
    try:
        found = parsedate_to_datetime(said)
    except (OverflowError, TypeError, ValueError):
        return None
    return found if found.tzinfo else found.replace(tzinfo=timezone.utc)


@dataclass(frozen=True)
class Pause:
    """Wait for so many seconds, eleven days at most: timers take no years."""

    seconds: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "seconds", min(self.seconds, 1e6))


@dataclass(frozen=True)
class NextService:
    """Go on with the next of the client's addresses, where it has several."""


@dataclass(frozen=True)
class PreviousService:
    """Go back to the address before the last `NextService`."""


class ConnectionLost(Exception):
    """No answer came. Where a stream was refused or closed with a reason, `status` is that of the problem."""

    def __init__(self, reason: str, status: int = 0, document: Any = None) -> None:
        super().__init__(reason)
        self.status = status
        self.document = document or {}


Step = Union[Request, Pause, NextService, PreviousService]
Steps = Generator[Any, Any, T]


class Run(Generic[T]):
    """Runs steps: whoever holds it performs each one, and gives its result to `next`."""

    def __init__(self, steps: Steps[T]) -> None:
        self._steps = steps
        self.value: T
        """What came of the steps, after the last one."""

    def next(self, result: Any = None) -> Any:
        """The next step, after this result or `ConnectionLost`; None after the last one."""
        try:
            if isinstance(result, ConnectionLost):
                return self._steps.throw(result)
            return self._steps.send(result)
        except StopIteration as end:
            self.value = end.value
            return None
