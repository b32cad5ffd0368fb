"""Boxes carried from one frame through those after it, or before it."""

from __future__ import annotations

import re
from itertools import islice
from os import PathLike, fspath
from pathlib import Path
from typing import Any, Iterable, Iterator, Optional, Sequence, Union, cast

import numpy as np
import numpy.typing as npt

from bagtrack._native import KeyFrames, Tracker
from bagtrack.answer import BoxLike, TargetAnswer

Frame = npt.NDArray[np.uint8]
Frames = Union[str, "PathLike[str]", Sequence[Frame], Iterable[Frame]]

_PICTURES = {".jpg", ".jpeg", ".png", ".webp"}
_RUN_BYTES = 256 << 20
"""So much of a video is decoded at once to be taken backwards."""


def propagate(
    frames: Frames,
    boxes: Union[BoxLike, Sequence[BoxLike]],
    *,
    start: int = 0,
    count: Optional[int] = None,
    backwards: bool = False,
    until_lost: bool = False,
    keyframes: Union[bool, float] = False,
    preset: str = "robust",
    seed: Optional[int] = 0,
    **params: Any,
) -> Iterator[TargetAnswer]:
    """The answers for each frame and target, from `boxes` in frame `start` on.

    `frames` is a video file, an address from which OpenCV reads one, a folder of JPEG, PNG or WebP files in the order
    of their names (for all of these OpenCV must be installed), a sequence of arrays, or anything that gives arrays one
    after the other. `boxes` is one box or several; the trackers are those of `bagtrack track` with the same seed.

    At most `count` frames are tracked after the first one; `backwards` goes from `start` to frame 0, through a file, a
    folder or a sequence. With `until_lost` a target's last answer is the one in which it is lost, and the frames end
    with the last target. With `keyframes` only those answers are given, at the end, between which linear interpolation
    gives every edge of every box to within a pixel, or to within as many as it says.

    `ValueError` where a frame or a box cannot be used, or where there is no frame `start`.
    """
    given = np.asarray(boxes, dtype=float)
    if given.ndim not in (1, 2) or given.shape[-1] != 4 or given.size == 0:
        raise ValueError("boxes are one box, or several: x, y, width, height each")
    if start < 0 or (count is not None and count < 0):
        raise ValueError("start and count are 0 or more")
    if backwards and start == 0:
        raise ValueError("to go backwards give start, the frame of the boxes, from 1 on")
    targets = np.atleast_2d(given)
    tracker = Tracker(preset, seed, **params)
    trackers = [tracker.of_target(target) for target in range(len(targets))]
    answers = _follow(_ordered(frames, start, count, backwards), trackers, targets, until_lost)
    return _thinned(answers, len(targets), float(keyframes)) if keyframes else answers


def _follow(
    frames: Iterator[tuple[int, Frame]], trackers: list[Tracker], boxes: npt.NDArray[Any], until_lost: bool
) -> Iterator[TargetAnswer]:
    followed = dict(enumerate(trackers))
    is_first = True
    for number, frame in frames:
        for target, tracker in list(followed.items()):
            try:
                if is_first:
                    tracker.init(frame, boxes[target])
                else:
                    tracker.update(frame)
            except (TypeError, ValueError) as error:
                raise type(error)(f"frame {number} cannot be tracked: {error}") from error
            answer = TargetAnswer(number, tracker.box, tracker.score, tracker.status, target)
            if until_lost and not answer.ok:
                del followed[target]
            yield answer
        is_first = False
        if not followed:
            return


def _thinned(answers: Iterator[TargetAnswer], targets: int, tolerance: float) -> Iterator[TargetAnswer]:
    pickers = [KeyFrames(tolerance) for _ in range(targets)]
    keys: list[tuple[int, TargetAnswer]] = []
    for order, answer in enumerate(answers):
        keys += pickers[answer.target].push(answer.box, answer.ok, (order, answer))
    keys += [last for picker in pickers if (last := picker.finish()) is not None]
    for _, answer in sorted(keys, key=lambda key: key[0]):
        yield answer


def _ordered(frames: Frames, start: int, count: Optional[int], backwards: bool) -> Iterator[tuple[int, Frame]]:
    """Numbers and pixels in the order in which they are tracked. There is a first one."""
    if isinstance(frames, (str, PathLike)):
        # A `Path` makes one slash of the two in an address, such as that of a camera.
        video = fspath(frames)
        path = Path(video)
        numbered = _of_folder(path, start, backwards) if path.is_dir() else _of_video(video, start, backwards)
    elif isinstance(frames, (Sequence, np.ndarray)):
        listed = cast("Sequence[Frame]", frames)
        numbers = range(start, -1, -1) if backwards else range(start, len(listed))
        numbered = ((number, listed[number]) for number in numbers if start < len(listed))
    elif backwards:
        raise ValueError("to go backwards frames must be a file, a folder, or a sequence")
    else:
        numbered = islice(enumerate(frames), start, None)
    first = next(numbered, None)
    if first is None:
        raise ValueError(f"there is no frame {start}")
    yield first
    yield from islice(numbered, count)


def _of_folder(folder: Path, start: int, backwards: bool) -> Iterator[tuple[int, Frame]]:
    cv2 = _opencv()
    inner = folder / "img"
    paths = (path for path in (inner if inner.is_dir() else folder).iterdir() if path.suffix.lower() in _PICTURES)
    files = sorted(paths, key=lambda path: [int(it) if it.isdigit() else it for it in re.split(r"(\d+)", path.name)])
    numbers = range(start, -1, -1) if backwards else range(start, len(files))
    for number in numbers if start < len(files) else ():
        frame = cv2.imread(str(files[number]))
        if frame is None:
            raise ValueError(f"{files[number]} cannot be read as a picture")
        yield number, frame


def _of_video(video: str, start: int, backwards: bool) -> Iterator[tuple[int, Frame]]:
    if not backwards:
        yield from read_video(video, start, None)
        return
    end = start + 1
    size = 0
    while end > 0:
        # The first run is one frame, which tells how many fit into the next ones.
        begin = max(0, end - max(1, _RUN_BYTES // size)) if size else start
        run = list(read_video(video, begin, end))
        if len(run) < end - begin:
            return
        yield from reversed(run)
        size, end = run[0][1].nbytes, begin


def read_video(video: Union[str, Path], begin: int, end: Optional[int]) -> Iterator[tuple[int, Frame]]:
    """The frames of a video from `begin` on, up to the one before `end`."""
    cv2 = _opencv()
    capture = cv2.VideoCapture(str(video))
    if not capture.isOpened():
        raise ValueError(f"{video} cannot be read as a video")
    try:
        # Seeking by frame numbers is not exact with all codecs.
        if not all(capture.grab() for _ in range(begin)):
            return
        number = begin
        while number != end:
            is_there, frame = capture.read()
            if not is_there:
                return
            yield number, frame.astype(np.uint8, copy=False)
            number += 1
    finally:
        capture.release()


def _opencv() -> Any:
    try:
        import cv2
    except ModuleNotFoundError as missing:
        raise ImportError("files are read by OpenCV: pip install opencv-python-headless") from missing
    return cv2
