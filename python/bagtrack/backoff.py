"""How long to wait before a request is sent again."""

from __future__ import annotations

import random
import time
from typing import Optional

FIRST = 0.1
LONGEST = 5.0


class Backoff:
    """Pauses that grow, until the time is up."""

    def __init__(self, retry_for: float) -> None:
        self._begin = time.monotonic()
        self._retry_for = retry_for
        self._own = FIRST

    def next(self, asked: float = 0.0) -> Optional[float]:
        """The next pause in seconds, at least as long as the service asks for; None where the time would be up then."""
        # Clients that were cut off together do not come back together.
        pause = max(self._own * random.uniform(0.5, 1.0), asked)
        self._own = min(2.0 * self._own, LONGEST)
        return None if time.monotonic() + pause - self._begin > self._retry_for else pause


class RecoveryBackoff:
    """Pauses between the recoveries of one call.

    The first comes at once; where every replica loses the session again, they end with the time for retries.
    """

    def __init__(self, retry_for: float) -> None:
        self._backoff = Backoff(retry_for)
        self._has_recovered = False

    def next(self) -> Optional[float]:
        """The pause before the next recovery in seconds; None where the time would be up then."""
        if not self._has_recovered:
            self._has_recovered = True
            return 0.0
        return self._backoff.next()
