"""Tracks through many videos at once, a thread a core: the interpreter is free while trackers work.

    python many_videos.py a.mp4:44,101,46,58 b.mp4:10,20,30,40 --out tracks

Writes a CSV file for each video, and prints the frames a second of all together. Needs OpenCV.
"""

from __future__ import annotations

import argparse
import csv
import os
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2

import bagtrack


def track(video: Path, box: tuple[float, ...], out: Path) -> int:
    """Tracks through a video, and gives the number of its frames."""
    count = 0
    with open(out / f"{video.stem}.csv", "w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["frame", "x", "y", "width", "height", "score", "status"])
        for answer in bagtrack.propagate(video, box):
            rows.writerow([answer.frame, *answer.box, answer.score, answer.status])
            count += 1
    return count


def main() -> None:
    parser = argparse.ArgumentParser(description="Tracks through many videos at once.")
    parser.add_argument("videos", nargs="+", metavar="VIDEO:X,Y,W,H")
    parser.add_argument("--out", type=Path, default=Path("tracks"))
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    options = parser.parse_args()

    # OpenCV's own threads would take turns with ours.
    cv2.setNumThreads(1)
    options.out.mkdir(parents=True, exist_ok=True)
    jobs = []
    for video in options.videos:
        path, _, box = video.rpartition(":")
        jobs.append((Path(path), tuple(map(float, box.split(","))), options.out))
    started = time.perf_counter()
    with ThreadPoolExecutor(options.threads) as pool:
        count = sum(pool.map(lambda job: track(*job), jobs))
    print(f"{count} frames, {count / (time.perf_counter() - started):.0f} a second")


if __name__ == "__main__":
    main()
