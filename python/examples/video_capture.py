"""Follows an object through a video or a camera, in process or with a service.

    python video_capture.py clip.mp4 --box 44,101,46,58
    python video_capture.py 0                                # the first camera: draw the box in the window
    python video_capture.py clip.mp4 --box 44,101,46,58 --url http://127.0.0.1:8080 --out tracked.mp4

Prints a line a frame: number, x, y, width, height, score, status. Needs OpenCV (opencv-python, or
opencv-python-headless without a window), and bagtrack[client] for --url.
"""

from __future__ import annotations

import argparse

import cv2

import bagtrack

COLORS = {"tracking": (0, 200, 0), "uncertain": (0, 165, 255), "lost": (0, 0, 255)}


def numbers(text: str) -> tuple[float, ...]:
    return tuple(float(number) for number in text.split(","))


def main() -> None:
    parser = argparse.ArgumentParser(description="Follows an object through a video or a camera.")
    parser.add_argument("video", help="a file, or the number of a camera")
    parser.add_argument("--box", type=numbers, help="x,y,width,height in the first frame; without it you draw it")
    parser.add_argument("--url", help="track with the service at this address, not in process")
    parser.add_argument("--seed", type=int, default=0, help="the same seed gives the same boxes")
    parser.add_argument("--out", help="write the video with its boxes into this file")
    options = parser.parse_args()

    video = cv2.VideoCapture(int(options.video) if options.video.isdigit() else options.video)
    ok, frame = video.read()
    if not ok:
        parser.error(f"{options.video} has no frame to read")
    box = options.box or cv2.selectROI("bagtrack", frame)
    tracker = bagtrack.Client(options.url, seed=options.seed) if options.url else bagtrack.Tracker(seed=options.seed)
    writer = None
    if options.out:
        size = (frame.shape[1], frame.shape[0])
        writer = cv2.VideoWriter(options.out, cv2.VideoWriter.fourcc(*"mp4v"), video.get(cv2.CAP_PROP_FPS) or 25, size)

    tracker.init(frame, box)
    while ok:
        print(tracker.frame, *(f"{number:.2f}" for number in tracker.box), f"{tracker.score:.2f}", tracker.status)
        if writer:
            x, y, width, height = (round(number) for number in tracker.box)
            cv2.rectangle(frame, (x, y), (x + width, y + height), COLORS[tracker.status], 2)
            writer.write(frame)
        ok, frame = video.read()
        if ok:
            tracker.update(frame)
    if writer:
        writer.release()
    if options.url:
        tracker.close()


if __name__ == "__main__":
    main()
