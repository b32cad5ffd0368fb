"""The tracker as an auto-annotation function of CVAT: rectangles go on from one frame to the next.

    cvat-cli function create-native bagtrack --function-module bagtrack.adapters.cvat
    cvat-cli function run-agent ID --function-module bagtrack.adapters.cvat

`-p preset=str:paper` and `-p seed=int:7` set what `bagtrack.Tracker` takes.
"""

from __future__ import annotations

from typing import Any, Optional

import cvat_sdk.auto_annotation as cvataa
import numpy as np
import numpy.typing as npt
from PIL import Image

import bagtrack
from bagtrack.adapters import pictures


class TrackingFunction:
    """A `cvat_sdk.auto_annotation.TrackingFunction`; its tracking state is a `bagtrack.Tracker`."""

    def __init__(self, preset: str = "robust", seed: Optional[int] = None, **params: Any) -> None:
        self.spec = cvataa.TrackingFunctionSpec(supported_shape_types={"rectangle"})
        self._settings: dict[str, Any] = {"preset": preset, "seed": seed, **params}
        # What cannot be used is said at the start.
        bagtrack.Tracker(**self._settings)

    def preprocess_image(
        self, context: cvataa.TrackingFunctionContext, image: Image.Image
    ) -> npt.NDArray[np.uint8]:
        """The image as all shapes on it take it."""
        return np.ascontiguousarray(pictures.array(image))

    def init_tracking_state(
        self,
        context: cvataa.TrackingFunctionShapeContext,
        pp_image: npt.NDArray[np.uint8],
        shape: cvataa.TrackableShape,
    ) -> bagtrack.Tracker:
        """A tracker that stands at this shape."""
        tracker = bagtrack.Tracker(**self._settings)
        tracker.init(pp_image, pictures.box_of_corners(shape.points))
        return tracker

    def track(
        self,
        context: cvataa.TrackingFunctionShapeContext,
        pp_image: npt.NDArray[np.uint8],
        state: bagtrack.Tracker,
    ) -> Optional[cvataa.TrackableShape]:
        """The shape on the next image; None where it is lost."""
        ok, (x, y, width, height) = state.update(pp_image)
        if not ok:
            return None
        return cvataa.TrackableShape(type="rectangle", points=[x, y, x + width, y + height])


def create(preset: str = "robust", seed: Optional[int] = None, **params: Any) -> TrackingFunction:
    """Called by `cvat-cli`, with the parameters of `-p`."""
    return TrackingFunction(preset, seed, **params)
