"""What is known of one frame as `supervision.Detections`, for its annotators, zones and sinks.

    from bagtrack.adapters.supervision import to_detections

    detections = to_detections([tracker])           # one tracker, several, or the answers of `bagtrack.propagate`
    picture = supervision.BoxAnnotator().annotate(frame, detections)
"""

from __future__ import annotations

from typing import Iterable, Protocol

import numpy as np
import supervision as sv

from bagtrack.answer import Box, Status


class Located(Protocol):
    """What says where its target is: an `Answer`, a `Tracker`, a `Client`."""

    @property
    def frame(self) -> int: ...
    @property
    def box(self) -> Box: ...
    @property
    def score(self) -> float: ...
    @property
    def status(self) -> Status: ...


def to_detections(located: Iterable[Located], class_id: int = 0, keep_lost: bool = False) -> sv.Detections:
    """A detection for each target in a frame, with the score as confidence, and `frame` and `status` as data.

    `tracker_id` is the target of answers that have one, else the place in the order given. Those that are lost are left
    out, unless `keep_lost`.
    """
    kept = [(index, it) for index, it in enumerate(located) if keep_lost or it.status != "lost"]
    if not kept:
        return sv.Detections.empty()
    boxes = np.array([it.box for _, it in kept], dtype=float)
    return sv.Detections(
        xyxy=np.hstack([boxes[:, :2], boxes[:, :2] + boxes[:, 2:]]),
        confidence=np.array([it.score for _, it in kept], dtype=float),
        class_id=np.full(len(kept), class_id),
        tracker_id=np.array([getattr(it, "target", index) for index, it in kept]),
        data={"frame": np.array([it.frame for _, it in kept]), "status": np.array([it.status for _, it in kept])},
    )
