"""What a service refuses, and a service that gives no answer."""

from __future__ import annotations

import re
from typing import Any


class ServiceError(Exception):
    """The service refused a request; the session is as it was. Its problem document (RFC 9457) says what to do."""

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


class ServiceUnavailable(Exception):
    """The service gave no answer for as long as the client tries. The next call sends that frame before its own."""
