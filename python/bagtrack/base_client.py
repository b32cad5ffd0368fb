"""What the blocking and the asynchronous client have in common."""

from __future__ import annotations

import ssl
from typing import Any, Optional, Sequence, Union, get_args

import httpx

from bagtrack import transport
from bagtrack.answer import Answer, Box, BoxLike, Status
from bagtrack.encoding import Encoding, Frame, encode
from bagtrack.session import Session, four_numbers, query_box, settings
from bagtrack.steps import ConnectionLost, Request, Steps
from bagtrack.transport import Services

IMAGE = "application/octet-stream"


class End:
    """In the place of a frame after the last one."""


class BaseClient:
    """What a client knows of its session."""

    def __init__(
        self,
        url: Union[str, Sequence[str]],
        api_key: Optional[str] = None,
        *,
        preset: str = "robust",
        seed: Optional[int] = None,
        encoding: Encoding = "jpeg",
        quality: int = 90,
        snapshot_every: int = 30,
        retry_for: float = 60.0,
        timeout: float = 15.0,
        **params: Any,
    ) -> None:
        """A client for one target.

        `url` is the service's address, or several where a session may go on: the next one is taken when one gives no
        answer or is about to end. Arrays are sent as JPEG of this `quality`, or as PNG, which changes no pixel; bytes
        are sent as they are. Every `snapshot_every` frames the client takes a snapshot and keeps the frames after it:
        when the service loses the session, the client opens it again and sends them again, so that the boxes are the
        same as ever. 0: never. A service with a store needs none, and none are taken. `retry_for` is the time in
        seconds for which a request is sent again after a broken line, 429 or 503; `timeout` is that of one request, and
        a second more for 50,000 bytes of it. `preset`, `seed` and `params` are those of `Tracker`; without a seed the
        service draws one.
        """
        if snapshot_every < 0:
            raise ValueError("snapshot_every is at least 0")
        # With another one it would be tried for ever, or told only once the service is away.
        if isinstance(retry_for, str) or not retry_for >= 0:
            raise ValueError(f"retry_for is a number of seconds from 0 on, not {retry_for!r}")
        if encoding not in get_args(Encoding):
            raise ValueError(f"encoding is 'jpeg' or 'png', not {encoding!r}")
        self._services = Services(url)
        self._headers = transport.authorization(api_key)
        self._settings = settings(preset, seed, params)
        self._encoding: Encoding = encoding
        self._quality = quality
        self._timeout = timeout
        self._session = Session(snapshot_every, retry_for)

    @property
    def id(self) -> Optional[str]:
        """The session's id at the service; it changes when the session moves. None without a session."""
        return self._session.id

    @property
    def box(self) -> Box:
        """The last answer."""
        return self.answer.box

    @property
    def score(self) -> float:
        """The chance, from 0 to 1, that the box overlaps the target by half or more."""
        return self.answer.score

    @property
    def status(self) -> Status:
        """What the score and its history mean."""
        return self.answer.status

    @property
    def frame(self) -> int:
        """The number of the last frame; the first is 0."""
        return self.answer.frame

    @property
    def answer(self) -> Answer:
        """All that was said of the last frame. `RuntimeError` before `init`."""
        if self._session.answer is None:
            raise RuntimeError("the client has no target yet: call init(frame, box) first")
        return self._session.answer

    @property
    def params(self) -> dict[str, Any]:
        """All parameters by their names, as the service says them."""
        return dict(self._session.params)

    def _encode(self, frame: Frame) -> bytes:
        return encode(frame, self._encoding, self._quality)

    def _next_body(self, frame: Union[Frame, End], number: int) -> Optional[bytes]:
        """A frame that `track` was given, as bytes; None after the last one."""
        if isinstance(frame, End):
            return None
        try:
            return self._encode(frame)
        except (TypeError, ValueError) as error:
            raise type(error)(f"frame {number} cannot be sent: {error}") from error

    def _opening(self, frame: Frame, box: BoxLike) -> Steps[None]:
        query = {**self._settings, "box": query_box(four_numbers(box))}
        return self._session.open(query, self._encode(frame), IMAGE)


def request_of(step: Request, services: Services, timeout: float) -> dict[str, Any]:
    """A request in the words of httpx."""
    options: dict[str, Any] = {"method": step.method, "url": services.address(step.path), "params": dict(step.query)}
    if step.body:
        options.update(content=step.body, headers={"Content-Type": step.media_type})
        options["timeout"] = transport.longest(timeout, len(step.body))
    return options


def lost(error: httpx.TransportError) -> ConnectionLost:
    """What a request without an answer is to the session. Raises what another try would not mend."""
    if isinstance(error, (httpx.LocalProtocolError, httpx.UnsupportedProtocol)) or is_certificate_refused(error):
        raise error
    return ConnectionLost(str(error) or type(error).__name__)


def is_certificate_refused(error: Optional[BaseException]) -> bool:
    """Whether the service's certificate is the cause."""
    while error is not None and not isinstance(error, ssl.SSLCertVerificationError):
        error = error.__cause__ or error.__context__
    return error is not None
