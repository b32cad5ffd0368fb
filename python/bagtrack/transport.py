"""What both clients need of HTTP: addresses, headers, replies."""

from __future__ import annotations

import json
from typing import Any, Sequence, Union
from urllib.parse import urlsplit

import httpx

from bagtrack.steps import ConnectionLost, Reply


SLOWEST = 50_000
"""Bytes a second for which a request has its time, beside `timeout`."""


class Services:
    """The addresses of a service, one of which is in use."""

    def __init__(self, url: Union[str, Sequence[str]]) -> None:
        urls = [url] if isinstance(url, (str, bytes)) else list(url)
        if not urls:
            raise ValueError("there is no address of a service")
        for address in urls:
            if not isinstance(address, str):
                raise TypeError(f"the address of a service is a text, not {type(address).__name__}")
            if not address.startswith(("http://", "https://")):
                raise ValueError(f"the address {address!r} does not begin with http:// or https://")
            try:
                parts = urlsplit(address)
                has_host = bool(parts.hostname) and parts.port != 0
            except ValueError as error:
                raise ValueError(f"the address {address!r} cannot be used: {error}") from error
            if not has_host:
                raise ValueError(f"the address {address!r} names no host and port, like http://localhost:8080")
        self._urls = [address.rstrip("/") for address in urls]
        self._used = 0

    def address(self, path: str) -> str:
        """The address of a path."""
        return self._urls[self._used] + path

    def socket_address(self, path: str) -> str:
        """The address of a stream."""
        address = self.address(path)
        return "ws" + address.removeprefix("http")

    def next(self) -> None:
        """Goes on to the next address."""
        self._used = (self._used + 1) % len(self._urls)

    def previous(self) -> None:
        """Goes back to the address before."""
        self._used = (self._used - 1) % len(self._urls)


def longest(timeout: float, size: int) -> float:
    """How long an answer may take where so many bytes are on their way: a large frame takes long over a slow line."""
    return timeout and timeout + size / SLOWEST


def authorization(api_key: Union[str, None]) -> dict[str, str]:
    """The headers that say who calls."""
    if api_key is None:
        return {}
    if not isinstance(api_key, str):
        raise TypeError(f"the API key is a text, not {type(api_key).__name__}")
    # Files with a key end with a line break.
    key = api_key.strip()
    # The key is not shown: messages go into logs.
    if not key:
        raise ValueError("the API key is empty: leave api_key out where the service wants none")
    if not (key.isascii() and key.isprintable()):
        raise ValueError("the API key has characters that no header takes: it is one line of printable ASCII")
    return {"Authorization": f"Bearer {key}"}


def reply(response: httpx.Response) -> Reply:
    """A reply, with its body read as JSON where it is that."""
    headers, body = response.headers, response.content
    document = parse(body) if "json" in headers.get("content-type", "") else {}
    # Without what may be secret or long: it is for messages.
    url = str(response.request.url.copy_with(userinfo=b"", query=None))
    return Reply(response.status_code, {name.lower(): value for name, value in headers.items()}, body, document, url)


def parse(text: Union[str, bytes, bytearray]) -> dict[str, Any]:
    """A JSON object; an empty one where the text is none."""
    try:
        document = json.loads(text)
    except ValueError:
        return {}
    return document if isinstance(document, dict) else {}


def refused(status: int, body: Union[bytes, bytearray]) -> ConnectionLost:
    """A stream that was refused at its handshake."""
    document = parse(body)
    return ConnectionLost(document.get("detail", f"the service answered {status}"), status, document)


def closed(code: Union[int, None], reason: str) -> ConnectionLost:
    """A stream that was closed. The code is 4000 and the status of a problem, where there was one."""
    status = (code or 0) - 4000
    # 4409: another stream of the session has taken this one's place.
    is_problem = status > 0 and status != 409
    return ConnectionLost(f"the stream was closed ({code} {reason})", status if is_problem else 0)
