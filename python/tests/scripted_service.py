"""A service that gives the replies of a script, and says where a request is not the script's.

docs/PROTOCOL.md describes the scripts, which are in tests/protocol/exchanges.json.
"""

from __future__ import annotations

import json
import re
import threading
from collections import deque
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

TABLE = json.loads((Path(__file__).resolve().parents[2] / "tests/protocol/exchanges.json").read_text())
SNAPSHOT = "application/vnd.bagtrack.snapshot"
DRAWN_SEED = "7"


class ScriptedService:
    """Takes requests at `url`, in the order of the exchanges that `expect` was given."""

    def __init__(self) -> None:
        service = self

        class Handler(BaseHTTPRequestHandler):
            def answer(self) -> None:
                service._answer(self)

            do_GET = do_PUT = do_POST = do_DELETE = answer

            def log_message(self, *_: object) -> None:
                pass

        self._exchanges: deque[dict] = deque()
        self._ids: dict[str, str] = {}
        self._seed = ""
        self._complaints: list[str] = []
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self._server.server_port}"
        threading.Thread(target=self._server.serve_forever, args=(0.01,), daemon=True).start()

    def expect(self, exchanges: list[dict]) -> None:
        self._exchanges = deque(exchanges)

    def check(self) -> None:
        """All requests were those of the script, and all of them came."""
        assert not self._complaints, self._complaints
        assert not self._exchanges, f"not asked: {self._exchanges[0]['request']}"

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()

    def _answer(self, handler: BaseHTTPRequestHandler) -> None:
        body = handler.rfile.read(int(handler.headers.get("Content-Length") or 0))
        if not self._exchanges:
            self._complaints.append(f"asked after the script's end: {handler.requestline}")
            return self._send(handler, 400, {}, b"")
        exchange = self._exchanges.popleft()
        try:
            self._compare(exchange, handler, body)
        except AssertionError as error:
            self._complaints.append(f"{handler.requestline} {body!r} in place of {exchange}: {error}")
            return self._send(handler, 400, {}, b"")
        self._reply(handler, exchange["reply"])

    def _compare(self, exchange: dict, handler: BaseHTTPRequestHandler, body: bytes) -> None:
        method, target = exchange["request"].split()
        wanted, came = urlsplit(target), urlsplit(handler.path)
        assert handler.command == method, "the method"
        wanted_path, came_path = wanted.path.split("/"), came.path.split("/")
        assert wanted_path[3:] == came_path[3:] and came_path[1] == "sessions", "the path"
        name, given = wanted_path[2], came_path[2]
        if name not in self._ids:
            assert method == "PUT" and re.fullmatch(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}", given), "the new id"
            assert given not in self._ids.values(), "the id is new"
            self._ids[name] = given
        assert self._ids[name] == given, "the session's id"
        wanted_query, came_query = parse_qs(wanted.query), parse_qs(came.query)
        if method == "PUT" and not self._seed:
            self._seed = came_query.get("seed", [DRAWN_SEED])[0]
        for key, [value] in wanted_query.items():
            [found] = came_query.get(key, [""])
            if key == "box":
                assert [*map(float, found.split(","))] == [*map(float, value.split(","))], "the box"
            else:
                assert found == value.replace("{seed}", self._seed), key
        assert body == exchange.get("frame", exchange.get("snapshot", "")).encode(), "the body"
        if "snapshot" in exchange or "frame" in exchange:
            assert (handler.headers["Content-Type"] == SNAPSHOT) == ("snapshot" in exchange), "the media type"
        self._created = {"id": given, "parameters": {"seed": int(self._seed or DRAWN_SEED)}}

    def _reply(self, handler: BaseHTTPRequestHandler, reply: dict | str) -> None:
        if reply in ("half", "none"):
            if reply == "half":
                handler.wfile.write(b'HTTP/1.1 200 OK\r\nContent-Length: 100\r\n\r\n{"frame"')
            handler.close_connection = True
            return
        headers = {"Content-Type": "application/json", **reply.get("headers", {})}
        if "answer" in reply or "created" in reply:
            number = reply.get("answer", reply.get("created"))
            box = {"x": number, "y": 2, "width": 30.5, "height": 40}
            document = {"frame": number, "box": box, "score": 0.5, "status": "tracking"}
            content = json.dumps({**document, **(self._created if "created" in reply else {})})
        elif "problem" in reply:
            headers["Content-Type"] = "application/problem+json"
            content = json.dumps({"status": reply["status"], **reply["problem"]})
        elif "json" in reply:
            content = json.dumps(reply["json"])
        else:
            headers["Content-Type"] = SNAPSHOT if "snapshot" in reply else "text/html"
            content = reply.get("snapshot", reply.get("text", ""))
        self._send(handler, reply["status"], headers, content.encode())

    @staticmethod
    def _send(handler: BaseHTTPRequestHandler, status: int, headers: dict[str, str], body: bytes) -> None:
        handler.send_response_only(status)
        for name, value in headers.items():
            handler.send_header(name, value)
        handler.send_header("Connection", "close")
        if status != 204:
            handler.send_header("Content-Length", str(len(body)))
        handler.end_headers()
        handler.wfile.write(body)
