"""Arrays to image files, as they are sent."""

from __future__ import annotations

import io
from typing import Literal, Union

import numpy as np
import numpy.typing as npt
from PIL import Image

Encoding = Literal["jpeg", "png"]
Frame = Union[bytes, bytearray, memoryview, npt.NDArray[np.uint8]]
"""An image file as it is, or an array as the tracker takes it."""


def encode(frame: Frame, encoding: Encoding, quality: int) -> bytes:
    """The bytes of `frame` as an image file. `TypeError` or `ValueError` where it is no frame."""
    if isinstance(frame, (bytes, bytearray, memoryview)):
        return bytes(frame)
    if not isinstance(frame, np.ndarray):
        name = type(frame).__name__
        raise TypeError(f"a frame is a NumPy array, or the bytes of an image file (Path(...).read_bytes()), not {name}")
    if frame.dtype != np.uint8:
        raise ValueError(f"a frame has the dtype uint8, not {frame.dtype}")
    if frame.ndim == 3 and frame.shape[2] == 1:
        frame = frame[:, :, 0]
    if frame.ndim == 3 and frame.shape[2] == 3:
        frame = frame[:, :, ::-1]
    elif frame.ndim != 2:
        raise ValueError(f"a frame has the shape (height, width) or (height, width, 3), not {frame.shape}")
    file = io.BytesIO()
    image = Image.fromarray(np.ascontiguousarray(frame))
    if encoding == "png":
        image.save(file, "PNG", compress_level=1)
    else:
        image.save(file, "JPEG", quality=quality)
    return file.getvalue()
