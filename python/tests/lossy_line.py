"""A line to a server that breaks when certain answers come."""

from __future__ import annotations

import socket
import threading
from contextlib import suppress
from types import TracebackType


class LossyLine:
    """Passes bytes between clients and the server at `port`. Of the good answers, counted from 1 over
    all connections, those in `loses` are thrown away once they have come, and the connection ends."""

    def __init__(self, port: int, loses: set[int]) -> None:
        self._port = port
        self._loses = loses
        self._answers = 0
        self._open: list[socket.socket] = []
        self.lost = 0
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self._listener.getsockname()[1]}"
        threading.Thread(target=self._accept, daemon=True).start()

    def __enter__(self) -> LossyLine:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._listener.close()

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            server = socket.create_connection(("127.0.0.1", self._port))
            self._open += [client, server]
            threading.Thread(target=self._pass_requests, args=(client, server), daemon=True).start()
            threading.Thread(target=self._pass_answers, args=(client, server), daemon=True).start()

    def cut(self) -> None:
        """Ends all connections."""
        ends, self._open = self._open, []
        for end in ends:
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    @staticmethod
    def _pass_requests(client: socket.socket, server: socket.socket) -> None:
        try:
            while data := client.recv(65536):
                server.sendall(data)
            server.shutdown(socket.SHUT_WR)
        except OSError:
            pass

    def _pass_answers(self, client: socket.socket, server: socket.socket) -> None:
        try:
            while data := server.recv(65536):
                # The client waits for each answer, and answers to frames are short.
                if data.startswith(b"HTTP/1.1 20"):
                    self._answers += 1
                    if self._answers in self._loses:
                        self.lost += 1
                        break
                client.sendall(data)
        except OSError:
            pass
        for side in (client, server):
            with suppress(OSError):
                # The other thread waits at one of them, which closing alone would not end.
                side.shutdown(socket.SHUT_RDWR)
            side.close()
