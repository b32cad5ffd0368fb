"""Many frames over a WebSocket, several of them on their way at once."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from typing import Any, Callable, Optional, TypeVar

from bagtrack.answer import Answer
from bagtrack.errors import ServiceError, ServiceUnavailable
from bagtrack.session import GONE, Session, Upload
from bagtrack.steps import ConnectionLost, NextService, Pause, Reply, Steps

T = TypeVar("T")
MOST_ON_THEIR_WAY = 32
SWITCHED = 101
"""The status with which a stream begins."""


@dataclass(frozen=True)
class Connect:
    """Open the session's stream at this path."""

    path: str
    first: int
    """The first frame whose answer is wanted."""


@dataclass(frozen=True)
class Disconnect:
    """Close the stream."""


@dataclass(frozen=True)
class Send:
    """Send a message: text or bytes."""

    message: Any


@dataclass(frozen=True)
class Receive:
    """Wait for a message, which is a JSON document."""

    on_their_way: int
    """The bytes of the frames that the service may not have yet."""


@dataclass(frozen=True)
class Poll:
    """A message that has come, as `Receive` gives it; None where there is none."""


@dataclass(frozen=True)
class NextFrame:
    """The caller's next frame, as bytes; None after the last one."""

    number: int


@dataclass(frozen=True)
class Yield:
    """Give the caller an answer."""

    answer: Answer


