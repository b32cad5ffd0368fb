import os
from typing import Any

import numpy as np
import numpy.typing as npt

from bagtrack.answer import Box, BoxLike, Status

__version__: str
"""The version of the package."""

class NanoTrack:
    """A network that gives trackers a second opinion of every frame, or, `in_doubt`, of those of which the tracker is not
    sure: with a score below 0.95. Trackers share it. Pickle and copy read its files again.
    """

    def __init__(
        self,
        backbone: str | os.PathLike[str],
        head: str | os.PathLike[str],
        in_doubt: bool = False,
    ) -> None:
        """The ONNX files of NanoTrack, version 2 or 3, which its author publishes. `OSError` for a file that cannot be
        read, `ValueError` for files that are no such network.
        """

class Tracker:
    """Follows one object through frames, in this process.

    A frame is an array of uint8: height x width (gray), or height x width x 3 (BGR, as OpenCV reads images). A box is
    (x, y, width, height) in pixels, 0-based, and may reach over the edge. While the tracker works, other threads run.
    An error changes nothing: `ValueError` where a frame, a box or a parameter cannot be used. Pickle, `copy.copy` and
    `copy.deepcopy` make trackers that go on bit for bit, as `save` and `load` do.
    """

    def __init__(
        self,
        preset: str = "robust",
        seed: int | None = 0,
        *,
        model: NanoTrack | None = None,
        **params: Any,
    ) -> None:
        """`preset` is "robust", or "paper" for the equations as printed. The same seed and frames give the same boxes,
        bit for bit on one kind of machine; with None it is drawn from Python's `random`. `params` sets single
        parameters of the preset: `params` of a tracker lists them, docs.rs and the service's OpenAPI document describe
        them. `model` gives a second opinion, with "robust" alone.
        """

    def init(self, frame: npt.NDArray[np.uint8], box: BoxLike) -> None:
        """Starts on `frame` with the target in `box`; whatever was followed before is forgotten."""

    def of_target(self, target: int) -> Tracker:
        """A tracker without a target and with these parameters, for one of several targets that see the same frames,
        counted from 0: each has draws of its own, and those of the first are these."""

    def update(self, frame: npt.NDArray[np.uint8]) -> tuple[bool, Box]:
        """Finds the target in the next frame. `ok` is False where the target is lost; the box is the best guess then.

        All frames have the size of the first one. `RuntimeError` before `init`.
        """

    def retarget(self, frame: npt.NDArray[np.uint8], box: BoxLike) -> None:
        """The user corrects the box: `frame` counts as the next one, with `box` as its answer."""

    def save(self) -> bytes:
        """The whole state."""

    @classmethod
    def load(cls, snapshot: bytes, model: NanoTrack | None = None) -> Tracker:
        """A tracker that goes on from what `save` gave, bit for bit. `ValueError` for other or damaged bytes, and where
        the tracker began with a model and the same one is not given. One that began without goes on without.
        """

    @property
    def box(self) -> Box:
        """The last answer."""

    @property
    def score(self) -> float:
        """The chance, from 0 to 1, that the box overlaps the target by half or more."""

    @property
    def status(self) -> Status:
        """What the score and its history mean."""

    @property
    def frame(self) -> int:
        """The number of the last frame; the first is 0."""

    @property
    def frame_size(self) -> tuple[int, int]:
        """Width and height of the frames."""

    @property
    def params(self) -> dict[str, Any]:
        """All parameters by their names."""

class KeyFrames:
    """Picks the key frames of one target's track, as its boxes come: linear interpolation between two of them gives
    every edge of every box left out to within `tolerance` pixels.
    """

    def __init__(self, tolerance: float) -> None: ...
    def push(self, box: BoxLike, is_shown: bool, row: Any) -> list[Any]:
        """Takes the next box, with whatever goes with it, and gives the rows of the key frames that are certain now.
        Runs in which `is_shown` is the same have a key frame at each end."""

    def finish(self) -> Any | None:
        """The row of the last key frame, if it was not given yet."""
