"""Pillow's images as the tracker takes them."""

from __future__ import annotations

from typing import Tuple

import numpy as np
import numpy.typing as npt
from PIL import Image


def array(image: Image.Image) -> npt.NDArray[np.uint8]:
    """The pixels of an image: gray, or BGR."""
    if image.mode == "L":
        return np.asarray(image)
    return np.asarray(image.convert("RGB"))[:, :, ::-1]


def read(path: str) -> npt.NDArray[np.uint8]:
    """The pixels of an image file."""
    with Image.open(path) as image:
        return array(image)


def box_of_corners(points: list[float]) -> Tuple[float, float, float, float]:
    """The box between two corners, left, top, right and bottom."""
    left, top, right, bottom = points
    return (min(left, right), min(top, bottom), abs(right - left), abs(bottom - top))
