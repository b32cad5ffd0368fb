"""Follows an object through frames: in process (`Tracker`), or with a bagtrack service (`Client`, `AsyncClient`).

All three have one interface, which users of OpenCV's trackers know: `init(frame, box)`, then `update(frame)` for each
frame, which gives `(ok, box)`. Boxes are (x, y, width, height) in pixels of the frame, floats, 0-based. The module
`bagtrack.cv` has OpenCV's interface to the letter. `propagate` carries boxes through a whole video.
"""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from bagtrack import cv
from bagtrack._native import NanoTrack, Tracker, __version__
from bagtrack.answer import Answer, Box, Status, TargetAnswer
from bagtrack.errors import ServiceError, ServiceUnavailable
from bagtrack.propagation import propagate

if TYPE_CHECKING:
    from bagtrack.async_client import AsyncClient
    from bagtrack.client import Client

__all__ = [
    "Answer",
    "Box",
    "NanoTrack",
    "ServiceError",
    "ServiceUnavailable",
    "Status",
    "TargetAnswer",
    "Tracker",
    "__version__",
    "cv",
    "propagate",
]
# Without the extra `from bagtrack import *` gives the rest.
if find_spec("httpx") and find_spec("PIL"):
    __all__ += ["AsyncClient", "Client"]


def __getattr__(name: str) -> Any:
    if name in ("AsyncClient", "Client"):
        try:
            from bagtrack import async_client, client
        except ModuleNotFoundError as missing:
            reason = f"bagtrack.{name} needs {missing.name}: pip install 'bagtrack[client]'"
            raise ImportError(reason) from missing
        return client.Client if name == "Client" else async_client.AsyncClient
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
