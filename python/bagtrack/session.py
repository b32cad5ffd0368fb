"""A session at a service, which goes on when lines break, replicas end and processes are killed."""

from __future__ import annotations

import json
import time
import uuid
from dataclasses import dataclass
from operator import index
from typing import Any, Callable, Optional, TypeVar

import numpy as np

from bagtrack.answer import Answer, Box, BoxLike, parse_box
from bagtrack.backoff import Backoff, RecoveryBackoff
from bagtrack.errors import ServiceError, ServiceUnavailable
from bagtrack.steps import ConnectionLost, NextService, Pause, PreviousService, Reply, Request, Steps

T = TypeVar("T")
SNAPSHOT = "application/vnd.bagtrack.snapshot"
GONE = (404, 410)
SEED_END = 1 << 53
"""Seeds of the service are below this, so that JSON numbers hold them exactly in every language."""
MOST_KEPT = 256
"""Most frames that are kept."""
MOVE_EVERY = 1.0
"""A service that is about to end may be the only one for a while: seconds until the next try to go elsewhere."""


@dataclass(frozen=True)
class Upload:
    """A frame that was or will be sent, with its box where the user corrects it."""

    body: bytes
    box: Optional[Box] = None


@dataclass(frozen=True)
class Opened:
    """What the service says of a session that it has opened."""

    id: str
    frame: int
    box: Box
    params: dict[str, Any]

    @classmethod
    def parse(cls, document: dict[str, Any]) -> Opened:
        """Reads it from the answer."""
        params = dict(document["parameters"])
        # What opens the session again needs it.
        params["seed"]
        return cls(document["id"], int(document["frame"]), parse_box(document["box"]), params)


@dataclass(frozen=True)
class Origin:
    """What opens the session again, and the frame that it stands at then."""

    frame: int
    query: dict[str, str]
    body: bytes
    media_type: str


def four_numbers(box: BoxLike) -> Box:
    """A box as it is kept. `ValueError` where it is not four numbers."""
    try:
        x, y, width, height = (float(number) for number in box)
    except (TypeError, ValueError) as error:
        raise ValueError("a box is four numbers: x, y, width, height") from error
    return (x, y, width, height)


def understood(reply: Reply, read: Callable[[dict[str, Any]], T]) -> T:
    """What the answer says. `ServiceError` where it was refused, or is none of the service's."""
    if reply.status >= 400:
        raise ServiceError(reply.status, reply.document)
    try:
        return read(reply.document)
    except (KeyError, TypeError, ValueError) as error:
        raise not_understood(reply) from error


def not_understood(reply: Reply) -> ServiceError:
    """Says what came in place of an answer, and from where."""
    came = reply.headers.get("content-type", "no content type")
    if "location" in reply.headers:
        came += f", which leads to {reply.headers['location']}"
    begin = reply.body[:60].decode(errors="replace")
    detail = f"{reply.url} answered {reply.status} with what is no answer of bagtrack ({came}): {begin!r}"
    return ServiceError(reply.status, {"detail": detail})


def snapshot_of(reply: Reply) -> bytes:
    """The snapshot in an answer; `ServiceError` where there is none."""
    if reply.status < 400 and reply.headers.get("content-type") != SNAPSHOT:
        raise not_understood(reply)
    return understood(reply, lambda _: reply.body)


def query_box(box: Box) -> str:
    """A box as queries have it."""
    return ",".join(map(repr, box))


