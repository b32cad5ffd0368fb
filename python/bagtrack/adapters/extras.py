"""Packages that an adapter needs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def needs(extra: str) -> Iterator[None]:
    """Names the extra where a package is not installed."""
    try:
        yield
    except ModuleNotFoundError as missing:
        raise ImportError(f"{missing.name} is not installed: pip install 'bagtrack[{extra}]'") from missing
