"""The tracker with the interface of OpenCV's: in a script, `bagtrack.cv.Tracker` takes the place of `cv2.TrackerCSRT`.

    tracker = bagtrack.cv.Tracker_create()      # cv2.TrackerCSRT_create()

Names, arguments and results are those of OpenCV, boxes of whole pixels included. `bagtrack.Tracker` tells more: boxes
in fractions of a pixel, and the best guess where the target is lost.
"""

from __future__ import annotations

from typing import Any, Optional, Tuple

import numpy as np
import numpy.typing as npt

from bagtrack._native import Tracker as _Tracker
from bagtrack.answer import BoxLike

Rect = Tuple[int, int, int, int]
"""x, y, width and height in whole pixels."""

_NOWHERE: Rect = (0, 0, 0, 0)


class Tracker:
    """Follows one object. Frames are arrays of uint8: gray, or BGR. Pickle and `copy.deepcopy` keep the whole state."""

    def __init__(self, preset: str = "robust", seed: Optional[int] = 0, **params: Any) -> None:
        """As `bagtrack.Tracker`."""
        self._tracker = _Tracker(preset, seed, **params)
        self._score = 0.0

    @classmethod
    def create(cls, preset: str = "robust", seed: Optional[int] = 0, **params: Any) -> Tracker:
        """As `bagtrack.Tracker`."""
        return cls(preset, seed, **params)

    def init(self, image: npt.NDArray[np.uint8], boundingBox: BoxLike) -> None:
        """Starts on `image` with the target in `boundingBox`, or starts again. Floats are taken, too.

        `ValueError` where the image or the box cannot be used: each side of a box has at least 4 pixels, and some of it
        lies inside.
        """
        self._tracker.init(image, boundingBox)
        self._score = self._tracker.score

    def update(self, image: Optional[npt.NDArray[np.uint8]]) -> tuple[bool, Rect]:
        """Finds the target in the next frame.

        It is `(False, (0, 0, 0, 0))` where the target is lost, and where the frame is empty or has another size than
        the first one: then it does not count, and the next one may be good. `RuntimeError` before `init`.
        """
        width, height = self._tracker.frame_size
        if image is None or (isinstance(image, np.ndarray) and image.shape[:2] != (height, width)):
            self._score = 0.0
            return False, _NOWHERE
        found, (x, y, w, h) = self._tracker.update(image)
        self._score = self._tracker.score
        return found, (round(x), round(y), round(w), round(h)) if found else _NOWHERE

    def getTrackingScore(self) -> float:
        """The chance, from 0 to 1, that the last box overlaps the target by half or more; 0 after a frame that does not
        count."""
        return self._score

    @property
    def tracker(self) -> _Tracker:
        """What this stands on, with everything that OpenCV's interface has no name for."""
        return self._tracker


def Tracker_create(preset: str = "robust", seed: Optional[int] = 0, **params: Any) -> Tracker:
    """`Tracker.create`."""
    return Tracker.create(preset, seed, **params)
