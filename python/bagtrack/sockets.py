"""The WebSockets of streams, blocking and asynchronous."""

from __future__ import annotations

import asyncio
import ssl
from contextlib import ExitStack, suppress
from typing import Any, Optional, Union

try:
    import websockets.asyncio.client
    import websockets.sync.client
    from websockets.exceptions import ConnectionClosed, InvalidStatus, WebSocketException
except ModuleNotFoundError as missing:
    raise ImportError(f"track needs {missing.name}: pip install 'bagtrack[stream]'") from missing

from bagtrack import transport
from bagtrack.steps import ConnectionLost
from bagtrack.stream import Connect, Disconnect, Poll, Receive, Send
from bagtrack.transport import Services

FAILURES = (WebSocketException, OSError, TimeoutError, EOFError)


class BaseSocket:
    """How to connect, and what errors mean."""

    def __init__(self, services: Services, headers: dict[str, str], timeout: float) -> None:
        self._services = services
        self._timeout = timeout
        # JPEGs are compressed already; answers are short.
        self._options: dict[str, Any] = {
            "additional_headers": headers,
            "compression": None,
            "open_timeout": timeout,
            "max_size": 1 << 20,
        }

    @staticmethod
    def performs(step: object) -> bool:
        """Whether it is a step of the socket."""
        return isinstance(step, (Connect, Disconnect, Send, Receive, Poll))

    def _address(self, step: Connect) -> str:
        return f"{self._services.socket_address(step.path)}?from={step.first}"

    def _longest(self, step: Receive) -> float:
        """How long the message may take."""
        return transport.longest(self._timeout, step.on_their_way)

    @staticmethod
    def _document(message: Union[str, bytes]) -> dict[str, Any]:
        document = transport.parse(message)
        if not document:
            raise ConnectionLost(f"the service sent a message that is no JSON object: {message!r}")
        return document

    @staticmethod
    def _broken(error: BaseException) -> ConnectionLost:
        if isinstance(error, ssl.SSLCertVerificationError):
            # Another try would not mend it.
            raise error
        if isinstance(error, InvalidStatus):
            return transport.refused(error.response.status_code, error.response.body or b"{}")
        if isinstance(error, ConnectionClosed) and error.rcvd is not None:
            return transport.closed(error.rcvd.code, error.rcvd.reason)
        return ConnectionLost(str(error) or type(error).__name__)


class Socket(BaseSocket):
    """A blocking WebSocket, opened again and again."""

    _socket: Optional[websockets.sync.client.ClientConnection] = None
    _lifetime: Optional[ExitStack] = None

    def perform(self, step: Any) -> Union[dict[str, Any], ConnectionLost, None]:
        """Takes a step; the document that came, where it waits for one."""
        try:
            if isinstance(step, Connect):
                self._lifetime = ExitStack()
                connection = websockets.sync.client.connect(self._address(step), **self._options)
                self._socket = self._lifetime.enter_context(connection)
                return self._document(self._socket.recv(self._timeout))
            if isinstance(step, Disconnect):
                self.close()
            elif self._socket is None:
                raise ConnectionLost("the stream is not open")
            elif isinstance(step, Send):
                self._socket.send(step.message)
            elif isinstance(step, Receive):
                return self._document(self._socket.recv(self._longest(step)))
            else:
                with suppress(TimeoutError):
                    return self._document(self._socket.recv(0))
        except ConnectionLost as lost:
            return lost
        except FAILURES as error:
            return self._broken(error)
        return None

    def close(self) -> None:
        """Closes the line, if there is one."""
        lifetime, self._socket, self._lifetime = self._lifetime, None, None
        if lifetime is not None:
            with suppress(*FAILURES):
                lifetime.close()


class AsyncSocket(BaseSocket):
    """`Socket` for asyncio."""

    _socket: Optional[websockets.asyncio.client.ClientConnection] = None
    _receiving: Optional[asyncio.Task[Union[str, bytes]]] = None
    """Waits for the next message."""

    async def _receive(
        self, socket: websockets.asyncio.client.ClientConnection, timeout: float
    ) -> Union[str, bytes]:
        task = self._receiving = self._receiving or asyncio.ensure_future(socket.recv())
        await asyncio.wait({task}, timeout=timeout)
        if not task.done():
            raise TimeoutError(f"no message came within {timeout:g} s")
        self._receiving = None
        return task.result()

    async def perform(self, step: Any) -> Union[dict[str, Any], ConnectionLost, None]:
        """As `Socket.perform`."""
        try:
            if isinstance(step, Connect):
                self._socket = await websockets.asyncio.client.connect(self._address(step), **self._options)
                return self._document(await self._receive(self._socket, self._timeout))
            if isinstance(step, Disconnect):
                await self.close()
            elif self._socket is None:
                raise ConnectionLost("the stream is not open")
            elif isinstance(step, Send):
                await self._socket.send(step.message)
            elif isinstance(step, Receive):
                return self._document(await self._receive(self._socket, self._longest(step)))
            else:
                with suppress(TimeoutError):
                    return self._document(await self._receive(self._socket, 0.0))
        except ConnectionLost as lost:
            return lost
        except FAILURES as error:
            return self._broken(error)
        return None

    async def close(self) -> None:
        """Closes the line, if there is one."""
        socket, self._socket = self._socket, None
        receiving, self._receiving = self._receiving, None
        if receiving is not None:
            receiving.cancel()
            # Nobody asks for what it gave.
            await asyncio.gather(receiving, return_exceptions=True)
        if socket is not None:
            with suppress(*FAILURES):
                await socket.close()