class Session:
    """Where a session stands, here and at the service. Its methods are generators of steps.

    docs/PROTOCOL.md says what is done when.
    """

    def __init__(self, snapshot_every: int, retry_for: float) -> None:
        self.snapshot_every = min(snapshot_every, MOST_KEPT // 2)
        self.retry_for = retry_for
        self.id: Optional[str] = None
        self.params: dict[str, Any] = {}
        self.answer: Optional[Answer] = None
        """The last answer that the caller has."""
        self.last_acknowledged = -1
        """The last frame that the service has, as far as is known."""
        self._origin: Optional[Origin] = None
        """While there is one, all frames after it are kept."""
        self._uploads: dict[int, Upload] = {}
        """Frames by their numbers, without gaps."""
        self._tried_to_move = float("-inf")
        self.stream: Any = None
        """The `Stream` that goes on, if there is one."""

    def open(self, query: dict[str, str], body: bytes, media_type: str) -> Steps[None]:
        """Opens a session from a first frame or a snapshot; ends the one that there was."""
        yield from self.close()
        opened = yield from self._create(query, body, media_type)
        self._reset_to(opened, query, body, media_type)
        self.answer = Answer(opened.frame, opened.box, 1.0, "tracking")
        if media_type == SNAPSHOT:
            reply = yield from self.call(Request("GET", self.path()))
            self.answer = understood(reply, lambda document: Answer.parse(document["answer"]))

    def advance(self, body: bytes, box: Optional[Box] = None) -> Steps[Answer]:
        """Sends the next frame."""
        number = self.next_number()
        self.keep(number, Upload(body, box))
        try:
            reply = yield from self.catch_up(number)
        except ServiceError:
            self.drop_refused()
            raise
        self.answer = Answer.parse(reply.document)
        yield from self.checkpoint(reply)
        return self.answer

    def next_number(self) -> int:
        """The number of the next frame."""
        if self.answer is None:
            raise RuntimeError("the client has no target yet: call init(frame, box) first")
        # A frame that got no answer is sent again before the next one.
        return max([self.answer.frame, *self._uploads]) + 1

    def catch_up(self, until: int) -> Steps[Reply]:
        """Brings the service up to frame `until`; the reply to that frame."""
        backoff = RecoveryBackoff(self.retry_for)
        while True:
            number = min(self.last_acknowledged + 1, until)
            upload = self._uploads.get(number)
            if upload is None:
                raise ServiceUnavailable(f"the service needs frame {number} again, which is not kept any more")
            reply = yield from self.call(self._post(number, upload))
            if reply.status < 400:
                understood(reply, Answer.parse)
                self.last_acknowledged = max(self.last_acknowledged, number)
                if number == until:
                    return reply
                continue
            problem = ServiceError(reply.status, reply.document)
            # None where the session is to be opened again.
            go_on_with = None if reply.status in GONE else self._recovery(problem, number, until)
            yield from self._pause(backoff, problem)
            if go_on_with is None:
                yield from self.restore(problem)
            else:
                self.last_acknowledged = go_on_with - 1

    @staticmethod
    def _pause(backoff: RecoveryBackoff, problem: ServiceError) -> Steps[None]:
        """Waits before the next recovery from the problem, which is raised where the time for retries would be up."""
        pause = backoff.next()
        if pause is None:
            raise problem
        if pause > 0.0:
            yield Pause(pause)

    def _recovery(self, problem: ServiceError, number: int, until: int) -> Optional[int]:
        """The frame to go on with after `number` was refused on the way to frame `until`; None: open the session again.

        Raises the problem where neither helps.
        """
        expected = int(problem.problem.get("expected_frame", number))
        if expected < number:
            # One that is not kept: a copy of the session older than its origin, such as another replica has.
            return expected if expected in self._uploads else None
        if expected > number and number < until:
            # The service has frames already that were sent again, the caller's perhaps among them.
            return min(expected, until)
        raise problem

    def resend_from(self, number: int, problem: ServiceError) -> None:
        """The service has no frames from this one on; it is sent next. Raises the problem where it is not kept."""
        if number not in self._uploads:
            raise problem
        self.last_acknowledged = number - 1

    def restore(self, lost: ServiceError) -> Steps[None]:
        """Opens the session again after the service has lost it, as the problem says, which is raised otherwise."""
        if self._origin is None:
            raise lost
        origin = self._origin
        try:
            opened = yield from self._create(origin.query, origin.body, origin.media_type)
        except ServiceError as refused:
            # Such as a service with other keys, which does not take the snapshot.
            raise lost from refused
        self.id, self.last_acknowledged = opened.id, opened.frame

    def checkpoint(self, reply: Reply) -> Steps[None]:
        """Makes sure, after the reply to a frame, that the session can go on elsewhere."""
        number = self.answer.frame if self.answer else 0
        stored = reply.headers.get("checkpoint")
        if stored is not None:
            # A store has the session up to there: any replica goes on with it.
            self._forget(int(stored))
        elif reply.is_draining and self._may_try_to_move():
            yield from self._move()
        elif self.snapshot_every == 0:
            self._forget(number)
        elif self._is_snapshot_due(number):
            yield from self._renew_origin(number)

    def needs_checkpoint(self, document: dict[str, Any]) -> bool:
        """Whether, after this answer of a stream, `checkpoint` has something to send."""
        if "checkpoint" in document:
            self._forget(document["checkpoint"])
            return False
        if document.get("draining") and self._may_try_to_move():
            return True
        if self.snapshot_every == 0:
            self._forget(document["frame"])
            return False
        return self._is_snapshot_due(document["frame"])

    def _may_try_to_move(self) -> bool:
        return time.monotonic() - self._tried_to_move >= MOVE_EVERY

    def _is_snapshot_due(self, number: int) -> bool:
        return self._origin is None or number - self._origin.frame >= self.snapshot_every

    def save(self) -> Steps[bytes]:
        """The service's snapshot of the session."""
        self.next_number()
        backoff = RecoveryBackoff(self.retry_for)
        while True:
            if self.answer and self.last_acknowledged < self.answer.frame:
                yield from self.catch_up(self.answer.frame)
            reply = yield from self.call(Request("GET", self.path("/snapshot")))
            if reply.status not in GONE:
                return snapshot_of(reply)
            problem = ServiceError(reply.status, reply.document)
            # An answer that is lost is asked for at the next replica, which may not have the session.
            yield from self._pause(backoff, problem)
            yield from self.restore(problem)

    def close(self) -> Steps[None]:
        """Ends the session at the service."""
        if self.id is None:
            return
        path = self.path()
        self.id, self.answer, self._origin, self._uploads = None, None, None, {}
        self.stream = None
        try:
            yield Request("DELETE", path)
        except ConnectionLost:
            # It expires.
            pass

    def path(self, below: str = "") -> str:
        """A path of the session."""
        return f"/sessions/{self.id}{below}"

    def keep(self, number: int, upload: Upload) -> None:
        """Keeps the next frame. The oldest goes where there are too many."""
        self._uploads[number] = upload
        if len(self._uploads) > MOST_KEPT:
            del self._uploads[min(self._uploads)]
            self._origin = None

    def kept(self, number: int) -> Optional[Upload]:
        """A frame that was kept."""
        return self._uploads.get(number)

    def drop_refused(self) -> None:
        """Forgets the frames that the service has not taken."""
        last = max(self.last_acknowledged, self.answer.frame if self.answer else 0)
        self._uploads = {number: it for number, it in self._uploads.items() if number <= last}

    def call(self, request: Request) -> Steps[Reply]:
        """The reply to a request that may be sent several times. Waits where the service asks for it."""
        backoff = Backoff(self.retry_for)
        # A line that was idle for long breaks at its next use: the first time nothing is meant by it.
        has_broken = self.retry_for == 0
        while True:
            asked = 0.0
            try:
                reply: Reply = yield request
                problem = ServiceError(reply.status, reply.document)
                if not problem.is_temporary:
                    return reply
                reason: Exception = problem
                asked = reply.retry_after
                if problem.kind == "not-ready":
                    yield NextService()
            except ConnectionLost as lost:
                reason = lost
                if not has_broken:
                    has_broken = True
                    continue
                yield NextService()
            pause = backoff.next(asked)
            if pause is None:
                raise ServiceUnavailable(f"no answer within {self.retry_for:g} s: {reason}") from reason
            yield Pause(pause)

    def _create(self, query: dict[str, str], body: bytes, media_type: str) -> Steps[Opened]:
        request = Request("PUT", f"/sessions/{uuid.uuid4()}", {**query, "verbose": "true"}, body, media_type)
        reply = yield from self.call(request)
        return understood(reply, Opened.parse)

    def _reset_to(self, opened: Opened, query: dict[str, str], body: bytes, media_type: str) -> None:
        self.id, self.params = opened.id, opened.params
        self.last_acknowledged = opened.frame
        if media_type != SNAPSHOT:
            # The same boxes come again only with the seed that was drawn.
            query = {**query, "seed": str(self.params["seed"])}
        origin = Origin(self.last_acknowledged, query, body, media_type)
        self._origin = origin if self.snapshot_every > 0 else None
        self._uploads = {}

    def _post(self, number: int, upload: Upload) -> Request:
        query = {"frame": str(number)}
        if upload.box is None:
            return Request("POST", self.path("/frames"), query, upload.body)
        return Request("PUT", self.path("/target"), {**query, "box": query_box(upload.box)}, upload.body)

    def _renew_origin(self, number: int) -> Steps[Optional[Origin]]:
        """Takes a snapshot, of frame `number` or a later one; without it the older one and more frames are kept."""
        try:
            reply = yield Request("GET", self.path("/snapshot"))
            origin = Origin(number, {}, snapshot_of(reply), SNAPSHOT)
        except (ConnectionLost, ServiceError):
            return None
        self._forget(number)
        self._origin = origin
        return origin

    def _move(self) -> Steps[None]:
        """Goes on elsewhere, since the service is about to end. If there is nothing else yet, it goes on here."""
        self._tried_to_move = time.monotonic()
        origin = yield from self._renew_origin(self.answer.frame if self.answer else 0)
        if origin is None:
            return
        yield NextService()
        try:
            path = f"/sessions/{uuid.uuid4()}"
            reply = yield Request("PUT", path, origin.query, origin.body, origin.media_type)
            moved = understood(reply, lambda document: (document["id"], document["frame"]))
        except (ConnectionLost, ServiceError):
            yield PreviousService()
        else:
            self.id, self.last_acknowledged = moved

    def _forget(self, until: int) -> None:
        """Forgets the frames up to this one, which the service does not ask for again."""
        self._uploads = {number: it for number, it in self._uploads.items() if number > until}
        if self._origin is not None and self._origin.frame < until:
            self._origin = None


def settings(preset: str, seed: Optional[int], params: dict[str, Any]) -> dict[str, str]:
    """The query that opens a session with these parameters."""
    query = {"preset": preset}
    if seed is not None:
        if not 0 <= index(seed) < SEED_END:
            raise ValueError(f"the seed is a whole number from 0 to {SEED_END - 1}, not {seed}")
        query["seed"] = str(index(seed))
    if params:
        query["parameters"] = json.dumps(params, default=plain_number)
    return query


def plain_number(value: object) -> Any:
    """One of NumPy's numbers, which `Tracker` takes too, as JSON has it."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a parameter is a number, a truth value or a text, not {type(value).__name__}")
