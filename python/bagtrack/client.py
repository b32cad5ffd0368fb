"""The blocking client of a bagtrack service."""

from __future__ import annotations

import os
import time
from typing import Any, Iterable, Iterator, Optional, Sequence, TypeVar, Union

import httpx

from bagtrack import transport
from bagtrack.answer import Answer, Box, BoxLike
from bagtrack.base_client import BaseClient, End, lost, request_of
from bagtrack.encoding import Frame
from bagtrack.session import SNAPSHOT, four_numbers
from bagtrack.steps import ConnectionLost, NextService, Pause, PreviousService, Reply, Request, Run, Steps
from bagtrack.stream import NextFrame, Stream, Yield

T = TypeVar("T")


class Client(BaseClient):
    """Follows one object through frames at a service. Used by one thread at a time."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._connect()

    __init__.__doc__ = BaseClient.__init__.__doc__

    def _connect(self) -> None:
        self._http = httpx.Client(headers=self._headers, timeout=self._timeout)
        self._process = os.getpid()

    @classmethod
    def load(
        cls, snapshot: bytes, url: Union[str, Sequence[str]], api_key: Optional[str] = None, **options: Any
    ) -> Client:
        """A client whose session goes on from what `save` gave."""
        client = cls(url, api_key, **options)
        client._run(client._session.open({}, snapshot, SNAPSHOT))
        return client

    def init(self, frame: Frame, box: BoxLike) -> None:
        """Starts on `frame` with the target in `box`; ends the session that there was."""
        self._run(self._opening(frame, box))

    def update(self, frame: Frame) -> tuple[bool, Box]:
        """Finds the target in the next frame: `(ok, box)`. `ok` is False where the target is lost; `box` is the best
        guess then."""
        answer = self._run(self._session.advance(self._encode(frame)))
        return answer.ok, answer.box

    def retarget(self, frame: Frame, box: BoxLike) -> None:
        """The user corrects the box: `frame` counts as the next one, with `box` as its answer."""
        self._run(self._session.advance(self._encode(frame), four_numbers(box)))

    def track(self, frames: Iterable[Frame], window: int = 8) -> Iterator[Answer]:
        """The answers to many frames, over a WebSocket, with at most `window` frames on their way (1 to 32).

        As fast as the service also over a slow line. An answer that has come is given before the next frame is asked
        for. Needs bagtrack[stream].
        """
        from bagtrack.sockets import Socket

        source = iter(frames)
        run = Run(Stream(self._session, window).run())
        socket = Socket(self._services, self._headers, self._timeout)
        step = run.next()
        try:
            while step is not None:
                result: Any = None
                if isinstance(step, Yield):
                    yield step.answer
                elif isinstance(step, NextFrame):
                    result = self._next_body(next(source, End()), step.number)
                elif Socket.performs(step):
                    result = socket.perform(step)
                else:
                    result = self._perform(step)
                step = run.next(result)
        finally:
            socket.close()

    def save(self) -> bytes:
        """The service's snapshot of the session: `load` goes on from it, at any service with the same secret."""
        return self._run(self._session.save())

    def close(self) -> None:
        """Ends the session, and the connections."""
        self._run(self._session.close())
        self._http.close()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _run(self, steps: Steps[T]) -> T:
        run = Run(steps)
        step = run.next()
        while step is not None:
            step = run.next(self._perform(step))
        return run.value

    def _perform(self, step: Any) -> Union[Reply, ConnectionLost, None]:
        if isinstance(step, Pause):
            time.sleep(step.seconds)
            return None
        if isinstance(step, NextService):
            self._services.next()
            return None
        if isinstance(step, PreviousService):
            self._services.previous()
            return None
        assert isinstance(step, Request)
        if self._process != os.getpid():
            # After a fork two processes would read each other's answers.
            self._connect()
        try:
            response = self._http.request(**request_of(step, self._services, self._timeout))
        except httpx.TransportError as error:
            return lost(error)
        return transport.reply(response)
