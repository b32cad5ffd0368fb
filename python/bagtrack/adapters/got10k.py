"""The tracker for the GOT-10k toolkit, which runs the experiments of GOT-10k, OTB, VOT, LaSOT, UAV123 and others.

    from bagtrack.adapters.got10k import BagTracker
    from got10k.experiments import ExperimentOTB

    experiment = ExperimentOTB("OTB", version=2015)
    experiment.run(BagTracker(seed=0))
    experiment.report(["bagtrack"])
"""

from __future__ import annotations

from typing import Any, Optional

import numpy as np
import numpy.typing as npt
from got10k.trackers import Tracker as ToolkitTracker
from PIL import Image

import bagtrack
from bagtrack.adapters import pictures

# The files of these benchmarks count pixels from 1.
FIRST_PIXEL: npt.NDArray[np.float64] = np.array([1.0, 1.0, 0.0, 0.0])


class BagTracker(ToolkitTracker):  # type: ignore[misc]
    """The tracker under the toolkit's interface. `preset`, `seed` and `params` are those of `bagtrack.Tracker`."""

    def __init__(
        self, name: str = "bagtrack", preset: str = "robust", seed: Optional[int] = None, **params: Any
    ) -> None:
        super().__init__(name=name, is_deterministic=seed is not None)
        self._tracker = bagtrack.Tracker(preset, seed, **params)

    def init(self, image: Image.Image, box: npt.ArrayLike) -> None:
        """Starts on the first image of a sequence."""
        self._tracker.init(pictures.array(image), np.asarray(box, float) - FIRST_PIXEL)

    def update(self, image: Image.Image) -> npt.NDArray[np.float64]:
        """The box in the next image."""
        _, box = self._tracker.update(pictures.array(image))
        return np.array(box, np.float64) + FIRST_PIXEL
