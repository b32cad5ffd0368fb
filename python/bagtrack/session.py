"""A session at a service, which goes on when lines break, replicas end and processes are killed."""

from __future__ import annotations

import json
import time
import uuid
from dataclasses import dataclass
from typing import Any, Optional

from bagtrack.answer import Answer, Box, BoxLike, parse_box
from bagtrack.errors import ServiceError, ServiceUnavailable
from bagtrack.steps import LineBroken, NextService, Pause, Reply, Request, Steps

SNAPSHOT = "application/vnd.bagtrack.snapshot"
GONE = (404, 410)
MAX_PAUSE = 5.0


@dataclass(frozen=True)
class Upload:
    """A frame that was or will be sent, with its box where the user corrects it."""

    body: bytes
    box: Optional[Box] = None


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


def query_box(box: Box) -> str:
    """A box as queries have it."""
    return ",".join(map(repr, box))


class Session:
    """Where a session stands, here and at the service. Its methods are generators of steps."""

    def __init__(self, snapshot_every: int, retry_for: float) -> None:
        self.snapshot_every = snapshot_every
        self.retry_for = retry_for
        self.id: Optional[str] = None
        self.params: dict[str, Any] = {}
        self.answer: Optional[Answer] = None
        """The last answer that the caller has."""
        self.at = -1
        """The last frame that the service has, as far as is known."""
        self._origin: Optional[Origin] = None
        self._uploads: dict[int, Upload] = {}
        """The frames after the origin's, by their numbers."""
        self._tried_to_move = float("-inf")

    def open(self, query: dict[str, str], body: bytes, media_type: str) -> Steps[None]:
        """Opens a session from a first frame or a snapshot; ends the one that there was."""
        yield from self.close()
        document = yield from self._create(query, body, media_type)
        self._stand_at(document, query, body, media_type)
        self.answer = Answer(self.at, parse_box(document["box"]), 1.0, "tracking")
        if media_type == SNAPSHOT:
            reply = yield from self.call(Request("GET", self.path()))
            self.answer = Answer.parse(self._checked(reply).document["answer"])

    def advance(self, body: bytes, box: Optional[Box] = None) -> Steps[Answer]:
        """Sends the next frame."""
        number = self.next_number()
        self._uploads[number] = Upload(body, box)
        try:
            reply = yield from self.catch_up(number)
        except ServiceError:
            self.drop_refused()
            raise
        self.answer = Answer.parse(reply.document)
        yield from self.look_after(reply)
        return self.answer

    def next_number(self) -> int:
        """The number of the next frame."""
        if self.answer is None:
            raise RuntimeError("the client has no target yet: call init(frame, box) first")
        # A frame that got no answer is sent again before the next one.
        return max([self.answer.frame, *self._uploads]) + 1

    def catch_up(self, until: int) -> Steps[Reply]:
        """Brings the service up to frame `until`; the reply to that frame."""
        while True:
            number = min(self.at + 1, until)
            upload = self._uploads.get(number)
            if upload is None:
                raise ServiceUnavailable(f"the service asks for frame {number} again, which was not kept")
            reply = yield from self.call(self._post(number, upload))
            if reply.status in GONE:
                yield from self.restore()
            elif reply.status == 409 and reply.document.get("expected_frame", number) < number:
                self.at = reply.document["expected_frame"] - 1
            else:
                self._checked(reply)
                self.at = max(self.at, number)
                if number == until:
                    return reply

    def restore(self) -> Steps[None]:
        """Opens the session again after the service has lost it."""
        origin = self._origin
        answered = self.answer.frame if self.answer else 0
        if origin is None or any(number not in self._uploads for number in range(origin.frame + 1, answered + 1)):
            raise ServiceUnavailable("the service has lost the session, and what opens it again was not kept")
        document = yield from self._create(origin.query, origin.body, origin.media_type)
        self.id, self.at = document["id"], document["frame"]

    def look_after(self, reply: Reply) -> Steps[None]:
        """Makes sure, after the reply to a frame, that the session can go on elsewhere."""
        number = self.answer.frame if self.answer else 0
        checkpoint = reply.headers.get("checkpoint")
        if checkpoint is not None:
            # A store has the session up to there: any replica goes on with it.
            self._forget(int(checkpoint))
            return
        if reply.is_draining and time.monotonic() - self._tried_to_move > 1.0:
            yield from self._move()
        elif self.snapshot_every == 0:
            self._forget(number)
        elif self._origin is not None and number - self._origin.frame >= self.snapshot_every:
            yield from self._renew_origin(number)

    def wants_care(self, document: dict[str, Any]) -> bool:
        """Whether, after this answer of a stream, `look_after` has something to do."""
        if "checkpoint" in document or self.snapshot_every == 0:
            self._forget(document.get("checkpoint", document["frame"]))
            return False
        waited = time.monotonic() - self._tried_to_move > 1.0
        is_due = self._origin is not None and document["frame"] - self._origin.frame >= self.snapshot_every
        return is_due or (bool(document.get("draining")) and waited)

    def save(self) -> Steps[bytes]:
        """The service's snapshot of the session."""
        self.next_number()
        reply = yield from self.call(Request("GET", self.path("/snapshot")))
        if reply.status in GONE:
            yield from self.restore()
            if self.answer and self.at < self.answer.frame:
                yield from self.catch_up(self.answer.frame)
            reply = yield from self.call(Request("GET", self.path("/snapshot")))
        return self._checked(reply).body

    def close(self) -> Steps[None]:
        """Ends the session at the service."""
        if self.id is None:
            return
        path = self.path()
        self.id, self.answer, self._origin, self._uploads = None, None, None, {}
        try:
            yield Request("DELETE", path)
        except LineBroken:
            # It expires.
            pass

    def path(self, below: str = "") -> str:
        """A path of the session."""
        return f"/sessions/{self.id}{below}"

    def keep(self, number: int, upload: Upload) -> None:
        """Keeps a frame that is sent over a stream."""
        self._uploads[number] = upload

    def kept(self, number: int) -> Optional[Upload]:
        """A frame that was kept."""
        return self._uploads.get(number)

    def drop_refused(self) -> None:
        """Forgets the frames that the service has not taken."""
        last = max(self.at, self.answer.frame if self.answer else 0)
        self._uploads = {number: it for number, it in self._uploads.items() if number <= last}

    def call(self, request: Request) -> Steps[Reply]:
        """The reply to a request that may be sent several times. Waits where the service asks for it."""
        begin, tries = time.monotonic(), 0
        while True:
            tries += 1
            pause = min(0.05 * 2.0**tries, MAX_PAUSE)
            try:
                reply: Reply = yield request
                if reply.status not in (429, 502, 503, 504):
                    return reply
                reason: Exception = ServiceError(reply.status, reply.document)
                pause = _retry_after(reply, pause)
                if reply.document.get("type", "").endswith(":not-ready"):
                    yield NextService()
            except LineBroken as error:
                reason = error
                # A line that was idle for long breaks at its next use: the first time nothing is meant by it.
                if tries == 1:
                    continue
                yield NextService()
            if time.monotonic() + pause - begin > self.retry_for:
                raise ServiceUnavailable(f"no answer within {self.retry_for:g} s: {reason}") from reason
            yield Pause(pause)

    def _create(self, query: dict[str, str], body: bytes, media_type: str) -> Steps[dict[str, Any]]:
        request = Request("PUT", f"/sessions/{uuid.uuid4()}", {**query, "verbose": "true"}, body, media_type)
        reply = yield from self.call(request)
        document: dict[str, Any] = self._checked(reply).document
        return document

    def _stand_at(self, document: dict[str, Any], query: dict[str, str], body: bytes, media_type: str) -> None:
        self.id, self.at, self.params = document["id"], document["frame"], document["parameters"]
        if media_type != SNAPSHOT:
            # The same boxes come again only with the seed that was drawn.
            query = {**query, "seed": str(self.params["seed"])}
        self._origin = Origin(self.at, query, body, media_type)
        self._uploads = {}

    def _post(self, number: int, upload: Upload) -> Request:
        query = {"frame": str(number)}
        if upload.box is None:
            return Request("POST", self.path("/frames"), query, upload.body)
        return Request("PUT", self.path("/target"), {**query, "box": query_box(upload.box)}, upload.body)

    def _renew_origin(self, number: int) -> Steps[bool]:
        """Takes a snapshot, of frame `number` or a later one; without it the older one and more frames are kept."""
        try:
            reply = yield Request("GET", self.path("/snapshot"))
        except LineBroken:
            return False
        if reply.status != 200:
            return False
        self._origin = Origin(number, {}, reply.body, SNAPSHOT)
        self._forget(number)
        return True

    def _move(self) -> Steps[None]:
        """Goes on elsewhere, since the service is about to end. If there is nothing else yet, it goes on here."""
        self._tried_to_move = time.monotonic()
        number = self.answer.frame if self.answer else 0
        if not (yield from self._renew_origin(number)) or self._origin is None:
            return
        yield NextService()
        origin = self._origin
        try:
            path = f"/sessions/{uuid.uuid4()}"
            reply = yield Request("PUT", path, origin.query, origin.body, origin.media_type)
        except LineBroken:
            return
        if reply.status == 201:
            self.id, self.at = reply.document["id"], reply.document["frame"]

    def _forget(self, until: int) -> None:
        self._uploads = {number: it for number, it in self._uploads.items() if number > until}

    @staticmethod
    def _checked(reply: Reply) -> Reply:
        if reply.status >= 400:
            raise ServiceError(reply.status, reply.document)
        return reply


def settings(preset: str, seed: Optional[int], params: dict[str, Any]) -> dict[str, str]:
    """The query that opens a session with these parameters."""
    query = {"preset": preset}
    if seed is not None:
        query["seed"] = str(seed)
    if params:
        query["parameters"] = json.dumps(params)
    return query


def _retry_after(reply: Reply, otherwise: float) -> float:
    try:
        return max(float(reply.headers["retry-after"]), 0.0)
    except (KeyError, ValueError):
        return otherwise
