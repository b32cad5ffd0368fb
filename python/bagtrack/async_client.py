"""The asynchronous client of a bagtrack service."""

from __future__ import annotations

import asyncio
import os
from typing import Any, AsyncIterable, AsyncIterator, Iterable, Optional, Sequence, TypeVar, Union

import httpx

from bagtrack import transport
from bagtrack.answer import Answer, Box, BoxLike
from bagtrack.base_client import BaseClient, End, lost, request_of
from bagtrack.encoding import Frame
from bagtrack.session import SNAPSHOT, four_numbers
from bagtrack.steps import ConnectionLost, NextService, Pause, PreviousService, Reply, Request, Run, Steps
from bagtrack.stream import NextFrame, Stream, Yield

T = TypeVar("T")


class AsyncClient(BaseClient):
    """`Client` for asyncio. Used by one task at a time."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._connect()

    __init__.__doc__ = BaseClient.__init__.__doc__

    def _connect(self) -> None:
        self._http = httpx.AsyncClient(headers=self._headers, timeout=self._timeout)
        self._process = os.getpid()

    @classmethod
    async def load(
        cls, snapshot: bytes, url: Union[str, Sequence[str]], api_key: Optional[str] = None, **options: Any
    ) -> AsyncClient:
        """A client whose session goes on from what `save` gave."""
        client = cls(url, api_key, **options)
        await client._run(client._session.open({}, snapshot, SNAPSHOT))
        return client

    async def init(self, frame: Frame, box: BoxLike) -> None:
        """As `Client.init`."""
        await self._run(self._opening(frame, box))

    async def update(self, frame: Frame) -> tuple[bool, Box]:
        """As `Client.update`."""
        answer = await self._run(self._session.advance(self._encode(frame)))
        return answer.ok, answer.box

    async def retarget(self, frame: Frame, box: BoxLike) -> None:
        """As `Client.retarget`."""
        await self._run(self._session.advance(self._encode(frame), four_numbers(box)))

    async def track(
        self, frames: Union[Iterable[Frame], AsyncIterable[Frame]], window: int = 8
    ) -> AsyncIterator[Answer]:
        """As `Client.track`."""
        from bagtrack.sockets import AsyncSocket

        source = frames if isinstance(frames, AsyncIterable) else each(frames)
        source = source.__aiter__()
        run = Run(Stream(self._session, window, may_linger=True).run())
        socket = AsyncSocket(self._services, self._headers, self._timeout)
        step = run.next()
        try:
            while step is not None:
                result: Any = None
                if isinstance(step, Yield):
                    yield step.answer
                elif isinstance(step, NextFrame):
                    result = self._next_body(await anext(source, End()), step.number)
                elif AsyncSocket.performs(step):
                    result = await socket.perform(step)
                else:
                    result = await self._perform(step)
                step = run.next(result)
        finally:
            await socket.close()

    async def save(self) -> bytes:
        """As `Client.save`."""
        return await self._run(self._session.save())

    async def close(self) -> None:
        """As `Client.close`."""
        await self._run(self._session.close())
        await self._http.aclose()

    async def __aenter__(self) -> AsyncClient:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def _run(self, steps: Steps[T]) -> T:
        run = Run(steps)
        step = run.next()
        while step is not None:
            step = run.next(await self._perform(step))
        return run.value

    async def _perform(self, step: Any) -> Union[Reply, ConnectionLost, None]:
        if isinstance(step, Pause):
            await asyncio.sleep(step.seconds)
            return None
        if isinstance(step, NextService):
            self._services.next()
            return None
        if isinstance(step, PreviousService):
            self._services.previous()
            return None
        assert isinstance(step, Request)
        if self._process != os.getpid():
            # As `Client`.
            self._connect()
        try:
            response = await self._http.request(**request_of(step, self._services, self._timeout))
        except httpx.TransportError as error:
            return lost(error)
        return transport.reply(response)


async def each(frames: Iterable[Frame]) -> AsyncIterator[Frame]:
    """The frames of an ordinary iterable."""
    for frame in frames:
        yield frame