class Stream:
    """The frames of a caller through a session's stream. `run` is a generator of steps."""

    def __init__(self, session: Session, window: int, *, may_linger: bool = False) -> None:
        """`may_linger`: a loop that was left ends later, as those of asyncio do."""
        if not 1 <= window <= MOST_ON_THEIR_WAY:
            raise ValueError(f"window is from 1 to {MOST_ON_THEIR_WAY}, not {window}")
        self._session = session
        self._window = window
        self._sent = 0
        """The last frame that is on its way or answered."""
        self._ended = False
        self._tries = 0
        """Connections since the last answer."""
        self._broken_since = 0.0
        self._may_linger = may_linger
        self.is_left = False
        """Whether the caller has an answer, and may never ask for the next one."""

    def run(self) -> Steps[None]:
        """Sends frames and gives their answers, until there are no more frames."""
        session = self._session
        # Tells where there is no session.
        session.next_number()
        if session.stream is not None and not session.stream.is_left:
            # Each would send the frames of the other, and get its answers.
            raise RuntimeError("another `track` of this client goes on: leave its loop first, or use a client for each")
        session.stream = self
        try:
            while not (self._ended and self._answered() + 1 == session.next_number()):
                try:
                    yield from self._connect()
                    yield from self._exchange()
                    yield Disconnect()
                except ConnectionLost as broken:
                    yield Disconnect()
                    yield from self._mend(broken)
        finally:
            if session.stream is self:
                session.stream = None

    def _answered(self) -> int:
        return self._session.answer.frame if self._session.answer else 0

    def _connect(self) -> Steps[None]:
        first = self._answered() + 1
        hello = yield Connect(self._session.path("/stream"), first)
        # The answers to the frames before this one come of themselves.
        self._sent = understood(hello, lambda document: int(document["next"])) - 1
        self._session.last_acknowledged = self._sent

    def _exchange(self) -> Steps[None]:
        """Sends and receives, until the frames have ended or the session needs a checkpoint."""
        session = self._session
        reply: Optional[Reply] = None
        while True:
            document = None
            if reply is None and self._sent - self._answered() < self._window:
                # Answers do not wait for the next frame of a camera.
                document = yield Poll()
                upload = None if document else (yield from self._next_upload())
                if upload is not None:
                    self._sent += 1
                    header: dict[str, Any] = {"frame": self._sent}
                    if upload.box is not None:
                        header["box"] = upload.box
                    yield Send(json.dumps(header))
                    yield Send(upload.body)
                    continue
            if document is None and self._sent == self._answered():
                if reply is None:
                    return
                # Nothing is on its way, so the snapshot is of the last answer.
                before = session.id
                yield from session.checkpoint(reply)
                reply = None
                if session.id != before:
                    return
                continue
            document = document or (yield Receive(self._on_their_way()))
            if "type" in document:
                self._refuse(document)
            self._tries = 0
            answer = session.answer = understood(document, Answer.parse)
            session.last_acknowledged = max(session.last_acknowledged, session.answer.frame)
            if session.needs_checkpoint(document):
                reply = as_reply(document)
            self.is_left = self._may_linger
            yield Yield(answer)
            self.is_left = False
            if session.answer is not answer or session.stream is not self:
                # The frames on their way have other numbers now.
                raise RuntimeError("the client was used otherwise while `track` went on: leave its loop first")

    def _on_their_way(self) -> int:
        uploads = map(self._session.kept, range(self._session.last_acknowledged + 1, self._sent + 1))
        return sum(len(upload.body) for upload in uploads if upload)

    def _next_upload(self) -> Steps[Optional[Upload]]:
        number = self._sent + 1
        upload = self._session.kept(number)
        if upload is None and not self._ended:
            body = yield NextFrame(number)
            self._ended = body is None
            if body is not None:
                upload = Upload(body)
                self._session.keep(number, upload)
        return upload

    def _refuse(self, problem: dict[str, Any]) -> None:
        if problem.get("status") in (429, 503, *GONE):
            raise ConnectionLost(problem.get("detail", ""), problem["status"], problem)
        self._session.drop_refused()
        raise ServiceError(problem.get("status", 0), problem)

    def _mend(self, broken: ConnectionLost) -> Steps[None]:
        """Makes the session ready for the next connection."""
        session, answered = self._session, self._answered()
        if self._tries == 0:
            self._broken_since = time.monotonic()
        self._tries += 1
        problem = ServiceError(broken.status, broken.document)
        # Of an older frame the service is at its last checkpoint.
        expected = broken.document.get("expected_frame", answered + 1) if broken.status == 409 else answered + 1
        if broken.status in GONE or expected <= answered:
            # Where every replica loses the session again, this ends with the time for retries.
            if self._tries > 1:
                yield self._pause(problem)
            if broken.status in GONE:
                yield from session.restore(problem)
            else:
                session.resend_from(expected, problem)
            if session.last_acknowledged < answered:
                yield from session.catch_up(answered)
            return
        if expected > answered + 1 and session.kept(expected - 1):
            # The service no longer has the answers to frames whose calls failed, as `update` passes over them.
            reply = yield from session.catch_up(expected - 1)
            session.answer = Answer.parse(reply.document)
            return
        if broken.status and not problem.is_temporary:
            raise problem
        if self._tries > 1:
            yield NextService()
        yield self._pause(ServiceUnavailable(f"the stream breaks again and again: {broken}"), broken)

    def _pause(self, late: Exception, cause: Optional[Exception] = None) -> Pause:
        """The pause before the next connection; raises this where the time for retries would be up then."""
        pause = min(0.05 * 2.0 ** min(self._tries, 10), 2.0)
        if time.monotonic() + pause - self._broken_since > self._session.retry_for:
            raise late from cause
        return Pause(pause)


def understood(document: dict[str, Any], read: Callable[[dict[str, Any]], T]) -> T:
    """What a message says. `ServiceError` where it is none of the service's; the frames on their way stay kept."""
    try:
        return read(document)
    except (KeyError, TypeError, ValueError) as error:
        detail = f"the stream sent what is no answer of bagtrack: {json.dumps(document)[:60]!r}"
        raise ServiceError(SWITCHED, {"detail": detail}) from error


def as_reply(document: dict[str, Any]) -> Reply:
    """An answer of a stream with what it says of the service as headers."""
    headers = {"draining": "true"} if document.get("draining") else {}
    if "checkpoint" in document:
        headers["checkpoint"] = str(document["checkpoint"])
    return Reply(200, headers, b"", document)
