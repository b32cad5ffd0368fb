from typing import Any

import numpy as np
import numpy.typing as npt

from bagtrack.answer import Box, BoxLike, Status

__version__: str
"""The version of the package."""

class Tracker:
    """Follows one object through frames, in this process.

    A frame is an array of uint8: height x width (gray), or height x width x 3 (BGR, as OpenCV reads images). A box is
    (x, y, width, height) in pixels, 0-based, and may reach over the edge. While the tracker works, other threads run.
    An error changes nothing: `ValueError` where a frame, a box or a parameter cannot be used. Pickle, `copy.copy` and
    `copy.deepcopy` make trackers that go on bit for bit, as `save` and `load` do.
    """

    def __init__(self, preset: str = "robust", seed: int | None = 0, **params: Any) -> None:
        """`preset` is "robust", or "paper" for the equations as printed. The same seed and frames give the same boxes,
        bit for bit on one kind of machine; with None it is drawn from Python's `random`. `params` sets single
        parameters of the preset: `params` of a tracker lists them, docs.rs and the service's OpenAPI document describe
        them.
        """

    def init(self, frame: npt.NDArray[np.uint8], box: BoxLike) -> None:
        """Starts on `frame` with the target in `box`; whatever was followed before is forgotten."""

    def update(self, frame: npt.NDArray[np.uint8]) -> tuple[bool, Box]:
        """Finds the target in the next frame. `ok` is False where the target is lost; the box is the best guess then.

        All frames have the size of the first one. `RuntimeError` before `init`.
        """

    def retarget(self, frame: npt.NDArray[np.uint8], box: BoxLike) -> None:
        """The user corrects the box: `frame` counts as the next one, with `box` as its answer."""

    def save(self) -> bytes:
        """The whole state."""

    @classmethod
    def load(cls, snapshot: bytes) -> Tracker:
        """A tracker that goes on from what `save` gave, bit for bit. `ValueError` for other or damaged bytes."""

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
