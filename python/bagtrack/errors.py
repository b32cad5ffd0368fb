"""What a service refuses, and a service that gives no answer."""

from __future__ import annotations

import re
from typing import Any

TEMPORARY = (408, 429, 502, 503, 504)
"""Statuses with which the same request may succeed later: of the service, and of proxies before it."""


class ServiceError(Exception):
    """The service refused a request; the session is as it was. Its problem document (RFC 9457) says what to do.

    Also an answer that is none of the service's, such as a page of a proxy: its status is below 400.
    """

    def __init__(self, status: int, problem: dict[str, Any]) -> None:
        super().__init__(problem.get("detail") or problem.get("title") or f"the service answered {status}")
        self.status = status
        """The status code."""
        self.problem = problem
        """The problem document."""

    @property
    def kind(self) -> str:
        """The kind of problem, like `invalid-box`; empty where the answer was no problem document."""
        return re.split("[#:]", str(self.problem.get("type", "")))[-1]

    @property
    def is_temporary(self) -> bool:
        """Whether the same request may succeed later."""
        return self.status in TEMPORARY or self.kind == "not-in-order"


class ServiceUnavailable(Exception):
    """The service gave no answer for as long as the client tries. The next call sends that frame before its own."""
