"""The tracker as a machine learning backend of Label Studio: boxes of `VideoRectangle` go on through the video.

A backend's `model.py`, for `label-studio-ml init` and `start`:

    from bagtrack.adapters.label_studio import BagTrack

Whoever draws a box gets the boxes of the frames after it. Where the target is lost the object is switched off: in the
last frame before, since Label Studio shows a key frame that is not enabled, and hides what follows it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Iterator

import cv2
import numpy as np
import numpy.typing as npt
from label_studio_ml.model import LabelStudioMLBase

import bagtrack
from bagtrack.propagation import read_video

KIND = "videorectangle"


class BagTrack(LabelStudioMLBase):  # type: ignore[misc]
    """The backend. It is not trained."""

    max_frames = 1000
    """At most so many frames are tracked in one call, which Label Studio does not wait for without end."""
    settings: dict[str, Any] = {}
    """What `bagtrack.Tracker` takes."""

    def predict(self, tasks: list[dict[str, Any]], context: Any = None, **options: Any) -> list[dict[str, Any]]:
        """The tracks of the objects that were drawn in the first task's video: each goes on from its last box."""
        drawn = [region for region in (context or {}).get("result", []) if region.get("type") == KIND]
        if not drawn or not tasks:
            return [{"result": [], "score": 0.0} for _ in tasks]
        regions, scores = [], []
        for region in drawn:
            address = tasks[0]["data"][self._video_key(tasks[0], region["to_name"])]
            track, score = self._track(self._file(address, tasks[0]), region["value"])
            regions.append({**region, "value": track, "score": score})
            scores.append(score)
        return [{"result": regions, "score": min(scores)}]

    def fit(self, *_: Any, **__: Any) -> dict[str, Any]:
        """Nothing is learned."""
        return {}

    def _track(self, video: str, value: dict[str, Any]) -> tuple[dict[str, Any], float]:
        """The value of a region with the boxes after its last one, and the least score."""
        track = [dict(item) for item in sorted(value["sequence"], key=lambda item: item["frame"])]
        last = track[-1]
        tracker = bagtrack.Tracker(**self.settings)
        scores = [1.0]
        for number, frame, time in frames(video, last["frame"], self.max_frames + 1):
            size = np.array([frame.shape[1], frame.shape[0]] * 2)
            if number == last["frame"]:
                shares = np.array([last[name] for name in ("x", "y", "width", "height")], float)
                tracker.init(frame, shares / 100 * size)
                continue
            ok, box = tracker.update(frame)
            scores.append(tracker.score)
            x, y, width, height = (np.array(box) / size * 100).tolist()
            if not ok:
                track[-1]["enabled"] = False
                continue
            item = {"frame": number, "x": x, "y": y, "width": width, "height": height}
            track.append({**item, "enabled": True, "rotation": 0, "time": time})
        return {**value, "sequence": track}, min(scores)

    def _video_key(self, task: dict[str, Any], to_name: str) -> str:
        """The field of the task's data that the tag of this name shows."""
        controls: dict[str, Any] = getattr(self, "parsed_label_config", None) or {}
        for control in controls.values():
            if to_name in control.get("to_name", []) and control.get("inputs"):
                return str(control["inputs"][0]["value"])
        return str(next(iter(task["data"])))

    def _file(self, address: str, task: dict[str, Any]) -> str:
        """The video as a file."""
        if Path(address).is_file():
            return address
        try:
            return str(self.get_local_path(address, task_id=task.get("id")))
        except TypeError:
            # Older versions of the backend's package do not take the task.
            return str(self.get_local_path(address))


def frames(video: str, first: int, count: int) -> Iterator[tuple[int, npt.NDArray[np.uint8], float]]:
    """Number (from 1), pixels and time in seconds of at most `count` frames from `first` on."""
    rate = cv2.VideoCapture(video).get(cv2.CAP_PROP_FPS) or 25.0
    for number, frame in read_video(Path(video), first - 1, first - 1 + count):
        yield number + 1, frame, number / rate
