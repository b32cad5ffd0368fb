"""Detects once, follows what was found, and detects again when it is lost.

    python detect_and_follow.py clip.mp4 --detector detectors:people

The detector is a function of a module of yours: it takes a frame (height x width x 3, BGR) and gives boxes (x, y,
width, height), the best one first, or none. With a package of detectors that is three lines, such as

    model = ultralytics.YOLO("yolo11n.pt")
    def people(frame):
        return [(x - w / 2, y - h / 2, w, h) for x, y, w, h in model(frame, classes=[0])[0].boxes.xywh.tolist()]

A detection costs as much as many frames of tracking, so the detector is asked in one frame of `--every` while there is
nothing to follow. Prints a line a frame: number, where the box comes from, x, y, width, height, score. Needs OpenCV.
"""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Callable, Iterable, Iterator, Sequence

import cv2
import numpy as np

import bagtrack

Detector = Callable[[np.ndarray], Sequence[Sequence[float]]]


def follow(frames: Iterable[np.ndarray], detect: Detector, every: int) -> Iterator[tuple[str, bagtrack.Tracker | None]]:
    """For each frame "detected", "followed" or "nothing", and the tracker."""
    tracker = None
    since = every
    for frame in frames:
        if tracker is not None and tracker.update(frame)[0]:
            yield "followed", tracker
            continue
        since += 1
        found = detect(frame) if since >= every else []
        since = 0 if since >= every else since
        if len(found):
            # A new tracker: the lost one may have learned what is not the target.
            tracker = bagtrack.Tracker()
            tracker.init(frame, found[0])
            since = every
            yield "detected", tracker
        else:
            yield "nothing", tracker


def read(video: str) -> Iterator[np.ndarray]:
    capture = cv2.VideoCapture(int(video) if video.isdigit() else video)
    while (read := capture.read())[0]:
        yield read[1]


def main() -> None:
    parser = argparse.ArgumentParser(description="Detects once, follows, and detects again when the target is lost.")
    parser.add_argument("video", help="a file, or the number of a camera")
    parser.add_argument("--detector", required=True, metavar="MODULE:FUNCTION")
    parser.add_argument("--every", type=int, default=5, help="frames between two detections while there is no target")
    options = parser.parse_args()

    module, _, name = options.detector.partition(":")
    detect = getattr(importlib.import_module(module), name)
    for number, (source, tracker) in enumerate(follow(read(options.video), detect, options.every)):
        if source == "nothing":
            print(number, source)
        else:
            print(number, source, *(f"{value:.1f}" for value in tracker.box), f"{tracker.score:.2f}")


if __name__ == "__main__":
    main()
